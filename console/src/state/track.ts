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

/** Whole turns of an angle that a bar of one turn leaves out: what is drawn is wrap(angle). */
export const turns = (angle: number): number => Math.round((angle - wrap(angle)) / (2 * Math.PI));

/** A part of a bar, from 0 to 1. */
export interface Part {
  left: number;
  right: number;
}
const kNone: Part = { left: 0, right: 0 };

/** The allowed part of the bar; bounds that are not finite extend to its end. */
function allowedPart(lower: number, upper: number, range: Range): Part {
  const left = Number.isFinite(lower) ? place(lower, range) : 0;
  const right = Number.isFinite(upper) ? place(upper, range) : 1;
  return { left: Math.min(left, right), right };
}

/** The allowed parts of the bar: the second is empty, except where a range passes the end of a bar of one turn.
 * @param wraps  the bar shows angles modulo a turn */
export function allowed(lower: number, upper: number, range: Range, wraps: boolean): [Part, Part] {
  if (!wraps) return [allowedPart(lower, upper, range), kNone];
  // Bounds further than a turn away are outside the range of the bar.
  if (!(upper - lower < 2 * Math.PI)) return [{ left: 0, right: 1 }, kNone];
  const from = wrap(lower);
  const to = from + upper - lower;
  if (to <= range.to) return [allowedPart(from, to, range), kNone];
  return [allowedPart(from, Infinity, range), allowedPart(-Infinity, to - 2 * Math.PI, range)];
}
