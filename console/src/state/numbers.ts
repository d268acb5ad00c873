// SPDX-License-Identifier: Apache-2.0
/** Lengths and angles as text; a dash for numbers that are not finite. */
export const millimetres = (metres: number, digits = 2): string =>
  Number.isFinite(metres) ? (1000 * metres).toFixed(digits) : "–";
export const degrees = (radians: number, digits = 1): string =>
  Number.isFinite(radians) ? ((180 / Math.PI) * radians).toFixed(digits) : "–";
