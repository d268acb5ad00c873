// SPDX-License-Identifier: Apache-2.0
/** Clearance as colour on the tubes, near the closest points of bodies. */
import type { Clearances } from "../wire/messages";

/** Clearance from which on a body is coloured, m; at 0 it has the full colour. */
export const kCloseBelow = 5e-3;
/** Distance from the closest point at which the colour ends, m. */
const kFades = 12e-3;

export interface Closest {
  place: ArrayLike<number>;
  /** m; below zero the bodies overlap */
  distance: number;
}

/** Closest points of one arm to the other bodies. */
export const closestOf = (arm: number, clearances: Clearances | null): Closest[] =>
  (clearances?.bodies ?? []).flatMap((body) => [
    ...(body.arm === arm ? [{ place: body.place, distance: body.distance }] : []),
    ...(body.other_arm === arm ? [{ place: body.other_place, distance: body.distance }] : []),
  ]);

/** Share of the colour at one point of a backbone, 0 to 1. @param at  index of the point */
export function closeness(points: ArrayLike<number>, at: number, closest: readonly Closest[]): number {
  let share = 0;
  for (const { place, distance } of closest) {
    const far = Math.hypot(...[0, 1, 2].map((k) => points[3 * at + k]! - place[k]!));
    const near = Math.min(1, 1 - distance / kCloseBelow);
    share = Math.max(share, near * Math.min(1, Math.max(0, 1.5 - (1.5 * far) / kFades)));
  }
  return share;
}
