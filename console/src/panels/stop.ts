// SPDX-License-Identifier: Apache-2.0
/** Soft stop: a button and Esc, for every client, at any time. It shows whether the robot has confirmed the stop. */
import { OperatingState } from "../wire/messages";
import type { Context } from "./context";
import { h, setAttribute, setText } from "./dom";

const kStopRequested = 1 << 10; // safety::Fault
const kConfirm = 1000; // ms
const kAgain = 100; // ms between repetitions until it is confirmed

export class StopKey {
  readonly element: HTMLElement;
  private readonly button: HTMLButtonElement;
  private readonly note = h(
    "output.note",
    { "aria-live": "assertive", id: "stop-note" },
    "soft stop – not an emergency stop",
  );
  private since = -1;
  private again = 0;
  /** Time from the last press to its confirmation, ms. */
  took = -1;

  constructor(
    private readonly c: Context,
    private readonly release: () => void,
  ) {
    this.button = h(
      "button.stop",
      {
        type: "button",
        id: "stop",
        accesskey: "s",
        "aria-describedby": "stop-note",
        onpointerdown: () => this.press("stop button"), // on press, not on release
        onclick: (event: MouseEvent) => event.detail === 0 && this.press("stop button"), // Enter and Space
      },
      "STOP",
      h("kbd", {}, "Esc"),
    );
    this.element = h("div.stopping", {}, this.button, this.note);
    // Captured at the window, before any dialogue, field or panel.
    window.addEventListener("keydown", (event) => event.key === "Escape" && !event.repeat && this.press("Esc"), {
      capture: true,
    });
    c.world.taps.status.push(() => this.confirm());
  }

  press(by: string): void {
    this.release();
    this.since = performance.now();
    this.again = this.since;
    this.took = -1;
    const sent = this.c.commander.stop(`operator's page: ${by}`);
    setAttribute(this.button, "data-state", sent ? "sent" : "failed");
    setText(
      this.note,
      sent ? "stop sent, waiting for the robot…" : "NOT SENT: no connection. Use the hardware emergency stop.",
    );
    this.c.messages.add("bad", sent ? `Stop (${by})` : `Stop (${by}) could not be sent: there is no connection`);
    if (!sent) this.since = -1;
  }

  private stopped(): boolean {
    const status = this.c.world.controlStatus();
    if (!status) return false;
    for (let k = 0; k < status.arm_count; ++k) {
      if (status.operating_state[k] !== OperatingState.fault || ((status.faults[k] ?? 0) & kStopRequested) === 0)
        return false;
    }
    return status.arm_count > 0;
  }

  private confirm(): void {
    if (this.since < 0 || !this.stopped()) return;
    this.took = performance.now() - this.since;
    this.since = -1;
    setAttribute(this.button, "data-state", "confirmed");
    setText(this.note, `stopped: confirmed after ${Math.round(this.took)} ms`);
  }

  update(now: number): void {
    if (this.since >= 0) {
      if (now - this.again > kAgain) {
        this.again = now;
        this.c.commander.stop("operator's page: repeated, not confirmed yet");
      }
      if (now - this.since > kConfirm) {
        setAttribute(this.button, "data-state", "failed");
        setText(this.note, "NOT CONFIRMED. Use the hardware emergency stop.");
      }
      return;
    }
    const state = this.button.getAttribute("data-state");
    if (state === "confirmed" && !this.stopped()) {
      setAttribute(this.button, "data-state", "");
      setText(this.note, "soft stop – not an emergency stop");
    }
    if (state === "failed" && this.c.world.live(now)) {
      setAttribute(this.button, "data-state", "");
      setText(this.note, "soft stop – not an emergency stop");
    }
  }
}
