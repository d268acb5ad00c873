// SPDX-License-Identifier: Apache-2.0
/** Event log, newest first, announced by screen readers. */
import { h } from "./dom";

export type Level = "done" | "info" | "bad";
const kMost = 100;
const kGlyph: Record<Level, string> = { done: "✓", info: "·", bad: "!" };

export class Messages {
  readonly element = h("ol.messages", { role: "log", "aria-live": "polite", "aria-label": "Messages", tabindex: "0" });
  private last = "";

  add(level: Level, text: string): void {
    const time = new Date().toLocaleTimeString("en-GB");
    if (text === this.last && this.element.firstElementChild) {
      const count = this.element.firstElementChild.querySelector(".times")!;
      count.textContent = ` ×${Number(count.textContent?.slice(2) || "1") + 1}`;
      return;
    }
    this.last = text;
    this.element.prepend(
      h(
        "li",
        { class: level },
        h("time", {}, time),
        h("span.glyph", { "aria-hidden": "true" }, kGlyph[level]),
        h("span", {}, text),
        h("span.times"),
      ),
    );
    while (this.element.childElementCount > kMost) this.element.lastElementChild!.remove();
  }
}
