// SPDX-License-Identifier: Apache-2.0
/** Plays a recording of the server: a source of samples beside the link, with a clock that stands, runs and jumps. */
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";

import { Slot } from "../wire/link";
import type { Source } from "../wire/link";
import { parseSamples } from "../wire/samples";
import type { Sample } from "../wire/samples";
import { fetchBytes } from "./robot";
import type { RobotDescription } from "./robot";

/** GET /api/recordings/about */
export interface RecordingAbout {
  file: string;
  robot: string;
  deployment: string;
  /** ms since 1970, of the first and the last message. */
  start_ms: number;
  end_ms: number;
  messages: number;
  marks: { time_ms: number; text: string }[];
  /** What is wrong with the file. */
  damage: string[];
  channels: { id: number; topic: string; type: string }[];
  /** Of the message types. */
  definitions: Record<string, string>;
  /** The robot and the deployment as the recording describes them; null: those of the server. */
  description: RobotDescription | null;
}

/** A slot for a topic of a recording; without channel if it has none. @param failed  called for a sample that does not decode */
export function recordedSlot<T>(
  about: RecordingAbout,
  topic: string,
  listener: ((message: T, time: number) => void) | undefined,
  rate: number,
  failed: (why: string) => void,
): Slot {
  const slot = new Slot(topic, listener, rate, failed);
  const channel = about.channels.find((one) => one.topic === topic);
  if (!channel) return slot;
  slot.channel = channel.id;
  slot.reader = new MessageReader(parse(about.definitions[channel.type]!, { ros2: true }));
  return slot;
}

export const kSpeeds = [0.25, 0.5, 1, 2, 5, 10] as const;

const kRate = 20; // samples per second of each topic
const kSegment = 5000; // ms in one piece
const kBefore = 30_000; // ms that charts show
const kMostSegments = 24; // in memory: some 1 MB each
const kLongestTick = 250; // ms: a page that hung does not jump
const kEdge = 0.001; // ms: times are rounded

/** Asks for samples in a range of time, in as many answers as the server makes of it.
 * @param rate  samples per second of a best-effort topic @param part  called with each answer; false ends */
export async function fetchSamples(
  file: string,
  range: { from: number; to: number },
  rate: number,
  channels: Iterable<number>,
  part: (samples: Sample[], reached: number) => boolean,
): Promise<void> {
  const topics = [...channels].join(",");
  for (let at = range.from; at < range.to;) {
    const query = `file=${encodeURIComponent(file)}&from=${at.toFixed(3)}&to=${range.to.toFixed(3)}&rate=${rate}&topics=${topics}`;
    const { reached, samples } = parseSamples(await fetchBytes("/api/recordings/samples", query));
    at = Math.max(reached, at + kEdge);
    if (!part(samples, Math.min(at, range.to))) return;
  }
}

interface Segment {
  /** In the order of time; null: not here yet. */
  samples: Sample[] | null;
  loading: Promise<void>;
}

export class Player implements Source {
  readonly state = "open";
  /** ms since 1970: what is shown was recorded then. */
  time: number;
  speed = 1;
  playing = false;
  /** Called after a jump: what was drawn before does not lead here. */
  jumped = (): void => {};
  private readonly first: number;
  private readonly last: number;
  private readonly slots = new Map<number, Slot>();
  private readonly segments = new Map<number, Segment>();
  /** Seeks so far. */
  private jumps = 0;
  /** Ends with the last seek or step. */
  private moves: Promise<void> = Promise.resolve();
  private seeking = false;
  /** Time does not run on because samples are missing. */
  private starving = false;
  private tickedAt = -1;
  /** ms since 1970: what the slots have was recorded until then. */
  private fedTo: number;

  /** @param failed  called with the reason when samples cannot be had; it stands then */
  constructor(
    readonly about: RecordingAbout,
    private readonly failed: (why: string) => void,
  ) {
    this.first = about.start_ms - kEdge;
    this.last = about.end_ms + kEdge;
    this.time = this.fedTo = about.start_ms;
  }

  subscribe<T>(topic: string, listener?: (message: T, time: number) => void): Slot {
    const slot = recordedSlot(this.about, topic, listener, kRate, this.failed);
    if (slot.channel >= 0) this.slots.set(slot.channel, slot);
    return slot;
  }
  /** Samples of the shown time are on their way. */
  get waiting(): boolean {
    return this.seeking || this.starving;
  }
  /** Age of a sample at the shown time, ms. */
  age(time: number): number {
    return Math.max(0, this.time - time);
  }

  private readonly index = (time: number): number => Math.floor((time - this.first) / kSegment);
  private segment(k: number): Segment {
    let found = this.segments.get(k);
    if (!found) {
      found = { samples: null, loading: Promise.resolve() };
      found.loading = this.load(k, found);
      this.segments.set(k, found);
    }
    return found;
  }
  private async load(k: number, segment: Segment): Promise<void> {
    const from = this.first + k * kSegment;
    const range = { from, to: Math.min(from + kSegment, this.last) };
    const all: Sample[] = [];
    try {
      await fetchSamples(this.about.file, range, kRate, this.slots.keys(), (samples) => {
        for (const one of samples) if (one.time < range.to) all.push(one);
        return true;
      });
      segment.samples = all.sort((a, b) => a.time - b.time);
      this.forget();
    } catch (error) {
      this.segments.delete(k);
      this.playing = false;
      throw error;
    }
  }
  /** Drops what is far from the shown time. */
  private forget(): void {
    const here = this.index(this.time);
    const far = [...this.segments.keys()].sort((a, b) => Math.abs(b - here) - Math.abs(a - here));
    for (const k of far.slice(0, Math.max(0, far.length - kMostSegments))) this.segments.delete(k);
  }

  /** Gives the samples after `from` and up to `to` to the slots. */
  private feed(from: number, to: number): void {
    const now = performance.now();
    for (let k = Math.max(0, this.index(from)); k <= this.index(to); ++k)
      for (const { channel, time, payload } of this.segments.get(k)?.samples ?? [])
        if (time > from && time <= to) this.slots.get(channel)?.put(payload, now, time);
    this.fedTo = to;
  }

  /** Shows this time. The samples of the seconds before it fill the charts. */
  seek(time: number): Promise<void> {
    return (this.moves = this.show(time, ++this.jumps));
  }
  /** To the next sample of control's status, or to the one before, once what was asked for earlier is shown. A later seek, or running on,
   * takes its place. */
  step(by: 1 | -1): Promise<void> {
    this.playing = false;
    const jump = this.jumps;
    return (this.moves = this.moves.then(() => this.toSample(by, () => jump !== this.jumps || this.playing)));
  }

  /** @param jump  the number of the seek: it ends when a later one has begun */
  private async show(time: number, jump: number): Promise<void> {
    this.time = Math.min(Math.max(time, this.about.start_ms), this.about.end_ms);
    this.seeking = true;
    const from = Math.max(this.first, this.time - kBefore);
    try {
      for (let k = this.index(from); k <= this.index(this.time); ++k) {
        await this.segment(k).loading;
        if (jump !== this.jumps) return;
      }
    } catch (error) {
      if (jump === this.jumps) this.stand(String(error));
      return;
    }
    for (const slot of this.slots.values()) slot.clear();
    this.jumped();
    this.feed(from, this.time);
    this.seeking = false;
  }
  private async toSample(by: 1 | -1, outdated: () => boolean): Promise<void> {
    const status = [...this.slots].find(([, { topic }]) => topic.endsWith("/control/status"))?.[0];
    const from = this.time;
    try {
      for (let k = this.index(from); k >= 0 && k <= this.index(this.last) && !outdated(); k += by) {
        const segment = this.segment(k);
        await segment.loading;
        if (outdated()) return;
        const times = (segment.samples ?? [])
          .filter(({ channel, time }) => channel === status && by * (time - from) > 0)
          .map(({ time }) => time);
        if (times.length === 0) continue;
        if (by < 0) return await this.show(Math.max(...times), this.jumps);
        const to = Math.min(...times);
        this.feed(from, to);
        this.time = to;
        return;
      }
    } catch (error) {
      if (!outdated()) this.stand(String(error));
    }
  }
  /** At the time that is shown: another one would be said of samples that are not its own. */
  private stand(why: string): void {
    this.time = this.fedTo;
    this.playing = this.seeking = this.starving = false;
    this.failed(why);
  }

  /** Lets the time run. Called for each image. */
  tick(now: number): void {
    const passed = this.tickedAt < 0 ? 0 : Math.min(now - this.tickedAt, kLongestTick);
    this.tickedAt = now;
    if (!this.playing || this.seeking) {
      this.starving = false;
      return;
    }
    const here = this.index(this.time);
    const ahead = here + 1 + Math.ceil((2000 * this.speed) / kSegment);
    for (let k = here; k <= Math.min(ahead, this.index(this.last)); ++k)
      if (!this.segments.has(k)) this.segment(k).loading.catch((error: unknown) => this.stand(String(error)));
    let to = Math.min(this.time + passed * this.speed, this.about.end_ms);
    for (let k = here; k <= this.index(to); ++k)
      if (this.segments.get(k)?.samples == null) {
        to = Math.max(this.time, this.first + k * kSegment - kEdge);
        break;
      }
    this.starving = to === this.time && to < this.about.end_ms && passed > 0;
    this.feed(this.time, to);
    this.time = to;
    if (to >= this.about.end_ms) this.playing = false;
  }
}
