// SPDX-License-Identifier: Apache-2.0
/** The log: the newest events and open alarms, always visible; all of it with search, filter and export in a panel. */
import type { Entry, Level } from "../state/log";
import { clockTime, Log, toCsv } from "../state/log";
import type { Announcer } from "./announcer";
import { action, h, setAttribute, setText, setUsable } from "./dom";
import { Sound } from "./sound";

const kGlyph: Record<Level, string> = { done: "✓", info: "·", bad: "!", alarm: "✕" };
const kNewest = 100; // entries in the list that is always visible
const kShown = 1000; // and at most in the panel
const kAgain = 500; // ms between two images of the panel: it has up to kShown rows, and a flood changes each
const kRepeat = 5000; // ms between the tones of alarms that are not acknowledged

export class LogPanel {
  readonly log = new Log();
  /** Open alarms and the newest events. */
  readonly newest: HTMLElement;
  /** Everything. */
  readonly element: HTMLElement;
  private readonly sound = new Sound();
  private readonly messages = h("ol.messages", { "aria-label": "Newest events" });
  private readonly alarms = h("ol.alarms", { id: "alarms", "aria-label": "Open alarms" });
  private readonly acknowledge: HTMLButtonElement;
  private readonly mute: HTMLButtonElement;
  private readonly search = h("input", {
    type: "search",
    id: "log-search",
    placeholder: "words…",
    autocomplete: "off",
    "aria-label": "Search in the log",
  });
  private readonly levels = new Set<Level>(["done", "info", "bad", "alarm"]);
  private readonly found = h("ol.found", { id: "log", "aria-label": "Log" });
  private readonly summary = h("output.fine", { id: "log-summary" });
  private shown = "";
  private drawnAt = -Infinity;
  /** Not in the list of the newest yet, the oldest first; no more than it shows. */
  private fresh: Entry[] = [];
  private seen: Entry[] = [];
  private sounded = 0;

  constructor(readonly announcer: Announcer) {
    this.acknowledge = action("Acknowledge", "Acknowledge the alarms that are shown", () => {
      this.log.acknowledge(this.seen);
    });
    this.acknowledge.id = "acknowledge";
    this.mute = action("Sound", "Tones of alarms and refusals", () => (this.sound.on = !this.sound.on));
    this.mute.id = "sound";
    this.newest = h(
      "div.newest",
      {},
      h("div.line", {}, h("strong", {}, "Alarms"), this.mute, this.acknowledge),
      this.alarms,
      this.messages,
    );
    this.messages.tabIndex = this.alarms.tabIndex = 0;
    const filters = (["alarm", "bad", "done", "info"] as const).map((level) => {
      const box = h("input", { type: "checkbox", checked: true, "data-level": level });
      box.addEventListener("change", () => (box.checked ? this.levels.add(level) : this.levels.delete(level)));
      return h(
        "label",
        {},
        box,
        h("span", {}, { alarm: "alarms", bad: "refusals", done: "done", info: "other" }[level]),
      );
    });
    const save = action("Export", "Save what is found as CSV", () => this.save());
    save.id = "log-export";
    this.element = h(
      "section.card.logged",
      { "aria-label": "Log" },
      h("div.row", {}, this.search, save),
      h("div.choice", { role: "group", "aria-label": "Filter" }, ...filters),
      this.summary,
      this.found,
    );
    this.log.added = (entry) => this.show(entry);
    // The browser's find bar would receive Esc.
    window.addEventListener("keydown", (event) => {
      const find = (event.ctrlKey || event.metaKey) && ["KeyF", "KeyG"].includes(event.code);
      if (!find && event.code !== "F3") return;
      event.preventDefault();
      document.getElementById("tab-log")?.click();
      this.search.focus();
    });
  }

  add(level: Level, text: string, source?: string, time?: number): void {
    this.log.add(level, text, source, time);
  }

  private row({ time, level, source, text, acknowledged }: Entry): HTMLElement {
    return h(
      "li",
      { class: level },
      h("time", { datetime: new Date(time).toISOString() }, clockTime(time)),
      h("span.glyph", { "aria-hidden": "true" }, kGlyph[level]),
      source === "this page" ? null : h("b", {}, `${source}: `),
      h("span", {}, text),
      acknowledged === 0 ? null : h("small", {}, ` (acknowledged ${clockTime(acknowledged)})`),
    );
  }
  private show(entry: Entry): void {
    if (entry.past) return; // showPast() follows
    this.fresh.push(entry);
    if (this.fresh.length > kNewest) this.fresh.shift();
    this.announcer.entry(entry);
    this.sound.play(entry.level);
    if (entry.level === "alarm") this.sounded = performance.now();
  }

  /** The newest lines again, once those of the past are among them. */
  showPast(): void {
    const newest = this.log.entries.slice(-kNewest).reverse();
    this.fresh = [];
    this.messages.replaceChildren(...newest.map((entry) => this.row(entry)));
  }

  private get filtered(): Entry[] {
    return this.log.find({ levels: this.levels, search: this.search.value });
  }
  private save(): void {
    const file = new Blob([toCsv(this.filtered)], { type: "text/csv" });
    const link = h("a", { href: URL.createObjectURL(file), download: `tandem-log-${new Date().toISOString()}.csv` });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  }

  update(now: number): void {
    this.updateAlarms(now);
    if (this.fresh.length > 0) this.messages.prepend(...this.fresh.reverse().map((entry) => this.row(entry)));
    this.fresh = [];
    while (this.messages.childElementCount > kNewest) this.messages.lastElementChild!.remove();
    if (this.element.closest("[hidden]") || now - this.drawnAt < kAgain) return;
    const state = `${this.log.version} ${[...this.levels].join()} ${this.search.value}`;
    if (state === this.shown) return;
    this.shown = state;
    this.drawnAt = now;
    const found = this.filtered;
    this.found.replaceChildren(
      ...found
        .slice(-kShown)
        .reverse()
        .map((entry) => this.row(entry)),
    );
    const { length } = this.log.entries;
    const rest = found.length > kShown ? `, the last ${kShown} are shown` : "";
    const out = this.log.leftOut > 0 ? `; ${this.log.leftOut} older ones were left out` : "";
    setText(this.summary, `${found.length} of ${length} events${rest}${out}`);
  }

  private updateAlarms(now: number): void {
    const open = this.log.open;
    if (open.length !== this.seen.length || open.some((entry, k) => entry !== this.seen[k])) {
      this.seen = open;
      this.alarms.replaceChildren(...[...open].reverse().map((entry) => this.row(entry)));
    }
    setUsable(this.acknowledge, open.length > 0 ? "" : "There is no open alarm.");
    setText(this.mute, this.sound.audible ? "Sound on" : this.sound.on ? "Sound: click" : "Sound off");
    setAttribute(this.mute, "aria-pressed", this.sound.audible ? "true" : "false");
    if (open.length > 0 && now - this.sounded > kRepeat) {
      this.sounded = now;
      this.sound.play("alarm");
    }
  }
}
