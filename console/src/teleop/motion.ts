// SPDX-License-Identifier: Apache-2.0
/** Device velocities from keys and sticks, in the axes of the view: x right, y up, z toward the viewer. */

export type Vector = readonly [number, number, number];

/** m/s of the device at full deflection, before the scale. */
export const kFullSpeed = 0.02;

/** By KeyboardEvent.code, which depends on the position of the key and not on the keyboard's language. */
export const kKeys: Readonly<Record<string, Vector>> = {
  ArrowLeft: [-1, 0, 0],
  ArrowRight: [1, 0, 0],
  ArrowUp: [0, 1, 0],
  ArrowDown: [0, -1, 0],
  PageUp: [0, 0, -1],
  PageDown: [0, 0, 1],
  KeyA: [-1, 0, 0],
  KeyD: [1, 0, 0],
  KeyW: [0, 1, 0],
  KeyS: [0, -1, 0],
  KeyE: [0, 0, -1],
  KeyQ: [0, 0, 1],
};

/** Diagonals are no faster than single axes. */
export function keyVelocity(codes: Iterable<string>): Vector {
  const sum = [0, 0, 0];
  for (const code of codes) kKeys[code]?.forEach((value, k) => (sum[k]! += value));
  const length = Math.hypot(...sum);
  const factor = length > 0 ? kFullSpeed / length : 0;
  return [factor * sum[0]!, factor * sum[1]!, factor * sum[2]!];
}

export const Button = { leaveStop: 8, clutch: 4, hold: 5, holdTrigger: 7 };

export interface Sticks {
  axes: readonly number[];
  buttons: readonly { pressed: boolean; value: number }[];
}

const axis = (sticks: Sticks, index: number): number => {
  const value = sticks.axes[index] ?? 0;
  return Number.isFinite(value) ? Math.max(-1, Math.min(1, value)) : 0;
};

/** Standard mapping: left stick across the view, vertical axis of the right stick along it. Control applies the dead band. */
export const stickVelocity = (sticks: Sticks): Vector => [
  kFullSpeed * axis(sticks, 0),
  -kFullSpeed * axis(sticks, 1),
  kFullSpeed * axis(sticks, 3),
];
export const pressed = (sticks: Sticks, button: number): boolean => sticks.buttons[button]?.pressed ?? false;
export const buttonBits = (sticks: Sticks): number =>
  sticks.buttons.reduce((bits, button, k) => (k < 32 && button.pressed ? (bits | (1 << k)) >>> 0 : bits), 0);
