// SPDX-License-Identifier: Apache-2.0
/** Positions after power on that somebody has to confirm, because they are not plausible, or to measure. */
import type { HalStatus, JointState } from "../wire/messages";
import { AxisPhase, LastPosition, maxJointsPerArm } from "../wire/messages";
import { shortName, valuesOf } from "./descriptions";
import { degrees, millimetres } from "./numbers";
import type { Arm } from "./robot";

/** One joint with such a position. */
export interface Unconfirmed {
  /** Somebody has to measure it; there is nothing to confirm. */
  unmeasured: boolean;
  arm: number;
  /** "beta_1 of arm A" */
  joint: string;
  /** "beta_1 of arm A: 3.10 mm measured; expected 1.00 mm ± 0.50 mm, as it was last". */
  text: string;
}

const meaningOf = (value: number): string =>
  valuesOf("LastPosition").find((one) => one.value === value)?.meaning ?? "unknown reason";

/** @param measured  of each arm; null: not received yet */
export function unconfirmedPositions(
  hal: HalStatus,
  arms: readonly Arm[],
  measured: readonly (JointState | null)[],
): Unconfirmed[] {
  return arms.flatMap((arm, a) =>
    arm.joints.flatMap(({ name, translation }, j): Unconfirmed[] => {
      const i = a * maxJointsPerArm + j;
      const phase = hal.axis_phase[i];
      const joint = `${name} of arm ${shortName(arm.name)}`;
      if (phase === AxisPhase.unmeasured) {
        const how = `measure the joint, then tandem home --arm ${arm.name} --measured ${name}=${translation ? "MM" : "DEGREES"}`;
        return [{ arm: a, unmeasured: true, joint, text: `${joint}: ${how}` }];
      }
      if (phase !== AxisPhase.unconfirmed) return [];
      const unit = (value: number): string => (translation ? `${millimetres(value)} mm` : `${degrees(value, 2)}°`);
      const last = hal.axis_last[i] ?? LastPosition.missing;
      const expected =
        last === LastPosition.known
          ? `expected ${unit(hal.axis_last_position[i] ?? NaN)} ± ${unit(hal.axis_jump_tolerance[i] ?? NaN)}, as it was last`
          : `nothing to compare it with: ${meaningOf(last)}`;
      const text = `${joint}: ${unit(measured[a]?.position[j] ?? NaN)} measured; ${expected}`;
      return [{ arm: a, unmeasured: false, joint, text }];
    }),
  );
}
