// SPDX-License-Identifier: Apache-2.0
/** What numbers on the wire mean, in words, and what the operator can do about it. */
import type { ControlStatus, HalStatus } from "../wire/messages";
import { State } from "../wire/messages";

interface FaultWords {
  name: string;
  meaning: string;
  remedy: string;
}

const kClear = "Disable to clear it, then enable.";

/** By the bit of safety::Fault. */
export const kFaults: readonly FaultWords[] = [
  { name: "not_finite", meaning: "a command held a number that is not finite", remedy: kClear },
  {
    name: "stale_command",
    meaning: "a command answered a state that is too old",
    remedy: `Check the load of the machine and the network. ${kClear}`,
  },
  {
    name: "out_of_sequence",
    meaning: "commands repeated or came from another session",
    remedy: `Make sure that one tandem-control runs. ${kClear}`,
  },
  { name: "step_too_large", meaning: "a setpoint lay farther from the last one than allowed", remedy: kClear },
  {
    name: "unknown_arm",
    meaning: "a command was for another number of arms",
    remedy: "Start all processes with the same robot file.",
  },
  {
    name: "command_timeout",
    meaning: "the drives got no command within their budget",
    remedy: `Is tandem-control running? ${kClear}`,
  },
  {
    name: "state_timeout",
    meaning: "control got no fresh state",
    remedy: `Is tandem-sim or tandem-hal running? ${kClear}`,
  },
  {
    name: "reference_timeout",
    meaning: "planning fell silent while it was followed",
    remedy: `Is tandem-planning running? ${kClear}`,
  },
  {
    name: "sensor",
    meaning: "a joint is not measured",
    remedy: "Check the encoder and its cable; disable when the reading is good again.",
  },
  {
    name: "drive",
    meaning: "a drive failed or its joint does not follow",
    remedy: "Look for what blocks the joint, check the drive; then disable and enable.",
  },
  {
    name: "stop_requested",
    meaning: "somebody pressed stop",
    remedy: "When it is safe to go on: take control, disable, then enable.",
  },
  {
    name: "lease_lost",
    meaning: "whoever commanded fell silent while an arm moved",
    remedy: `Take control. ${kClear}`,
  },
  {
    name: "solver",
    meaning: "there is no answer for these joints",
    remedy: "Move the joints by hand (jog) or choose another method, after disable and enable.",
  },
];

const kStates = ["DISABLED", "ENABLED", "PAUSED", "FAULT"];
const kStateMeaning = [
  "no power; nothing moves",
  "power on; may move",
  "power on; holds still",
  "stopped, power removed; latched",
];

export const stateName = (state: number): string => kStates[state] ?? "UNKNOWN";
export const stateMeaning = (state: number): string => kStateMeaning[state] ?? "";
/** A shape for each state, so that colour is never the only sign. */
export const stateGlyph = (state: number): string => ["○", "●", "‖", "✕"][state] ?? "?";

export function faultsOf(mask: number): FaultWords[] {
  const found = kFaults.filter((_, bit) => (mask & (1 << bit)) !== 0);
  if (mask >>> kFaults.length !== 0)
    found.push({ name: "unknown", meaning: "a fault that this page does not know", remedy: "See `tandem status`." });
  return found;
}

/** By safety::FaultCause. */
const kCauses = [
  "",
  "off",
  "following error",
  "hal or sim started anew",
  "left ENABLED by themselves",
  "reported by the drives",
  "no model",
  "no solution",
  "no states",
  "commands are not taken",
  "no answer",
  "reports an error",
  "drive and encoder disagree",
  "overspeed",
  "outside its limits",
  "another master on the bus",
  "torque",
  "brake",
  "emergency stop",
];
const kNoJoint = 255;

const number = (value: number): string => Number(value.toPrecision(4)).toString();

/** The drives' first record since the arm was cleared, in the words of `tandem status`; empty without a fault. */
export function driveRecord(hal: HalStatus, arm: number, jointCount: number): string {
  const mask = hal.first_fault[arm] ?? 0;
  if (mask === 0) return "";
  let text = faultsOf(mask)
    .map((f) => f.name)
    .join(", ");
  const cause = kCauses[hal.fault_cause[arm] ?? 0];
  if (cause) text += ` (${cause})`;
  const joint = hal.fault_joint[arm] ?? kNoJoint;
  if (joint !== kNoJoint) text += ` of joint ${joint + 1}`;
  const amount = hal.fault_amount[arm] ?? 0;
  const allowed = hal.fault_allowed[arm] ?? 0;
  if (amount === 0 && allowed === 0) return text;
  const unit = joint === kNoJoint ? "s" : joint < Math.floor(jointCount / 2) ? "m" : "rad";
  text += `: ${number(amount)} ${unit}`;
  return allowed > 0 ? `${text}, allowed ${number(allowed)} ${unit}` : text;
}

/** "arm_a" is "A" in words and on drawings. */
export const shortName = (arm: string): string => (arm.startsWith("arm_") ? arm.slice(4) : arm).toUpperCase();

/** By control::LimitKind. */
export function limitName(kind: number, arm: string, tube: number, catheter = false): string {
  const turn = kind === 2 || kind === 5 || kind === 7;
  const joint = turn ? (tube === 1 ? "roll" : "bend") : "insertion";
  const whose = `${catheter ? joint : `tube ${tube}`} of arm ${shortName(arm)}`;
  switch (kind) {
    case 0:
      return `${whose} against tube ${tube - 1}`;
    case 1:
      return `velocity limit of ${whose}`;
    case 2:
      return `rotation velocity limit of ${whose}`;
    case 3:
      return `rear travel limit of ${whose}`;
    case 4:
      return `front travel limit of ${whose}`;
    case 5:
      return `rotation limit of ${whose}`;
    case 6:
      return `largest translation in a step of ${whose}`;
    case 7:
      return `largest rotation in a step of ${whose}`;
    default:
      return `a limit of ${whose} that this page does not know`;
  }
}

/** Empty where no limit holds the tasks back. */
export function limitsInTheWay(status: ControlStatus, arms: readonly string[], catheters = false): string {
  if (status.limited === 0) return "";
  const names: string[] = [];
  for (let i = 0; i < Math.min(status.limit_count, status.limit_kind.length); ++i) {
    const arm = arms[status.limit_arm[i] ?? 0] ?? `number ${status.limit_arm[i]}`;
    names.push(limitName(status.limit_kind[i] ?? 255, arm, status.limit_tube[i] ?? 0, catheters));
  }
  const how = status.limited === 1 ? "Limits forbid the tasks" : "Limits hold the tasks back";
  return `${how}: ${names.join(", ") || "none is named"}`;
}

/** By dds::HoldReason. */
export const holdReason = (hold: number): string =>
  [
    "",
    "no tip has been measured yet",
    "the last measurement of a tip is too old",
    "a tip is not seen by its tracker",
    "no rest of what the arms move is known near their joints",
  ][hold] ?? "for a reason that this page does not know";

/** By safety::EmergencyStop. */
export const emergencyStop = (state: number): string => ["not read", "released", "PRESSED"][state] ?? "unknown";
export const kPressed = 2;

const kMentionIdle = 5; // s

/** What becomes of an arm that has power and that nobody commands; empty for others, and in the first seconds. */
export function idleWords(status: ControlStatus, arm: number): string {
  const idle = status.idle[arm] ?? 0;
  const left = status.idle_left[arm] ?? -1;
  if (idle < kMentionIdle) return "";
  return left < 0
    ? `has power, and nobody has commanded it for ${idle.toFixed(0)} s: disable it`
    : `nobody commands it: it loses its power in ${left.toFixed(0)} s`;
}

/** By control::SolveStatus. */
export const solveStatus = (status: number): string =>
  ["solved", "infeasible: nearest velocity", "out of iterations: stands", "not finite: stands", "gave up: stands"][
    status
  ] ?? "unknown";

/** The guards of the gate that stop an arm come first, those that hold joints back last. */
export const kGuards = [
  "finite",
  "fresh",
  "sequence",
  "step",
  "known_arm",
  "position",
  "coupled_row",
  "velocity",
  "slew",
];

export type StateCommand = "enable" | "disable" | "pause" | "resume";

/** Whether an arm in this state takes the command: the table of docs/safety.md. */
export function accepts(state: number, command: StateCommand): boolean {
  switch (command) {
    case "disable":
      return true;
    case "enable":
      return state === State.disabled || state === State.enabled;
    case "pause":
      return state === State.enabled || state === State.paused;
    case "resume":
      return state === State.paused;
  }
}
