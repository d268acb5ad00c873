// SPDX-License-Identifier: Apache-2.0
/** Turning by the pointer: the operator turns a ball around the driven tip, of which a ring is drawn (arcball, Shoemake 1992). Axes of the
 * view: x right, y up, z toward the viewer. */
import type { Quaternion, Vector } from "./motion";

/** Radius in pixels around the tip in which the pointer grabs it. */
export const kGrab = 24;
/** Radius of the ball in pixels. */
export const kBall = 60;
const kRim = 14; // px beyond it that still belong to the ring

export type Part = "pointer" | "ring";

/** What the pointer grabs at this distance from the tip, px: the tip itself, the ball around it, or nothing. */
export function partAt(distance: number): Part | null {
  if (distance < kGrab) return "pointer";
  return distance < kBall + kRim ? "ring" : null;
}

/** Point of the unit ball under the pointer, px from its centre; outside of its rim the nearest point of the rim. */
export function ballPoint(right: number, up: number): Vector {
  const [x, y] = [right / kBall, up / kBall];
  const length = Math.hypot(x, y);
  return length < 1 ? [x, y, Math.sqrt(1 - length * length)] : [x / length, y / length, 0];
}

/** Shortest rotation of the ball that takes one of its points to another: along the rim about the view's z axis. */
export function turnBetween(from: Vector, to: Vector): Quaternion {
  const cosine = from[0] * to[0] + from[1] * to[1] + from[2] * to[2];
  const axis: Vector = [
    from[1] * to[2] - from[2] * to[1],
    from[2] * to[0] - from[0] * to[2],
    from[0] * to[1] - from[1] * to[0],
  ];
  const length = Math.hypot(...axis, 1 + cosine);
  if (length < 1e-9) return [0, 0, 1, 0]; // opposite points, which are both on the rim
  return [axis[0] / length, axis[1] / length, axis[2] / length, (1 + cosine) / length];
}
