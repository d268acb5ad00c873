// SPDX-License-Identifier: Apache-2.0
/** Soft stop: a button and Esc, for every client, at any time, above all else. It shows whether the robot has confirmed the stop. */
import { stopIsRepeated } from "../state/orders";
import { OperatingState } from "../wire/messages";
import type { Context } from "./context";
import { h, setAttribute, setText } from "./dom";

const kStopRequested = 1 << 10; // safety::Fault
const kConfirm = 400; // ms; looked at every kAgain, so that it is shown within half a second
const kAgain = 100; // ms between repetitions until it is confirmed
const kNotSent = "NOT SENT: no connection. Use the hardware emergency stop.";
const kNotConfirmed = "NOT CONFIRMED. Use the hardware emergency stop.";
const kIdle = "soft stop – not an emergency stop";

const isEscape = ({ key, code }: KeyboardEvent): boolean => key === "Escape" || code === "Escape";

export class StopKey {
  readonly element: HTMLElement;
  private readonly button: HTMLButtonElement;
  private readonly note = h("output.note", { id: "stop-note" }, kIdle);
  private readonly key = h("output.note", { id: "stop-key" });
  private since = -1;
  /** Esc is down, as far as this page has seen. */
  private down = false;
  private repeats: ReturnType<typeof setInterval> | undefined;
  /** Identity of the connection on which it was pressed. */
  private client = 0n;
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
        "aria-describedby": "stop-note stop-key",
        onpointerdown: () => this.press("stop button"), // on press, not on release
        onclick: (event: MouseEvent) => event.detail === 0 && this.press("stop button"), // Enter and Space
      },
      "STOP",
    );
    this.element = h("div.stopping", { id: "stopping" }, this.button, this.note, this.key);
    // Captured at the window, before any field or panel; by its place on the keyboard too, which an input method does not change.
    for (const [name, down] of [
      ["keydown", true],
      ["keyup", false],
    ] as const)
      window.addEventListener(name, (event) => isEscape(event) && this.escape(down), { capture: true });
    // While a menu of the browser is open, the browser receives Esc.
    window.addEventListener("contextmenu", (event) => event.preventDefault());
    for (const change of ["focus", "blur"]) window.addEventListener(change, () => this.showKey());
    document.addEventListener("visibilitychange", () => this.showKey());
    this.showKey();
    this.followZoom();
    c.world.taps.status.push(() => this.confirm());
    c.world.taps.hal.push(() => this.confirm());
  }

  /** Once per press. `repeat` of the event is no use: Chromium sets it for the first press after one that went to a dialog. */
  private escape(down: boolean): void {
    if (down && !this.down) this.press("Esc");
    this.down = down;
  }

  /** The browser's find bar, menus, address line and dialogs, and other windows, receive keys instead of the page. */
  private showKey(): void {
    const here = document.hasFocus();
    this.down &&= here;
    setText(
      this.key,
      here ? "Esc stops, but not in menus of the browser" : "Esc does NOT stop: the keyboard is not in this page",
    );
    setAttribute(this.key, "data-here", here ? "yes" : "no");
  }

  /** Keeps the button in the part of the page that a pinch shows, at its size on the screen. */
  private followZoom(): void {
    const seen = window.visualViewport;
    if (!seen) return;
    const follow = (): void => {
      const pinched = seen.scale > 1.01;
      this.element.classList.toggle("pinched", pinched);
      this.element.style.transform = pinched
        ? `translate(${seen.offsetLeft}px, ${seen.offsetTop}px) scale(${1 / seen.scale})`
        : "";
    };
    for (const change of ["resize", "scroll"]) seen.addEventListener(change, follow);
    follow();
  }

  press(by: string): void {
    this.release();
    this.since = performance.now();
    this.took = -1;
    clearInterval(this.repeats);
    this.client = this.c.commander.client;
    const sent = this.c.commander.stop(`operator's page at ${this.c.robot.client_address}: ${by}`);
    setAttribute(this.button, "data-state", sent ? "sent" : "failed");
    setText(this.note, sent ? "stop sent, waiting for the robot…" : kNotSent);
    this.c.messages.add(sent ? "bad" : "alarm", `Stop (${by})${sent ? "" : ` ${kNotSent}`}`);
    if (sent) this.repeats = setInterval(() => this.repeat(), kAgain);
    else this.since = -1;
  }

  /** Until it is confirmed. */
  private repeat(): void {
    const elapsed = performance.now() - this.since;
    if (elapsed >= kConfirm && this.button.dataset["state"] !== "failed") {
      setAttribute(this.button, "data-state", "failed");
      setText(this.note, kNotConfirmed);
      this.c.messages.add("alarm", `Stop ${kNotConfirmed}`);
    }
    if (stopIsRepeated(elapsed, this.client === this.c.commander.client, this.c.robot.budgets.lease)) {
      this.c.commander.stop("operator's page: repeated, not confirmed yet");
      return;
    }
    clearInterval(this.repeats);
    this.since = -1;
  }

  /** Both control and the drives have latched it: control alone cannot stop drives that do not answer. */
  private stopped(): boolean {
    return [this.c.world.controlStatus(), this.c.world.halStatus()].every((from) => {
      if (!from || from.arm_count === 0) return false;
      const latched = (state: number, k: number): boolean =>
        state === OperatingState.fault && ((from.faults[k] ?? 0) & kStopRequested) !== 0;
      return [...from.operating_state.slice(0, from.arm_count)].every(latched);
    });
  }

  private confirm(): void {
    if (this.since < 0 || !this.stopped()) return;
    this.took = performance.now() - this.since;
    this.since = -1;
    clearInterval(this.repeats);
    setAttribute(this.button, "data-state", "confirmed");
    const text = `stopped: confirmed after ${Math.round(this.took)} ms`;
    setText(this.note, text);
    this.c.messages.log.add("done", text, undefined, undefined, false);
    this.c.messages.announcer.alarm(text);
  }

  update(now: number): void {
    if (this.since >= 0) return;
    const state = this.button.getAttribute("data-state");
    if ((state === "confirmed" && !this.stopped()) || (state === "failed" && this.c.world.live(now))) {
      setAttribute(this.button, "data-state", "");
      setText(this.note, kIdle);
    }
  }
}
