// SPDX-License-Identifier: Apache-2.0
/** Age of data by the server's clock: what a slow link holds back is old although it has just come. */
import { fetchJson } from "./robot";

const kPeriod = 1000; // ms between two comparisons of the clocks
const kFirstPeriod = 200; // the same while there are few: the first ones may be slow, while the page is loaded
const kFew = 5;
const kValid = 10_000; // ms for which one counts

/** Bounds of this page's clock minus the server's. */
interface Comparison {
  least: number;
  most: number;
  at: number;
}

/** Compares this page's clock with the server's: the server's answer was written between request and reception. */
export class ServerClock {
  private comparisons: Comparison[] = [];
  private compared: () => void = () => {};
  /** Kept once the clocks have been compared. */
  readonly known = new Promise<void>((resolve) => (this.compared = resolve));

  /** Compares periodically, for ever. */
  start(): void {
    const compare = async (): Promise<void> => {
      const asked = performance.now();
      try {
        const { now_ms: server } = await fetchJson<{ now_ms: number }>("/api/clock");
        this.note(asked, performance.now(), server);
      } catch {
        // Without an answer the last comparisons count until they are too old.
      }
      setTimeout(() => void compare(), this.comparisons.length < kFew ? kFirstPeriod : kPeriod);
    };
    void compare();
  }
  /** @param asked, answered  of this page's clock @param server  of the server's, between them; ms */
  note(asked: number, answered: number, server: number): void {
    const found = { least: asked - server, most: answered - server, at: answered };
    // One that contradicts the last is from before a change of the server's clock.
    const kept = this.comparisons.filter(
      (c) => answered - c.at < kValid && c.least <= found.most && found.least <= c.most,
    );
    this.comparisons = [...kept, found];
    this.compared();
  }
  /** Time of this page, ms since 1970, at which the server's clock showed `time`; now, while the clocks are not compared. */
  when(time: number): number {
    const age = this.age(time, performance.now());
    return Date.now() - (Number.isFinite(age) ? age : 0);
  }
  /** Largest possible age, ms, of what the server received at `time` of its clock; infinite while the clocks are not compared. */
  age(time: number, now: number): number {
    const offset = Math.max(...this.comparisons.filter((c) => now - c.at < kValid).map((c) => c.least));
    return Math.max(0, now - offset - time); // of an empty list the offset is -Infinity
  }
}
