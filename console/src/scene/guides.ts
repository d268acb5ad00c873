// SPDX-License-Identifier: Apache-2.0
/** Targets, planned path, relative positions, and shortest distances between bodies. */
import * as THREE from "three";

import type { Clearances, Path, PlanningReference } from "../wire/messages";
import { TaskKind } from "../wire/messages";
import { kClamped, kGoal, kNear } from "./colors";

const kMostPath = 4096;
const kMostPairs = 16;

/** Line segments up to a fixed number, rewritten in place. */
class Segments {
  readonly object: THREE.LineSegments;
  private readonly points: Float32Array;
  private count = 0;

  constructor(most: number, material: THREE.LineBasicMaterial) {
    this.points = new Float32Array(6 * most);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(this.points, 3).setUsage(THREE.DynamicDrawUsage));
    this.object = new THREE.LineSegments(geometry, material);
    this.object.frustumCulled = false;
    this.show();
  }
  begin(): void {
    this.count = 0;
  }
  add(from: ArrayLike<number>, to: ArrayLike<number>): void {
    if (6 * this.count + 6 > this.points.length) return;
    for (let k = 0; k < 3; ++k) {
      this.points[6 * this.count + k] = from[k]!;
      this.points[6 * this.count + 3 + k] = to[k]!;
    }
    this.count += 1;
  }
  show(): void {
    const geometry = this.object.geometry;
    geometry.getAttribute("position").needsUpdate = true;
    geometry.setDrawRange(0, 2 * this.count);
    if (this.object.material instanceof THREE.LineDashedMaterial) this.object.computeLineDistances();
  }
}

export class Guides {
  readonly group = new THREE.Group();
  private readonly targets: THREE.Mesh[] = [];
  private readonly relativeNow = new Segments(kMostPairs, new THREE.LineBasicMaterial({ color: "#ffffff" }));
  private readonly relativeWanted = new Segments(
    kMostPairs,
    new THREE.LineDashedMaterial({ color: kGoal, dashSize: 0.003, gapSize: 0.002 }),
  );
  private readonly near = new Segments(kMostPairs, new THREE.LineBasicMaterial({ color: kNear }));
  private readonly path: THREE.Line;
  private readonly pathPoints = new Float32Array(3 * kMostPath);
  private readonly ghost = new THREE.Mesh(
    new THREE.OctahedronGeometry(0.003),
    new THREE.MeshBasicMaterial({ color: kClamped, wireframe: true }),
  );

  constructor(arms: number) {
    for (let k = 0; k < arms; ++k) {
      const target = new THREE.Mesh(
        new THREE.SphereGeometry(0.0025, 16, 12),
        new THREE.MeshBasicMaterial({ color: kGoal, wireframe: true }),
      );
      target.visible = false;
      this.targets.push(target);
      this.group.add(target);
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(this.pathPoints, 3));
    geometry.setDrawRange(0, 0);
    this.path = new THREE.Line(
      geometry,
      new THREE.LineDashedMaterial({ color: kGoal, dashSize: 0.002, gapSize: 0.0015 }),
    );
    this.path.frustumCulled = false;
    this.ghost.visible = false;
    this.group.add(this.ghost, this.path, this.relativeNow.object, this.relativeWanted.object, this.near.object);
  }

  setPath(path: Pick<Path, "poses">): void {
    const count = Math.min(path.poses.length, kMostPath);
    path.poses.slice(0, count).forEach(({ pose: { position: p } }, i) => this.pathPoints.set([p.x, p.y, p.z], 3 * i));
    this.path.geometry.getAttribute("position").needsUpdate = true;
    this.path.geometry.setDrawRange(0, count);
    this.path.computeLineDistances();
  }

  /** The path of the last run. */
  showPath(shown: boolean): void {
    this.path.visible = shown;
  }

  /** Targets of the present tasks: for an arm without one, it follows from the relative position. */
  setReference(reference: PlanningReference, tips: readonly (THREE.Vector3 | null)[]): void {
    const wanted: (number[] | null)[] = this.targets.map(() => null);
    const tasks = reference.tasks.slice(0, reference.task_count);
    for (const task of tasks) {
      if (task.kind === TaskKind.tipPosition || task.kind === TaskKind.tipPose)
        wanted[task.arm] = Array.from(task.position);
      // Target of the common object: one position for all arms.
      if (task.kind === TaskKind.objectPose) wanted[0] = Array.from(task.position);
    }
    this.relativeNow.begin();
    this.relativeWanted.begin();
    for (const task of tasks) {
      if (task.kind !== TaskKind.relativePosition) continue;
      const to = tips[task.arm];
      const from = tips[task.other_arm];
      if (!to || !from) continue;
      const goal = wanted[task.arm] ?? to.toArray();
      wanted[task.other_arm] ??= goal.map((value, k) => value - task.position[k]!);
      this.relativeNow.add(from.toArray(), to.toArray());
      this.relativeWanted.add(wanted[task.other_arm]!, goal);
    }
    this.show(wanted);
  }

  /** Targets of teleoperation. @param ghost target without limits; null if it equals the target. */
  setHand(
    goals: number[][],
    tips: readonly (THREE.Vector3 | null)[],
    arm: number,
    other: number,
    ghost: THREE.Vector3 | null,
  ): void {
    this.relativeNow.begin();
    this.relativeWanted.begin();
    const [to, from] = [tips[arm], tips[other]];
    if (arm !== other && to && from) {
      this.relativeNow.add(from.toArray(), to.toArray());
      this.relativeWanted.add(goals[other]!, goals[arm]!);
    }
    this.show(goals);
    this.ghost.visible = ghost !== null;
    if (ghost) this.ghost.position.copy(ghost);
  }
  hideGhost(): void {
    this.ghost.visible = false;
  }

  private show(goals: readonly (readonly number[] | null)[]): void {
    this.relativeNow.show();
    this.relativeWanted.show();
    this.targets.forEach((target, k) => {
      const goal = goals[k];
      target.visible = goal != null;
      if (goal) target.position.set(goal[0]!, goal[1]!, goal[2]);
    });
  }

  setClearances(clearances: Clearances | null): void {
    this.near.begin();
    for (const body of clearances?.bodies ?? []) this.near.add(body.place, body.other_place);
    this.near.show();
  }
}
