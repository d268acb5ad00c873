// SPDX-License-Identifier: Apache-2.0
/** One arm in the scene: tubes, base, tip and the trail of the tip. */
import * as THREE from "three";

import type { Arm } from "../state/robot";
import type { JointState, PoseStamped, Shape } from "../wire/messages";
import { armColor, bodyColor } from "./colors";
import { label } from "./label";
import { computeFrames, makeFrames, makeMesh, sweep } from "./sweep";

const kMostPoints = 256;
const kMostRings = kMostPoints + 8;
const kSides = 20;
const kTrail = 4096;
const kTrailStep = 2e-4; // m: nearer points are indistinguishable

/** A direction of the arm's base frame in the robot's base frame. */
export function baseAxis(arm: Arm, axis: readonly [number, number, number]): number[] {
  const [x = 0, y = 0, z = 0, w = 1] = arm.base.orientation;
  return new THREE.Vector3(...axis).applyQuaternion(new THREE.Quaternion(x, y, z, w)).toArray();
}

export class ArmView {
  readonly group = new THREE.Group();
  readonly tip = new THREE.Vector3();
  hasTip = false;
  private readonly mesh = makeMesh(kMostRings, kSides);
  private readonly frames = makeFrames(kMostPoints);
  private readonly geometry = new THREE.BufferGeometry();
  private readonly material = new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 0.45, metalness: 0.15 });
  private readonly tube: THREE.Mesh;
  private readonly trail: THREE.Line;
  private readonly trailPoints = new Float32Array(3 * kTrail);
  private trailCount = 0;
  private readonly zero: number[];
  private readonly axes = new THREE.AxesHelper(0.008);

  constructor(
    private readonly arm: Arm,
    private readonly index: number,
    name: string,
  ) {
    const attribute = (values: Float32Array): THREE.BufferAttribute =>
      new THREE.BufferAttribute(values, 3).setUsage(THREE.DynamicDrawUsage);
    this.geometry.setAttribute("position", attribute(this.mesh.position));
    this.geometry.setAttribute("normal", attribute(this.mesh.normal));
    this.geometry.setAttribute("color", attribute(this.mesh.color));
    this.geometry.setIndex(new THREE.BufferAttribute(this.mesh.index, 1));
    this.geometry.setDrawRange(0, 0);
    this.tube = new THREE.Mesh(this.geometry, this.material);
    this.tube.frustumCulled = false; // its bounds change with every sample
    const trailGeometry = new THREE.BufferGeometry();
    trailGeometry.setAttribute("position", attribute(this.trailPoints));
    trailGeometry.setDrawRange(0, 0);
    this.trail = new THREE.Line(
      trailGeometry,
      new THREE.LineBasicMaterial({ color: armColor(index), transparent: true, opacity: 0.75 }),
    );
    this.trail.frustumCulled = false;
    const letter = label(name, armColor(index));
    letter.position.fromArray(arm.base.position).add(new THREE.Vector3(0, 0, -0.012));
    this.axes.visible = false;
    this.group.add(this.tube, this.trail, letter, this.axes, this.entry());
    this.zero = baseAxis(arm, [1, 0, 0]);
  }

  /** Entry point of the tubes, s = 0. */
  private entry(): THREE.Object3D {
    const radius = Math.max(...this.arm.tubes.map((tube) => 2 * tube.outer_radius), 0.002);
    const ring = new THREE.Mesh(
      new THREE.TorusGeometry(1.2 * radius, 0.25 * radius, 8, 32),
      new THREE.MeshStandardMaterial({ color: armColor(this.index), roughness: 0.6 }),
    );
    const [x = 0, y = 0, z = 0, w = 1] = this.arm.base.orientation;
    ring.position.fromArray(this.arm.base.position);
    ring.quaternion.set(x, y, z, w);
    return ring;
  }

  /** @param thickness factor on the drawn radius of the tubes. */
  update(shape: Shape, joints: JointState | null, thickness: number): void {
    const count = Math.min(shape.tubes.length, kMostPoints);
    if (count < 2) return;
    const tubes = this.arm.tubes.length;
    const angles = joints ? Array.from(joints.position.slice(tubes, 2 * tubes)) : [];
    const colors = this.arm.tubes.map((_, k) => new THREE.Color(bodyColor(this.index, k, tubes)).toArray());
    computeFrames(shape.points, count, this.zero, this.frames);
    const backbone = { points: shape.points, tubes: shape.tubes.subarray(0, count), radius: shape.outer_radius };
    sweep(backbone, this.frames, { colors, angles, stripe: 0.34 }, thickness, kSides, this.mesh);
    for (const name of ["position", "normal", "color"]) this.geometry.getAttribute(name).needsUpdate = true;
    this.geometry.setDrawRange(0, this.mesh.drawn);
  }

  moveTip(pose: PoseStamped): void {
    const { position: p, orientation: o } = pose.pose;
    this.tip.set(p.x, p.y, p.z);
    this.hasTip = true;
    this.axes.visible = true;
    this.axes.position.copy(this.tip);
    this.axes.quaternion.set(o.x, o.y, o.z, o.w);
    this.extendTrail();
  }

  private extendTrail(): void {
    const last = 3 * (this.trailCount - 1);
    const t = this.trailPoints;
    if (
      this.trailCount > 0 &&
      Math.hypot(t[last]! - this.tip.x, t[last + 1]! - this.tip.y, t[last + 2]! - this.tip.z) < kTrailStep
    )
      return;
    if (this.trailCount === kTrail) {
      // Drops the older half, so that points are moved only once per 2048.
      t.copyWithin(0, 3 * (kTrail / 2));
      this.trailCount = kTrail / 2;
    }
    this.tip.toArray(t, 3 * this.trailCount);
    this.trailCount += 1;
    this.trail.geometry.getAttribute("position").needsUpdate = true;
    this.trail.geometry.setDrawRange(0, this.trailCount);
  }
  clearTrail(): void {
    this.trailCount = 0;
    this.trail.geometry.setDrawRange(0, 0);
  }

  /** Marks the shape as stale or current. @returns whether that has changed. */
  setStale(stale: boolean): boolean {
    if (this.material.transparent === stale) return false;
    this.material.transparent = stale;
    this.material.opacity = stale ? 0.3 : 1;
    this.material.needsUpdate = true;
    return true;
  }
}
