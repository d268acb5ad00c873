// SPDX-License-Identifier: Apache-2.0
/** One of several values as radio buttons. The browser's own lists receive Esc instead of the page, and may cover the stop button. */
import { h, setAttribute, setText } from "./dom";

export interface Option {
  value: string;
  text: string;
  /** Why it cannot be chosen; empty or absent if it can. */
  why?: string;
}

export class Choice {
  readonly element: HTMLElement;
  private readonly radios = new Map<string, HTMLInputElement>();
  private readonly refusals = new Map<string, string>();

  /** @param changed  called when the operator chooses, not when the program does */
  constructor(
    private readonly id: string,
    label: string,
    options: readonly Option[],
    private readonly changed: () => void,
  ) {
    this.element = h("div.choice", { role: "radiogroup", "aria-label": label, id });
    this.offer(options);
  }

  /** Replaces the options; the first that can be chosen is chosen. */
  offer(options: readonly Option[]): void {
    this.radios.clear();
    const labels = options.map(({ value, text, why = "" }) => {
      const radio = h("input", { type: "radio", name: this.id, value, onchange: () => this.changed() });
      this.radios.set(value, radio);
      this.refusals.set(value, why);
      return h("label", { title: why }, radio, h("span", {}, text), why === "" ? null : h("small", {}, why));
    });
    this.element.replaceChildren(...labels);
    this.allow("");
    const first = options.find(({ why = "" }) => why === "");
    if (first) this.value = first.value;
  }
  get value(): string {
    return [...this.radios].find(([, radio]) => radio.checked)?.[0] ?? "";
  }
  set value(value: string) {
    for (const [name, radio] of this.radios) if (radio.checked !== (name === value)) radio.checked = name === value;
  }
  /** Refuses one option with a reason, or offers it again (`why` empty). */
  refuse(value: string, why: string): void {
    const radio = this.radios.get(value);
    if (!radio || this.refusals.get(value) === why) return;
    this.refusals.set(value, why);
    setAttribute(radio.closest("label")!, "title", why);
    radio.disabled = why !== "" || this.element.ariaDisabled === "true";
  }
  /** Disables all options with a reason, or enables those that can be chosen (`why` empty). */
  allow(why: string): void {
    setAttribute(this.element, "title", why);
    setAttribute(this.element, "aria-disabled", why === "" ? "false" : "true");
    for (const [value, radio] of this.radios) radio.disabled = why !== "" || this.refusals.get(value) !== "";
  }
}

/** A line that names what cannot be used, each with the reason. Its height is constant. */
export class Reasons {
  readonly element = h("p.reasons", { role: "group", "aria-label": "Why some commands cannot be used" });
  /** @param refused  what, and why not; an empty reason: it can be used */
  show(refused: readonly (readonly [string, string])[]): void {
    const byReason = new Map<string, string[]>();
    for (const [what, why] of refused) if (why !== "") byReason.set(why, [...(byReason.get(why) ?? []), what]);
    const text = [...byReason].map(([why, names]) => `${names.join(", ")}: ${why}`).join("\n");
    if (this.element.textContent === text) return;
    setText(this.element, text);
    setAttribute(this.element, "title", text);
    this.element.tabIndex = text === "" ? -1 : 0; // a text that does not fit is scrolled by keys, too
  }
}
