// SPDX-License-Identifier: Apache-2.0
/** Protections that drives lack: what they do not do by themselves when the HAL or their own motion fails. */
import type { HalStatus } from "../wire/messages";
import { maxJointsPerArm } from "../wire/messages";
import { shortName, valuesOf } from "./descriptions";
import type { Arm } from "./robot";

/** Drives that lack the same protections. */
export interface Lacking {
  /** "all drives", or joints with their arms. */
  who: string;
  /** Names and meanings. */
  what: string[];
}

export function lackingProtections(hal: HalStatus, arms: readonly Arm[]): Lacking[] {
  const joints = new Map<number, string[]>();
  arms.forEach((arm, a) =>
    arm.joints.forEach(({ name }, j) => {
      const lost = hal.axis_lost[a * maxJointsPerArm + j] ?? 0;
      joints.set(lost, [...(joints.get(lost) ?? []), `${name} of arm ${shortName(arm.name)}`]);
    }),
  );
  return [...joints]
    .filter(([lost]) => lost !== 0)
    .map(([lost, names]) => ({
      who: joints.size === 1 ? "all drives" : names.join(", "),
      what: valuesOf("Protection")
        .filter(({ value }) => (lost & (1 << value)) !== 0)
        .map(({ name, meaning }) => `${name}: ${meaning}`),
    }));
}
