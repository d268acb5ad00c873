// SPDX-License-Identifier: Apache-2.0
/** Device velocities from keys and sticks, in the axes of the view: x right, y up, z toward the viewer. Rotations follow the right-hand rule. */

export type Vector = readonly [number, number, number];
/** x y z w, unit. */
export type Quaternion = readonly [number, number, number, number];

/** m/s of the device at full deflection, before the scale. */
export const kFullSpeed = 0.02;
/** rad/s likewise, as of the teleoperation client. */
export const kFullTurn = 0.5;

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

/** Keys that turn about these axes: those of the teleoperation client (services/teleop/keyboard.cpp), whose z axis points away. */
export const kTurnKeys: Readonly<Record<string, Vector>> = {
  KeyI: [1, 0, 0],
  KeyK: [-1, 0, 0],
  KeyL: [0, 1, 0],
  KeyJ: [0, -1, 0],
  KeyU: [0, 0, 1],
  KeyO: [0, 0, -1],
};

/** Diagonals are no faster than single axes. */
function sum(keys: Readonly<Record<string, Vector>>, codes: Iterable<string>, full: number): Vector {
  const all = [0, 0, 0];
  for (const code of codes) keys[code]?.forEach((value, k) => (all[k]! += value));
  const length = Math.hypot(...all);
  const factor = length > 0 ? full / length : 0;
  return [factor * all[0]!, factor * all[1]!, factor * all[2]!];
}
/** m/s */
export const keyVelocity = (codes: Iterable<string>): Vector => sum(kKeys, codes, kFullSpeed);
/** rad/s */
export const keyTurn = (codes: Iterable<string>): Vector => sum(kTurnKeys, codes, kFullTurn);

export const Button = { leaveStop: 8, clutch: 4, turn: 5, hold: 7 };

export interface Sticks {
  axes: readonly number[];
  buttons: readonly { pressed: boolean; value: number }[];
}

const axis = (sticks: Sticks, index: number): number => {
  const value = sticks.axes[index] ?? 0;
  return Number.isFinite(value) ? Math.max(-1, Math.min(1, value)) : 0;
};

/** Standard mapping: left stick across the view, vertical axis of the right stick along it. Control applies the dead band. */
const deflection = (sticks: Sticks): Vector => [axis(sticks, 0), -axis(sticks, 1), axis(sticks, 3)];
const times = (factor: number, [x, y, z]: Vector): Vector => [factor * x, factor * y, factor * z];

/** Of the sticks, as of the teleoperation client: while the button `turn` is held they turn about their axes, and move nothing. */
export const stickVelocity = (sticks: Sticks): Vector =>
  times(pressed(sticks, Button.turn) ? 0 : kFullSpeed, deflection(sticks));
export const stickTurn = (sticks: Sticks): Vector =>
  times(pressed(sticks, Button.turn) ? kFullTurn : 0, deflection(sticks));
export const pressed = (sticks: Sticks, button: number): boolean => sticks.buttons[button]?.pressed ?? false;
export const buttonBits = (sticks: Sticks): number =>
  sticks.buttons.reduce((bits, button, k) => (k < 32 && button.pressed ? (bits | (1 << k)) >>> 0 : bits), 0);
