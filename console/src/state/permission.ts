// SPDX-License-Identifier: Apache-2.0
/** Decides what the operator can do now: the one place from which all parts of the page have it, with the reason. */
import { Action, Phase } from "../wire/messages";

/** What a deed requires. */
interface Rule {
  /** The control lease. */
  lease?: boolean;
  /** An action that control permits. */
  action?: number;
  /** Planning has to answer. */
  planning?: true;
  /** Phases of the trajectory, and the reason in other phases. */
  phases?: readonly [readonly number[], string];
  /** It is safe from a page that nobody sees. */
  unseen?: boolean;
  /** Control has to follow orientations. */
  orientation?: true;
}

const kRules = {
  take: { action: Action.acquireLease },
  release: { lease: true, action: Action.releaseLease, unseen: true },
  enable: { lease: true, action: Action.enable },
  pause: { action: Action.pause, unseen: true },
  resume: { lease: true, action: Action.resume },
  disable: { action: Action.disable, unseen: true },
  home: { lease: true, action: Action.home },
  homeDrives: { action: Action.homeDrives },
  jog: { lease: true, action: Action.jog },
  method: { lease: true, action: Action.setMethod },
  teleoperate: { lease: true, action: Action.teleoperate },
  turn: { lease: true, action: Action.teleoperate, orientation: true },
  start: { lease: true, planning: true, action: Action.start },
  pauseTrajectory: {
    lease: true,
    planning: true,
    action: Action.steer,
    phases: [[Phase.running], "No trajectory runs."],
    unseen: true,
  },
  resumeTrajectory: {
    lease: true,
    planning: true,
    action: Action.steer,
    phases: [[Phase.paused], "No trajectory is paused."],
  },
  endTrajectory: {
    lease: true,
    planning: true,
    phases: [[Phase.running, Phase.paused], "No trajectory runs."],
    unseen: true,
  },
} as const satisfies Record<string, Rule>;
export type Deed = keyof typeof kRules;
export const kDeeds = Object.keys(kRules) as Deed[];

/** State of page and robot, as far as the decision depends on it. */
export interface Situation {
  /** The role of the page: false for a viewer. */
  operator: boolean;
  /** The page is on a phone, with too little space to see what one commands. */
  phone: boolean;
  /** The tab is in the background, or the window minimized. */
  hidden: boolean;
  connected: boolean;
  /** A recording is shown instead of the robot. */
  replay: boolean;
  /** Data of control and drives is current. */
  live: boolean;
  /** How old the last reference of planning is, if planning no longer publishes; empty if it does. */
  planningSilent: string;
  lease: "mine" | "free" | "another's";
  /** Of the trajectory. */
  phase: number;
  /** Why operators cannot turn tips, whatever the state; empty if they can. */
  noOrientation: string;
  /** Why control would refuse an action of the lease owner; empty if it would not. */
  refused(action: number): string;
}

/** Reason why the operator cannot do this now; empty if it can be done. */
export function whyNotNow(deed: Deed, s: Situation): string {
  const rule: Rule = kRules[deed];
  if (!s.operator) return "Viewer: this page can read and stop, but not command.";
  if (s.replay) return "A recording is shown, not the robot: return to live first.";
  if (s.phone) return "On a phone, this page can watch and stop, but not command.";
  if (rule.orientation && s.noOrientation !== "") return s.noOrientation;
  if (s.hidden && !rule.unseen) return "This page is hidden.";
  if (!s.connected) return "There is no connection to the server.";
  if (!s.live) return "The robot's data is out of date.";
  if (deed === "take" && s.lease === "another's") return "Another client has the control lease.";
  if (rule.lease && s.lease !== "mine") return "Take control first.";
  if (rule.planning && s.planningSilent !== "")
    return `Planning does not answer: its last data is ${s.planningSilent}. Pause the arms, or STOP.`;
  if (rule.phases && !rule.phases[0].includes(s.phase)) return rule.phases[1];
  return rule.action === undefined ? "" : s.refused(rule.action);
}

/** Reason why a recording cannot be shown now; empty if it can: who commands the robot watches it. */
export const whyNoReplay = ({ lease }: Pick<Situation, "lease">): string =>
  lease === "mine" ? "This page has control: release it first." : "";
