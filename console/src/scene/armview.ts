// SPDX-License-Identifier: Apache-2.0
/** One arm in the scene: tubes, base, tip and the trail of the tip. */
import * as THREE from "three";

import type { Arm } from "../state/robot";
import type { JointState, PoseStamped, Shape } from "../wire/messages";
import { baseAxis } from "./base";
import type { Closest } from "./closeness";
import type { Extent } from "./fit";
import { kLabel, label } from "./label";
import { TubeMesh } from "./tubemesh";

const kAxes = 0.008; // m, of the frame at the tip
const kLetter = 0.012; // m, of the letter before the base
const kAhead = 0.8; // of the reach: a tip that is not known yet
const kExtents = 12; // places along a body that the camera has to see
const kTrail = 4096;
const kTrailStep = 2e-4; // m: nearer points are indistinguishable

export class ArmView {
  readonly group = new THREE.Group();
  readonly tip = new THREE.Vector3();
  hasTip = false;
  private readonly tube: TubeMesh;
  private readonly trail: THREE.Line;
  private readonly trailPoints = new Float32Array(3 * kTrail);
  private trailCount = 0;
  private readonly axes = new THREE.AxesHelper(kAxes);
  private readonly letter: THREE.Sprite;
  /** Of the body, m; none: not known. */
  private backbone: ArrayLike<number> = [];

  constructor(
    private readonly arm: Arm,
    name: string,
  ) {
    this.tube = new TubeMesh(arm);
    const trailGeometry = new THREE.BufferGeometry();
    trailGeometry.setAttribute(
      "position",
      new THREE.BufferAttribute(this.trailPoints, 3).setUsage(THREE.DynamicDrawUsage),
    );
    trailGeometry.setDrawRange(0, 0);
    this.trail = new THREE.Line(
      trailGeometry,
      new THREE.LineBasicMaterial({ color: arm.color, transparent: true, opacity: 0.75 }),
    );
    this.trail.frustumCulled = false;
    this.letter = label(name, arm.color);
    this.letter.position.fromArray(arm.base.position).add(new THREE.Vector3(0, 0, -kLetter));
    this.axes.visible = false;
    (this.axes.material as THREE.Material).depthTest = false; // visible although it begins inside the tube
    this.axes.renderOrder = 9;
    this.group.add(this.tube.object, this.trail, this.letter, this.axes, this.entry());
  }

  /** Of the tip, once it is known. */
  get place(): { position: THREE.Vector3; orientation: THREE.Quaternion } {
    return { position: this.tip, orientation: this.axes.quaternion };
  }

  /** What the camera has to see: entry, letter, tip and body. @param reach  of an arm whose tip is not known, m */
  extents(reach: number): Extent[] {
    const base = new THREE.Vector3().fromArray(this.arm.base.position);
    const ahead = new THREE.Vector3().fromArray(baseAxis(this.arm, [0, 0, 1])).multiplyScalar(kAhead * reach);
    const radius = this.entryRadius;
    const count = this.backbone.length / 3;
    const body = Array.from({ length: Math.min(kExtents, count) }, (_, k) => Math.floor((k * count) / kExtents));
    return [
      { at: base, radius: 1.5 * radius },
      { at: this.letter.position, radius: 0.5 * Math.SQRT2 * kLabel },
      { at: this.hasTip ? this.tip : base.clone().add(ahead), radius: kAxes },
      ...body.map((k) => ({ at: new THREE.Vector3().fromArray(this.backbone, 3 * k), radius })),
    ];
  }
  /** Where its letter is. */
  get letterAt(): THREE.Vector3 {
    return this.letter.position;
  }
  private get entryRadius(): number {
    return Math.max(...this.arm.tubes.map((tube) => 2 * tube.outer_radius), 0.002);
  }

  /** Entry point of the tubes, s = 0. */
  private entry(): THREE.Object3D {
    const radius = this.entryRadius;
    const ring = new THREE.Mesh(
      new THREE.TorusGeometry(1.2 * radius, 0.25 * radius, 8, 32),
      new THREE.MeshStandardMaterial({ color: this.arm.color, roughness: 0.6 }),
    );
    const [x = 0, y = 0, z = 0, w = 1] = this.arm.base.orientation;
    ring.position.fromArray(this.arm.base.position);
    ring.quaternion.set(x, y, z, w);
    return ring;
  }

  /** @param thickness factor on the drawn radius of the tubes @param closest  points with a small clearance */
  update(shape: Shape, joints: JointState | null, thickness: number, closest: readonly Closest[]): void {
    this.backbone = shape.points;
    const tubes = this.arm.tubes.length;
    const angles = joints ? joints.position.slice(tubes, 2 * tubes) : [];
    this.tube.update({ ...shape, radius: shape.outer_radius }, angles, thickness, closest);
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
    return this.tube.setOpacity(stale ? 0.3 : 1);
  }
}
