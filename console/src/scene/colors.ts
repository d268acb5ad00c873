// SPDX-License-Identifier: Apache-2.0
/** Colours of arms and tubes: hues of Okabe and Ito, which people with every kind of colour vision tell apart; within an
 * arm the tubes differ by lightness, and arms bear their letters as well. */

const kArms: readonly (readonly string[])[] = [
  ["#bfe3f7", "#56b4e9", "#0072b2", "#004a75"],
  ["#fbdca1", "#e69f00", "#d55e00", "#8a3d00"],
  ["#9fe0cb", "#1fb88d", "#009e73", "#00684c"],
  ["#f2cfe2", "#cc79a7", "#a8427c", "#702b52"],
];

export const tubeColor = (arm: number, tube: number): string => {
  const tubes = kArms[arm % kArms.length]!;
  return tubes[Math.min(Math.max(tube, 1), tubes.length) - 1]!;
};
export const armColor = (arm: number): string => tubeColor(arm, 2);
/** Of one of so many tubes of an arm, counted from 0; a single one has the arm's. */
export const bodyColor = (arm: number, tube: number, count: number): string =>
  count > 1 ? tubeColor(arm, tube + 1) : armColor(arm);
/** Of goals and plans: light, and drawn with lines of their own kind. */
export const kGoal = "#f0e442";
export const kNear = "#cc79a7";
/** Of what was asked for and is not done. */
export const kClamped = "#d55e00";
/** Of what the arms hold. */
export const kObject = "#7fbf3f";
