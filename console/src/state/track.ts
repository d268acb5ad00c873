// SPDX-License-Identifier: Apache-2.0
/** Positions of value, setpoint and moving bounds of a joint on a bar from 0 to 1. */

export interface Range {
  from: number;
  to: number;
}

/** Range of the bar of a rotation. Without limits: one turn, modulo which values are shown. */
export const rotationRange = (lower: number | null, upper: number | null): Range =>
  lower === null || upper === null ? { from: -Math.PI, to: Math.PI } : { from: lower, to: upper };

export const wrap = (angle: number): number => angle - 2 * Math.PI * Math.floor((angle + Math.PI) / (2 * Math.PI));

/** @returns 0 to 1; values outside the range are shown at its end. */
export const place = (value: number, { from, to }: Range): number =>
  to > from ? Math.min(1, Math.max(0, (value - from) / (to - from))) : 0;

/** The allowed part of the bar; bounds that are not finite extend to its end. */
export function allowed(lower: number, upper: number, range: Range): { left: number; right: number } {
  const left = Number.isFinite(lower) ? place(lower, range) : 0;
  const right = Number.isFinite(upper) ? place(upper, range) : 1;
  return { left: Math.min(left, right), right };
}
