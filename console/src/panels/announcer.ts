// SPDX-License-Identifier: Apache-2.0
/** What screen readers say. The page has two live regions, in index.html: a polite one for events and an assertive one for alarms.
 * Values that change by themselves are in neither. */
import type { Entry } from "../state/log";
import { setText } from "./dom";

const kTogether = 100; // ms: what comes within this time is said together
const kGap = 1000; // ms between two texts of a region
const kMost = 12; // events said together; of more, their number
const kClear = 10_000; // ms after which a reader that browses the page does not find the text again

/** The texts of a live region, which follow each other slowly enough to be read. */
export class Region {
  private waiting: string[] = [];
  private shown = "";
  private changed = -Infinity;
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly show: (text: string) => void) {}

  say(text: string): void {
    this.waiting.push(text);
    if (this.waiting.length > 1) return;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.next(), Math.max(kTogether, this.changed + kGap - performance.now()));
  }
  private next(): void {
    const more = this.waiting.length - kMost;
    const text = this.waiting.slice(0, kMost).join(". ") + (more > 0 ? `. And ${more} more, see the log` : "");
    this.waiting = [];
    this.changed = performance.now();
    this.shown = this.shown === text ? `${text}.` : text; // a text that is shown already would not be said again
    this.show(this.shown);
    this.timer = setTimeout(() => this.show((this.shown = "")), kClear);
  }
}

const region = (id: string): Region => new Region((text) => setText(document.getElementById(id)!, text));

export class Announcer {
  private readonly events = region("said-events");
  private readonly alarms = region("said-alarms");

  event(text: string): void {
    this.events.say(text.replaceAll("→", "to"));
  }
  /** Alarms, and whether a stop is confirmed. */
  alarm(text: string): void {
    this.alarms.say(text);
  }
  /** A new line of the log. */
  entry({ level, source, text, announced }: Entry): void {
    if (!announced) return;
    const who = source === "this page" ? text : `${source}: ${text}`;
    if (level === "alarm") this.alarm(who);
    else this.event(who);
  }
}
