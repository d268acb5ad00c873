// SPDX-License-Identifier: Apache-2.0
/** A checked trajectory in the scene: its path, reached and missed points, and the arms at one of its points as ghosts. */
import * as THREE from "three";

import { reached } from "../state/checktext";
import type { Arm } from "../state/robot";
import type { PointReport } from "../wire/messages";
import { kGoal, kMissed, kReached } from "./colors";
import type { Backbone } from "./sweep";
import { TubeMesh } from "./tubemesh";

const kCross = 1.5e-3; // m

const minus = (a: ArrayLike<number>, b: ArrayLike<number>): number[] => [0, 1, 2].map((k) => a[k]! - b[k]!);
/** Whether the trajectory has a relative position: without one, it is zero. */
const relative = (points: readonly PointReport[]): boolean =>
  points.some(({ wanted_relative: r }) => Math.hypot(r[0]!, r[1]!, r[2]!) > 0);

/** Paths that the tips shall follow: of the tip, and of the other one if there is a relative position. */
export const pathsOf = (points: readonly PointReport[]): number[][][] => [
  points.map(({ wanted }) => [...wanted]),
  ...(relative(points) ? [points.map(({ wanted, wanted_relative: r }) => minus(wanted, r))] : []),
];

/** Ends of line segments: a cross at each point that is missed, and a line from there to the nearest position of the tip. */
export function missesOf(points: readonly PointReport[]): number[][] {
  return points
    .filter((point) => !reached(point))
    .flatMap(({ wanted, tip }) => [
      ...[0, 1, 2].flatMap((axis) =>
        [-kCross, kCross].map((step) => [0, 1, 2].map((k) => wanted[k]! + (k === axis ? step : 0))),
      ),
      [...wanted],
      [...tip],
    ]);
}

export class PreviewView {
  readonly group = new THREE.Group();
  private readonly marks = new THREE.Group();
  private geometries: THREE.BufferGeometry[] = [];
  private readonly ghosts: TubeMesh[];

  constructor(arms: readonly Arm[]) {
    this.ghosts = arms.map((arm) => new TubeMesh(arm));
    for (const ghost of this.ghosts) {
      ghost.setOpacity(0.35);
      ghost.object.visible = false;
    }
    this.group.add(this.marks, ...this.ghosts.map(({ object }) => object));
  }

  /** Shows the points of a check; none: shows nothing. */
  show(points: readonly PointReport[]): void {
    for (const geometry of this.geometries) geometry.dispose();
    this.geometries = [];
    this.marks.clear();
    if (points.length === 0) return;
    for (const path of pathsOf(points)) {
      const line = new THREE.Line(
        this.geometryOf(path),
        new THREE.LineDashedMaterial({ color: kGoal, dashSize: 0.002, gapSize: 0.0015 }),
      );
      line.computeLineDistances();
      this.marks.add(line);
    }
    const dots = new THREE.PointsMaterial({ color: kReached, size: 4, sizeAttenuation: false });
    this.marks.add(new THREE.Points(this.geometryOf(points.filter(reached).map(({ wanted }) => [...wanted])), dots));
    this.marks.add(
      new THREE.LineSegments(this.geometryOf(missesOf(points)), new THREE.LineBasicMaterial({ color: kMissed })),
    );
    for (const mark of this.marks.children) mark.frustumCulled = false;
  }

  private geometryOf(points: readonly number[][]): THREE.BufferGeometry {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(points.flat(), 3));
    this.geometries.push(geometry);
    return geometry;
  }

  /** The arms at a point, transparent; null: none. @param angles  of the tubes' stripes of each arm, rad */
  ghost(shapes: readonly (Backbone | null)[] | null, angles: readonly ArrayLike<number>[], thickness: number): void {
    this.ghosts.forEach((ghost, k) => {
      const shape = shapes?.[k];
      ghost.object.visible = shape != null;
      if (shape) ghost.update(shape, angles[k] ?? [], thickness, []);
    });
  }
}
