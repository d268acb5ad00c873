// SPDX-License-Identifier: Apache-2.0
/** Orders of the operator, from the request to the effect: an order is done when the robot shows its effect, not when it was sent. */
import type { Answer } from "./commander";

/** The effect of an order. */
export interface Effect {
  /** Whether it is there. Asked after each message of the robot that follows the reply. */
  there(answer: Answer): boolean;
  /** What prevents it for ever; empty if nothing does. */
  prevented?(answer: Answer): string;
  /** ms after which it is missing; 0: no limit */
  within: number;
}

export type Report = (level: "info" | "done" | "bad", text: string) => void;

interface Open {
  what: string;
  effect: Effect;
  answer: Answer;
  /** performance.now() of the request */
  since: number;
}

export class Orders {
  private open: Open[] = [];

  constructor(private readonly report: Report) {}

  /** Reports refusal, or acceptance and effect, of a request. @returns whether it was accepted */
  async give(what: string, asked: Promise<Answer>, effect?: Effect): Promise<boolean> {
    const since = performance.now();
    const answer = await asked;
    if (!answer.accepted) this.report("bad", `${what} refused: ${answer.reason}`);
    else if (!effect) this.report("done", `${what}: done`);
    else this.open.push({ what, effect, answer, since });
    return answer.accepted;
  }

  /** After each message that may show an effect. */
  look(now: number): void {
    this.open = this.open.filter(({ what, effect, answer, since }) => {
      const took = now - since;
      if (effect.there(answer)) this.report("done", `${what}: done after ${(took / 1000).toFixed(1)} s`);
      else {
        const why =
          (effect.prevented?.(answer) ?? "") ||
          (effect.within > 0 && took > effect.within ? `no effect within ${effect.within / 1000} s` : "");
        if (why === "") return true;
        this.report("bad", `${what}: NOT done: ${why}`);
      }
      return false;
    });
  }
  /** What is accepted, and not done yet. */
  get pending(): string[] {
    return this.open.map(({ what }) => what);
  }
  /** No effect can be seen any more. */
  abandon(why: string): void {
    for (const { what } of this.open) this.report("bad", `${what}: accepted, effect not known: ${why}`);
    this.open = [];
  }
}

/** Whether a stop that is not confirmed is sent again. After a loss of the connection it is only until the control lease has expired: by
 * then the robot has stopped by itself, and what moves later was started by somebody who may not know of this stop.
 * @param elapsed  since the press, ms @param connected  without a break since then @param lease  budget of the control lease, s */
export const stopIsRepeated = (elapsed: number, connected: boolean, lease: number): boolean =>
  connected || elapsed <= 1000 * lease;
