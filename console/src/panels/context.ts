// SPDX-License-Identifier: Apache-2.0
/** Objects shared by all panels, and the reasons for which a command is not allowed. */
import type { Commander, Answer } from "../state/commander";
import type { Robot } from "../state/robot";
import { mayCommand } from "../state/robot";
import type { World } from "../state/world";
import type { Pilot } from "../teleop/pilot";
import type { Link } from "../wire/link";
import type { Messages } from "./messages";

export interface Context {
  robot: Robot;
  world: World;
  link: Link;
  commander: Commander;
  pilot: Pilot;
  messages: Messages;
}

/** Updated periodically; each panel writes only changes. */
export interface Panel {
  readonly element: HTMLElement;
  update(now: number): void;
}

/** Reason why this page may not command; empty if it may. */
export function whyNotCommand(c: Context, now: number): string {
  if (!mayCommand(c.robot)) return "Viewer: this page can read and stop, but not command.";
  if (c.link.state !== "open") return "There is no connection to the server.";
  if (!c.world.live(now)) return "The robot's data is out of date.";
  return "";
}
/** Reason why this page may not send commands that need the lease; empty if it may. */
export function whyNotMove(c: Context, now: number): string {
  return whyNotCommand(c, now) || (c.commander.holds ? "" : "Take control first.");
}

/** Sends a request and reports its reply. @returns whether it was accepted. */
export async function order(c: Context, what: string, asked: Promise<Answer>): Promise<boolean> {
  const answer = await asked;
  if (answer.accepted) c.messages.add("done", `${what}: done`);
  else c.messages.add("bad", `${what} refused: ${answer.reason}`);
  return answer.accepted;
}
