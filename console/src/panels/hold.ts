// SPDX-License-Identifier: Apache-2.0
/** Buttons that act while they are held: one press of the main pointer button, or Enter or space. */
import { hung, kGap, Repeats } from "../teleop/repeats";
import { action, usable } from "./dom";

/** Longest period of the timer, ms, however seldom it asks. */
const kTick = 50;
/** Time for which a button that asks for confirmation is held, ms. */
const kConfirm = 1000;

export interface Held {
  /** ms between two calls of `ask` */
  period: number;
  ask(): void;
  end(): void;
  /** Tells the operator why it has ended, where that cannot be seen. */
  say(text: string): void;
}

/** While a button is held, `ask` is called at once and then periodically. Anything that may hide its release ends it: another button,
 * finger or key, a menu, a lost capture or focus, a hidden page, a gap of the timer, a key that no longer repeats. */
export class Hold {
  private timer: ReturnType<typeof setInterval> | undefined;
  private since = 0;
  private last = 0;
  private asked = 0;
  private readonly repeats = new Repeats(() => this.end());
  /** Removes the listeners of a hold. */
  private over = new AbortController();

  constructor(
    private readonly button: HTMLButtonElement,
    private readonly held: Held,
  ) {
    button.addEventListener("pointerdown", (event) => {
      if (event.button === 0 && event.isPrimary && !event.ctrlKey && usable(button)) this.begin(button, "");
    });
    button.addEventListener("keydown", (event) => {
      if ((event.key !== "Enter" && event.key !== " ") || event.repeat || !usable(button)) return;
      this.begin(button, event.code);
      this.repeats.seen(false);
    });
  }

  private get name(): string {
    return this.button.getAttribute("aria-label") ?? this.button.textContent ?? "";
  }
  get active(): boolean {
    return this.timer !== undefined;
  }
  /** ms */
  get heldFor(): number {
    return performance.now() - this.since;
  }
  end(): void {
    if (this.timer === undefined) return;
    clearInterval(this.timer);
    this.timer = undefined;
    this.repeats.end();
    this.over.abort();
    this.held.end();
  }

  /** @param key  that begins it; empty: a pointer */
  private begin(button: HTMLButtonElement, key: string): void {
    this.end();
    this.over = new AbortController();
    const options = { capture: true, signal: this.over.signal };
    const end = (): void => this.end();
    for (const name of ["pointerup", "pointercancel", "pointerleave", "lostpointercapture", "keyup", "blur"])
      button.addEventListener(name, end, options);
    // The event that begins the hold has passed the window already: another one comes from another finger or key.
    for (const name of ["pagehide", "contextmenu", "pointerdown"]) window.addEventListener(name, end, options);
    // A pointer moves the focus to the button: the blur of the element that had it passes the window, too.
    window.addEventListener("blur", ({ target }) => target === window && this.end(), options);
    window.addEventListener("mousedown", (event) => event.button !== 0 && this.end(), options);
    window.addEventListener(
      "keydown",
      ({ repeat, code }) => (repeat && code === key ? this.repeats.seen(true) : this.end()),
      options,
    );
    document.addEventListener("visibilitychange", end, options);
    this.since = this.last = this.asked = performance.now();
    const { period } = this.held;
    const tick = period / Math.ceil(period / kTick);
    this.timer = setInterval(() => this.repeat(period - tick / 2), tick);
    this.held.ask();
  }
  /** @param pause  ms after which it asks again */
  private repeat(pause: number): void {
    const now = performance.now();
    if (now - this.last > kGap) {
      this.end();
      return this.held.say(`${this.name}: ended, because ${hung(now - this.last)}. Let it go, and hold it again.`);
    }
    this.last = now;
    if (now - this.asked < pause) return;
    this.asked = now;
    this.held.ask();
  }
}

/** A button that acts once it has been held for a second; a bar in it shows for how long it is. @param say  of Held */
export function confirmed(
  label: string,
  help: string,
  act: () => void,
  say: (text: string) => void,
): HTMLButtonElement {
  const button = action(label, help, () => {}, "confirm");
  const hold = new Hold(button, {
    period: 40,
    ask: () => {
      const share = hold.heldFor / kConfirm;
      button.style.setProperty("--held", `${Math.min(100, 100 * share).toFixed(0)}%`);
      if (share < 1) return;
      hold.end();
      act();
    },
    end: () => button.style.setProperty("--held", "0%"),
    say,
  });
  return button;
}
