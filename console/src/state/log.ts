// SPDX-License-Identifier: Apache-2.0
/** What has happened, also before the page was opened: each event with its time, none counted together with another. */

/** done: an order has its effect; bad: something was refused or lost; alarm: somebody has to know it, and acknowledges it. */
export type Level = "done" | "info" | "bad" | "alarm";

export interface Entry {
  /** ms since 1970 */
  readonly time: number;
  readonly level: Level;
  /** Who or what: "this page", "tandem-control", "page 1f3a". */
  readonly source: string;
  readonly text: string;
  /** It is announced to screen readers; what repeats another entry is not. */
  readonly announced: boolean;
  /** It happened before it could be shown: before the page was opened, or while its link was down. */
  readonly past: boolean;
  /** ms since 1970; 0: not yet. Of alarms. */
  acknowledged: number;
}

/** What is shown of the log. */
export interface Filter {
  levels: ReadonlySet<Level>;
  /** All of these words are in source or text, in any case. */
  search: string;
}

const kMost = 5000;

export class Log {
  private all: Entry[] = [];
  /** Entries left out because there were too many; no alarm is among them. */
  leftOut = 0;
  /** What is added now is of the past, and takes its place by its time. */
  past = false;
  /** ms since 1970: up to here this page has acknowledged alarms before it was loaded again. */
  acknowledgedBefore = 0;
  /** Called with the time of the last acknowledged alarm. */
  acknowledging: (time: number) => void = () => {};
  /** Counts changes. */
  version = 0;
  /** Called with each new entry. */
  added: (entry: Entry) => void = () => {};
  /** Called with what everybody has to see at once: an alarm, a stop of the robot. */
  urgent: (what: string) => void = () => {};

  constructor(private readonly most = kMost) {}

  /** @param time  ms since 1970 */
  add(level: Level, text: string, source = "this page", time = Date.now(), announced = true): void {
    const { past } = this;
    const known = past && level === "alarm" && time <= this.acknowledgedBefore;
    const entry: Entry = { time, level, source, text, announced, past, acknowledged: known ? time : 0 };
    const later = past ? this.all.findIndex((one) => one.time > time) : -1;
    this.all.splice(later < 0 ? this.all.length : later, 0, entry);
    if (this.all.length > this.most) {
      const oldest = this.all.findIndex((one) => one.level !== "alarm");
      if (oldest >= 0) {
        this.all.splice(oldest, 1);
        this.leftOut += 1;
      }
    }
    this.version += 1;
    this.added(entry);
    if (level === "alarm" && !past) this.urgent(`${source}: ${text}`);
  }

  /** In the order in which they came. */
  get entries(): readonly Entry[] {
    return this.all;
  }
  /** Alarms that nobody has acknowledged, the oldest first. */
  get open(): Entry[] {
    return this.all.filter(({ level, acknowledged }) => level === "alarm" && acknowledged === 0);
  }
  /** Acknowledges these alarms: those that the operator has seen. */
  acknowledge(seen: readonly Entry[], time = Date.now()): void {
    for (const entry of seen) entry.acknowledged ||= time;
    this.acknowledging(Math.max(0, ...seen.map((entry) => entry.time)));
    this.version += 1;
  }

  find({ levels, search }: Filter): Entry[] {
    const words = search
      .toLowerCase()
      .split(/\s+/)
      .filter((word) => word !== "");
    return this.all.filter(({ level, source, text }) => {
      const where = `${source} ${text}`.toLowerCase();
      return levels.has(level) && words.every((word) => where.includes(word));
    });
  }
}

const quoted = (text: string): string => `"${text.replaceAll('"', '""')}"`;

/** CSV by RFC 4180; times in UTC. */
export function toCsv(entries: readonly Entry[]): string {
  const utc = (time: number): string => (time === 0 ? "" : new Date(time).toISOString());
  const rows = entries.map(({ time, level, source, text, acknowledged }) =>
    [utc(time), level, quoted(source), quoted(text), utc(acknowledged)].join(","),
  );
  return ["time,level,source,text,acknowledged", ...rows, ""].join("\r\n");
}

const kTolerance = 100; // ms by which a time may differ when the clocks are compared again

/** Keeps in the browser's tab which alarms are acknowledged, for the same page loaded again. */
export function keepAcknowledged(log: Log, fingerprint: string): void {
  const key = `acknowledged ${fingerprint}`;
  log.acknowledgedBefore = Number(sessionStorage.getItem(key) ?? 0);
  log.acknowledging = (time) => sessionStorage.setItem(key, String(time + kTolerance));
}
