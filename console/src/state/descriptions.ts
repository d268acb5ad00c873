// SPDX-License-Identifier: Apache-2.0
/** Names and descriptions of values in messages, and remedies of faults. */
import type { ControlPermissions, ControlStatus, HalStatus } from "../wire/messages";
import { Action, actionsPerArm, FaultCause, Limited, LimitKind, noJoint, RefusalReason } from "../wire/messages";

/** One value of an enumeration: name, meaning, and for faults the remedy. */
export interface Described {
  value: number;
  name: string;
  meaning: string;
  remedy?: string;
}
export type Descriptions = Record<string, Described[]>;

let descriptions: Descriptions = {};

/** Sets the texts from the server (GET /api/robot), the only source of names and meanings. */
export function useDescriptions(served: Descriptions): void {
  descriptions = served;
}

/** All values of an enumeration, in order. */
export const valuesOf = (enumeration: string): readonly Described[] => descriptions[enumeration] ?? [];
const valueOf = (enumeration: string, value: number): Described | undefined =>
  valuesOf(enumeration).find((one) => one.value === value);
/** The name of a value; `unknown` for an undefined one. */
export const nameOf = (enumeration: string, value: number, unknown = "unknown"): string =>
  valueOf(enumeration, value)?.name ?? unknown;

export const stateName = (state: number): string => nameOf("OperatingState", state, "UNKNOWN");
export const stateMeaning = (state: number): string => valueOf("OperatingState", state)?.meaning ?? "";
/** A shape for each state, so that colour is not the only distinction. */
export const stateGlyph = (state: number): string => ["○", "●", "‖", "✕"][state] ?? "?";

export function faultsOf(mask: number): Described[] {
  const known = valuesOf("Fault");
  const found = known.filter((fault) => (mask & fault.value) !== 0);
  const rest = known.reduce((left, fault) => left & ~fault.value, mask);
  if (rest !== 0)
    found.push({
      value: rest,
      name: "unknown",
      meaning: "unknown fault",
      remedy: "See `tandem status`.",
    });
  return found;
}

const number = (value: number): string => Number(value.toPrecision(4)).toString();

/** The first drive fault since the arm was cleared, as in `tandem status`; empty without a fault. */
export function driveRecord(hal: HalStatus, arm: number, jointCount: number): string {
  const mask = hal.first_fault[arm] ?? 0;
  if (mask === 0) return "";
  let text = faultsOf(mask)
    .map((f) => f.name)
    .join(", ");
  const cause = nameOf("FaultCause", hal.fault_cause[arm] ?? FaultCause.unspecified, "");
  if (cause) text += ` (${cause})`;
  const joint = hal.fault_joint[arm] ?? noJoint;
  if (joint !== noJoint) text += ` of joint ${joint + 1}`;
  const amount = hal.fault_amount[arm] ?? 0;
  const allowed = hal.fault_allowed[arm] ?? 0;
  if (amount === 0 && allowed === 0) return text;
  const ofJoint = joint < Math.floor(jointCount / 2) ? "m" : "rad";
  const share = hal.fault_cause[arm] === FaultCause.lost;
  const unit = share ? "of the last 100" : joint === noJoint ? "s" : ofJoint;
  text += `: ${number(amount)} ${unit}`;
  return allowed > 0 ? `${text}, allowed ${number(allowed)} ${unit}` : text;
}

/** "arm_a" is "A" in texts and drawings. */
export const shortName = (arm: string): string => (arm.startsWith("arm_") ? arm.slice(4) : arm).toUpperCase();

/** Properties of an arm that names of limits contain. */
export interface LimitedArm {
  name: string;
  joints: readonly { translation: boolean; part: string }[];
}

/** Name of a limit, as in `tandem solve`. @param kind  LimitKind */
export function limitName(kind: number, arm: LimitedArm, tube: number): string {
  const turns: number[] = [LimitKind.rotationVelocity, LimitKind.rotation, LimitKind.rotationStep];
  const joints = arm.joints.filter((joint) => joint.translation !== turns.includes(kind));
  const whose = `${joints[tube - 1]?.part ?? `tube ${tube}`} of arm ${shortName(arm.name)}`;
  if (kind === LimitKind.neighbour) return `${whose} against tube ${tube - 1}`;
  const name = nameOf("LimitKind", kind, "");
  return name ? `${name} of ${whose}` : `unknown limit of ${whose}`;
}

/** Empty if no limit restricts the tasks. */
export function limitsInTheWay(status: ControlStatus, arms: readonly LimitedArm[]): string {
  if (status.limited === Limited.not) return "";
  const names: string[] = [];
  for (let i = 0; i < Math.min(status.limit_count, status.limit_kind.length); ++i) {
    const arm = arms[status.limit_arm[i] ?? 0] ?? { name: `number ${status.limit_arm[i]}`, joints: [] };
    names.push(limitName(status.limit_kind[i] ?? 255, arm, status.limit_tube[i] ?? 0));
  }
  const how = status.limited === Limited.forbidden ? "Limits forbid the tasks" : "Limits hold the tasks back";
  return `${how}: ${names.join(", ") || "unknown"}`;
}

export const holdReason = (hold: number): string => nameOf("HoldReason", hold, "unknown reason");

const kMentionIdle = 5; // s

/** Remaining time of an arm with power and without a commander; empty for other arms, and in the first seconds. */
export function idleText(status: ControlStatus, arm: number): string {
  const idle = status.idle[arm] ?? 0;
  const left = status.idle_left[arm] ?? -1;
  if (idle < kMentionIdle) return "";
  return left < 0
    ? `has had power without a commander for ${idle.toFixed(0)} s: disable it`
    : `not commanded: power off in ${left.toFixed(0)} s`;
}

export type StateCommand = "enable" | "disable" | "pause" | "resume";

/** What is missing where control refuses an action by the state of an arm: its own reason names the manual. */
const kNeeded: Partial<Record<number, string>> = {
  [Action.enable]: "it is resumed, not enabled",
  [Action.pause]: "only an ENABLED arm can be paused",
  [Action.resume]: "only a PAUSED arm can be resumed",
};

/** Reason why control would refuse this action of the lease owner now; empty if it would not, or if no permissions were received.
 * @param states  of the arms, as far as they are known @param arm  -1: any of them */
export function whyNot(
  permissions: ControlPermissions | null,
  action: number,
  arms: readonly string[],
  arm = -1,
  states: readonly string[] = [],
): string {
  for (let k = 0; k < Math.min(permissions?.arm_count ?? 0, arms.length); ++k) {
    const reason = permissions?.reason[k * actionsPerArm + action] ?? RefusalReason.none;
    if ((arm !== -1 && arm !== k) || reason === RefusalReason.none) continue;
    const needed = reason === RefusalReason.wrongState && states[k] ? kNeeded[action] : undefined;
    return needed
      ? `Arm ${shortName(arms[k]!)} is ${states[k]}: ${needed}.`
      : `Arm ${shortName(arms[k]!)}: ${nameOf("RefusalReason", reason, "unknown reason")}.`;
  }
  return "";
}
