// SPDX-License-Identifier: Apache-2.0
/** Dead-man switch of the page.
 *
 * Input counts as held if it is pressed while all conditions are met, until it is released or a condition is violated. After a cut-off
 * it must be released and pressed again: nothing resumes automatically. */

/** Conditions under which input counts, with the messages for their violation. */
export const kConditions = {
  link: "the connection to the server is lost",
  live: "the robot's data is out of date",
  lease: "this page does not have the control lease",
  armed: "teleoperation is switched off",
  visible: "the tab is hidden",
  focused: "the window has lost the focus",
  device: "the device was disconnected",
  enabled: "control does not permit it now",
} as const;
export type Condition = keyof typeof kConditions;

export class InputGate {
  private readonly bad = new Set<Condition>(Object.keys(kConditions) as Condition[]);
  private readonly down = new Set<string>();
  private holder: string | null = null;
  /** Reason of the last cut-off; empty after a regular release. */
  cut = "";

  /** @param changed called at once when holding begins or ends. */
  constructor(private readonly changed: (held: boolean) => void) {}

  get held(): boolean {
    return this.holder !== null;
  }
  get source(): string | null {
    return this.holder;
  }
  /** Reason why nothing can be held now; empty if it can. */
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

  /** The state of a source: a key, a button, the pointer. Only a press begins to hold, and only the first one counts. */
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

  /** Releases the holder while another source of the same device group is down: holding continues without a gap. */
  hand(from: string, to: string): void {
    this.down.delete(from);
    if (this.holder === from && this.down.has(to)) this.holder = to;
    else this.update(from, false);
  }

  /** Cuts off the held input. */
  release(why: string): void {
    if (this.holder === null) return;
    this.holder = null;
    this.cut = why;
    this.changed(false);
  }
}
