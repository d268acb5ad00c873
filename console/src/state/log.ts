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

/** An alarm that was acknowledged, as it is kept beyond a reload. */
export interface Acknowledged {
  source: string;
  text: string;
  /** Of the alarm, ms since 1970. */
  time: number;
  /** ms since 1970 */
  acknowledged: number;
}

const kMost = 5000;
const kTolerance = 500; // ms by which a time may differ when the clocks are compared again

export class Log {
  private all: Entry[] = [];
  /** Entries left out because there were too many; no alarm is among them. */
  leftOut = 0;
  private ofPast = false;
  /** Alarms that this page had acknowledged before it was loaded again, as far as they have not come yet. */
  known: Acknowledged[] = [];
  /** Called with alarms that were not acknowledged before. */
  acknowledging: (alarms: readonly Acknowledged[]) => void = () => {};
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
    const entry: Entry = { time, level, source, text, announced, past, acknowledged: 0 };
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

  /** What is added now is of the past, and takes its place by its time. */
  get past(): boolean {
    return this.ofPast;
  }
  set past(is: boolean) {
    if (this.ofPast && !is) this.recall();
    this.ofPast = is;
  }
  /** Finds the alarms that this page had acknowledged before it was loaded again: each known one is the nearest alarm with its text. */
  private recall(): void {
    const pairs = this.open
      .filter(({ past }) => past)
      .flatMap((entry) =>
        this.known
          .filter(({ text, source }) => text === entry.text && source === entry.source)
          .map((one) => ({ entry, one, off: Math.abs(entry.time - one.time) })),
      )
      .filter(({ off }) => off <= kTolerance)
      .sort((a, b) => a.off - b.off);
    const found = new Set<Acknowledged>();
    for (const { entry, one } of pairs) {
      if (entry.acknowledged !== 0 || found.has(one)) continue;
      entry.acknowledged = one.acknowledged;
      found.add(one);
    }
    this.known = this.known.filter((one) => !found.has(one));
    this.version += 1;
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
    const open = seen.filter(({ level, acknowledged }) => level === "alarm" && acknowledged === 0);
    for (const entry of open) entry.acknowledged = time;
    this.acknowledging(open.map(({ source, text, time: of }) => ({ source, text, time: of, acknowledged: time })));
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

/** "14:03:22.123", of another day "27 Nov 14:03:22.123". @param now  ms since 1970 */
export function clockTime(time: number, now = Date.now()): string {
  const at = new Date(time);
  const clock = `${at.toLocaleTimeString("en-GB")}.${String(at.getMilliseconds()).padStart(3, "0")}`;
  if (at.toDateString() === new Date(now).toDateString()) return clock;
  return `${at.toLocaleDateString("en-GB", { day: "numeric", month: "short" })} ${clock}`;
}

const kFormula = /^[=+\-@\t\r]/;
/** A cell; what a spreadsheet would compute is a text: it begins with an apostrophe. */
const quoted = (text: string): string => `"${kFormula.test(text) ? "'" : ""}${text.replaceAll('"', '""')}"`;

/** CSV by RFC 4180; times in UTC. Texts come from other clients, too: none becomes a formula of a spreadsheet. */
export function toCsv(entries: readonly Entry[]): string {
  const utc = (time: number): string => (time === 0 ? "" : new Date(time).toISOString());
  const rows = entries.map(({ time, level, source, text, acknowledged }) =>
    [utc(time), level, quoted(source), quoted(text), utc(acknowledged)].join(","),
  );
  return ["time,level,source,text,acknowledged", ...rows, ""].join("\r\n");
}

const kMostKept = 2000; // alarms: the server has no more events

/** Keeps in the browser's tab which alarms are acknowledged, for the same page loaded again. Others stay open, whatever their time is: nobody
 * has seen them. */
export function keepAcknowledged(
  log: Log,
  fingerprint: string,
  storage: Pick<Storage, "getItem" | "setItem"> = sessionStorage,
): void {
  const key = `acknowledged alarms ${fingerprint}`;
  const read = (): Acknowledged[] => JSON.parse(storage.getItem(key) ?? "[]") as Acknowledged[];
  log.known = read();
  log.acknowledging = (alarms) => storage.setItem(key, JSON.stringify([...read(), ...alarms].slice(-kMostKept)));
}
