// SPDX-License-Identifier: Apache-2.0
/** Events from before this page was opened, or while its link was down: the server keeps the last ones. Each is taken once. */
import { parseSamples } from "../wire/samples";
import type { Sample } from "../wire/samples";

type Handler = (message: never, time: number) => void;

export class Past {
  /** The handlers of the topics with events, by topic. */
  private readonly handlers = new Map<string, Handler>();
  /** Time of the last sample by topic, ms by the server's clock: no sample at or before it is new. */
  private readonly taken = new Map<string, number>();
  /** What came from the link before the past was known; null: it is known. */
  private waiting: (() => void)[] | null = [];
  private asked = 0;

  /** @param ask  GET /api/events, once times of the server can be converted
   * @param decode  topic and message of a sample; null if the page has none
   * @param mark  called before and after the events of the past are taken */
  constructor(
    private readonly ask: () => Promise<ArrayBuffer>,
    private readonly decode: (sample: Sample) => { topic: string; message: unknown } | null,
    private readonly mark: (past: boolean) => void,
  ) {}

  /** A listener of the link for the topic, that gets each sample once and those of the past first. */
  listen<T>(topic: string, handler: (message: T, time: number) => void): (message: T, time: number) => void {
    this.handlers.set(topic, handler);
    return (message, time) => {
      if (this.waiting) this.waiting.push(() => this.take(topic, message, time));
      else this.take(topic, message, time);
    };
  }
  private take(topic: string, message: unknown, time: number): void {
    if (time <= (this.taken.get(topic) ?? -Infinity)) return;
    this.taken.set(topic, time);
    this.handlers.get(topic)?.(message as never, time);
  }

  /** The link is open: asks for what is missing. Until it is there, what the link brings waits. @throw Error if it cannot be had */
  async opened(): Promise<void> {
    const asked = ++this.asked;
    this.waiting ??= [];
    try {
      const { samples } = parseSamples(await this.ask());
      if (asked !== this.asked) return;
      this.mark(true);
      for (const sample of samples) {
        const known = this.decode(sample);
        if (known) this.take(known.topic, known.message, sample.time);
      }
    } finally {
      this.mark(false);
      if (asked === this.asked) {
        const { waiting } = this;
        this.waiting = null;
        for (const take of waiting ?? []) take();
      }
    }
  }
}
