// SPDX-License-Identifier: Apache-2.0
/** Whether the operator holds on: the page's dead-man switch.
 *
 * Something counts as held from the moment it is pressed while everything allows it, until it is let go or something no
 * longer allows it. What was cut off has to be let go and pressed again: nothing takes up by itself.
 */

/** What has to be so for input to count, and what to say when it is not. */
export const kConditions = {
  link: "the connection to the server is lost",
  live: "the robot's data is out of date",
  lease: "this page does not have the control lease",
  enabled: "the driven arm is not ENABLED",
  armed: "teleoperation is switched off",
  visible: "the tab is hidden",
  focused: "the window has lost the focus",
  device: "the device was disconnected",
} as const;
export type Condition = keyof typeof kConditions;

export class InputGate {
  private readonly bad = new Set<Condition>(Object.keys(kConditions) as Condition[]);
  private readonly down = new Set<string>();
  private holder: string | null = null;
  /** Why it was last cut off; empty after a regular release. */
  cut = "";

  /** @param changed reported at once whenever holding begins or ends. */
  constructor(private readonly changed: (held: boolean) => void) {}

  get held(): boolean {
    return this.holder !== null;
  }
  get source(): string | null {
    return this.holder;
  }
  /** Why nothing could be held now; empty where it could. */
  get obstacle(): string {
    for (const condition of Object.keys(kConditions) as Condition[])
      if (this.bad.has(condition)) return kConditions[condition];
    return "";
  }

  allow(condition: Condition, good: boolean): void {
    if (good) {
      this.bad.delete(condition);
      return;
    }
    this.bad.add(condition);
    this.release(kConditions[condition]);
  }

  /** The state of a source: a key, a button, the pointer. Only its going down begins to hold, and the first one counts. */
  update(source: string, isDown: boolean): void {
    const pressed = isDown && !this.down.has(source);
    if (isDown) this.down.add(source);
    else this.down.delete(source);
    if (pressed && this.bad.size === 0 && this.holder === null) {
      this.cut = "";
      this.holder = source;
      this.changed(true);
    } else if (!isDown && this.holder === source) {
      this.holder = null;
      this.changed(false);
    }
  }

  /** The holder is let go while another source of the same hand is down: holding goes on without a gap. */
  hand(from: string, to: string): void {
    this.down.delete(from);
    if (this.holder === from && this.down.has(to)) this.holder = to;
    else this.update(from, false);
  }

  /** Cuts off whatever is held. */
  release(why: string): void {
    if (this.holder === null) return;
    this.holder = null;
    this.cut = why;
    this.changed(false);
  }
}
