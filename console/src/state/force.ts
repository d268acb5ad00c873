// SPDX-License-Identifier: Apache-2.0
/** Contact forces as text and as lengths of arrows. */
import type { Shape } from "../wire/messages";

/** Force on the tip, N, robot base frame; null: not known. */
export const forceOf = (shape: Shape | null): number[] | null =>
  shape && shape.loaded !== 0 ? [...shape.wrench.slice(0, 3)] : null;

/** "0.213 mN", "1.2 N". @param newtons  not below zero */
export const newtons = (force: number): string =>
  force < 1 ? `${Number((1e3 * force).toPrecision(3))} mN` : `${Number(force.toPrecision(3))} N`;

/** Force of an arrow as long as the unit: 1, 2 or 5 times a power of ten, so that the largest force is between one and 2.5 units long.
 * The present one is kept while it is between half and three: arrows do not jump. @param present  0: none yet */
export function arrowUnit(largest: number, present: number): number {
  if (!(largest > 0)) return present;
  if (present > 0 && largest > 0.5 * present && largest < 3 * present) return present;
  const power = 10 ** Math.floor(Math.log10(largest));
  return [5, 2, 1].map((digit) => digit * power).find((unit) => unit <= largest * (1 + 1e-9)) ?? power;
}
