// SPDX-License-Identifier: Apache-2.0
/** Colours of arms and tubes: hues of Okabe and Ito, distinguishable with every kind of colour vision; the tubes of an arm differ by
 * lightness, and arms also have letters. */

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
/** Colour of one of `count` tubes of an arm, counted from 0; a single tube has the arm's colour. */
export const bodyColor = (arm: number, tube: number, count: number): string =>
  count > 1 ? tubeColor(arm, tube + 1) : armColor(arm);
/** Goals and plans: light, with line styles of their own. */
export const kGoal = "#f0e442";
export const kNear = "#cc79a7";
/** Requested motion that limits prevent. */
export const kClamped = "#d55e00";
/** Common object of the arms. */
export const kObject = "#7fbf3f";
