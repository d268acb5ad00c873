// SPDX-License-Identifier: Apache-2.0
/** Objects shared by all panels, what the operator can do, and the effects of orders. */
import type { Commander } from "../state/commander";
import type { Effect, Orders } from "../state/orders";
import { type Deed, whyNotNow } from "../state/permission";
import type { Robot } from "../state/robot";
import { whyNoOrientation } from "../state/turning";
import { mayCommand } from "../state/robot";
import { onPhone } from "../state/screen";
import type { World } from "../state/world";
import type { Pilot } from "../teleop/pilot";
import type { Link } from "../wire/link";
import { Phase } from "../wire/messages";
import type { Currency } from "./currency";
import type { LogPanel } from "./log";
import type { Notices } from "./notices";

export interface Context {
  /** Of what is shown: the robot, or the recorded one. */
  robot: Robot;
  world: World;
  /** Of the robot, whatever is shown. */
  current: Currency;
  /** The recording that is shown instead of the robot; empty: none. */
  replayed: string;
  link: Link;
  commander: Commander;
  pilot: Pilot;
  messages: LogPanel;
  notices: Notices;
  orders: Orders;
}

/** Updated periodically; each panel writes only changes. */
export interface Panel {
  readonly element: HTMLElement;
  update(now: number): void;
}

/** Reason why the operator cannot do this now; empty if it can be done. @param arm  -1: with all arms */
export function whyNot(c: Context, deed: Deed, now: number, arm = -1): string {
  const owner = c.world.controlStatus()?.lease_owner ?? 0n;
  return whyNotNow(deed, {
    operator: mayCommand(c.robot),
    phone: onPhone(),
    hidden: document.visibilityState === "hidden",
    connected: c.link.state === "open",
    replay: c.replayed !== "",
    live: c.world.live(now),
    planningSilent: c.world.planningSilent(now),
    lease: c.commander.holds ? "mine" : owner === 0n ? "free" : "another's",
    phase: c.world.plan()?.phase ?? Phase.idle,
    noOrientation: whyNoOrientation(c.robot.teleoperation),
    refused: (action) => c.world.whyNot(action, arm),
  });
}

const kChange = 10_000; // ms within which drives and processes show a change

/** All arms have this operating state. */
export const reachesState = ({ world }: Context, state: string): Effect => ({
  there: (answer) => world.after(answer.value) && world.states().every((one) => one === state),
  prevented: (answer) =>
    world.after(answer.value) && state !== "DISABLED" && world.states().some((one) => one === "FAULT")
      ? "an arm is in FAULT"
      : "",
  within: kChange,
});

/** The trajectory is in one of these phases. @param started  it is the one that the reply names */
export const reachesPhase = ({ world }: Context, phases: readonly number[], started = false): Effect => ({
  there: (answer) => {
    const plan = world.plan();
    return plan !== null && phases.includes(plan.phase) && (!started || plan.trajectory_id >= answer.value);
  },
  within: kChange,
});

/** Control's status says so. */
export const reportedByControl = ({ world }: Context, there: () => boolean): Effect => ({
  there: (answer) => world.after(answer.value) && there(),
  within: kChange,
});

const kHome = 1e-3; // m or rad
const kSettle = 3000; // ms after the end of the motion in which the measured joints arrive

/** All arms have stopped at home. */
export function reachesHome({ world, robot }: Context): Effect {
  let ended = 0;
  const away = (): number =>
    Math.max(
      ...robot.arms.flatMap(({ home }, k) =>
        home.map((q, j) => Math.abs((world.joints(k)?.position[j] ?? Infinity) - q)),
      ),
    );
  return {
    there: (answer) => world.after(answer.value) && !world.busy() && away() < kHome,
    prevented: (answer) => {
      if (!world.after(answer.value)) return "";
      const other = world.states().find((one) => one !== "ENABLED");
      if (other) return `an arm is ${other}`;
      if (world.busy()) return "";
      ended ||= performance.now();
      return performance.now() - ended > kSettle ? "the motion has ended elsewhere" : "";
    },
    within: 0,
  };
}
