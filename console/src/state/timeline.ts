// SPDX-License-Identifier: Apache-2.0
/** What happened in a recording, and when: its marks, and the faults, stops and runs that are found in its messages. */
import type { Slot } from "../wire/link";
import type { ControlStatus, PlanningReference, RunSummary, Stop } from "../wire/messages";
import { Phase } from "../wire/messages";
import { changesOf } from "./events";
import { fetchSamples, recordedSlot } from "./player";
import type { RecordingAbout } from "./player";
import type { Robot } from "./robot";
import { describeSummary } from "./summary";

export type Kind = "mark" | "fault" | "stop" | "run";
export interface Happening {
  /** ms since 1970 */
  time: number;
  kind: Kind;
  text: string;
}

const kSlow = 0.1; // samples per second: those with events come in addition
const kRepeated = 1000; // ms: a stop is repeated until it is confirmed
const kMost = 500;

export class Timeline {
  /** In the order of time. */
  readonly all: Happening[] = [];
  /** ms since 1970, up to which it has looked. */
  looked: number;
  private ended = false;
  private readonly slots = new Map<number, Slot>();
  private status: ControlStatus | null = null;
  private running = -1;
  private stoppedAt = -Infinity;

  constructor(
    private readonly about: RecordingAbout,
    private readonly robot: Robot,
  ) {
    this.looked = about.start_ms;
    for (const { time_ms, text } of about.marks) this.add(time_ms, "mark", text);
    this.watch<ControlStatus>("control/status", (status, time) => this.controlled(status, time));
    this.watch<PlanningReference>("planning/reference", (reference, time) => this.planned(reference, time));
    this.watch<RunSummary>("planning/summary", (summary, time) => {
      // Of a run before the recording, it comes at its beginning.
      if (this.running >= 0) this.add(time, "run", describeSummary(summary, this.arms).headline);
    });
    this.watch<Stop>("stop", ({ reason }, time) => {
      if (time - this.stoppedAt > kRepeated) this.add(time, "stop", `Stop: ${reason}`);
      this.stoppedAt = time;
    });
  }

  private watch<T>(name: string, listener: (message: T, time: number) => void): void {
    const slot = recordedSlot(this.about, `/${this.robot.prefix}/${name}`, listener, kSlow, () => {});
    if (slot.channel >= 0) this.slots.set(slot.channel, slot);
  }
  private get arms(): string[] {
    return this.robot.arms.map(({ name }) => name);
  }
  private add(time: number, kind: Kind, text: string): void {
    if (this.all.length >= kMost) return;
    const later = this.all.findIndex((one) => one.time > time);
    this.all.splice(later < 0 ? this.all.length : later, 0, { time, kind, text });
  }

  private controlled(status: ControlStatus, time: number): void {
    if (this.status)
      for (const [level, text] of changesOf(this.status, status, this.arms))
        if (level === "alarm") this.add(time, "fault", text);
    this.status = status;
  }
  private planned({ phase, trajectory_id }: PlanningReference, time: number): void {
    if (phase !== Phase.running || trajectory_id === this.running) return;
    this.running = trajectory_id;
    this.add(time, "run", "A trajectory runs");
  }

  /** Looks through the recording from its start to its end. @throw Error if the server refuses it */
  async look(): Promise<void> {
    const range = { from: this.about.start_ms - 0.001, to: this.about.end_ms + 0.001 };
    await fetchSamples(this.about.file, range, kSlow, this.slots.keys(), (samples, reached) => {
      for (const { channel, time, payload } of samples) this.slots.get(channel)?.put(payload, 0, time);
      this.looked = reached;
      return !this.ended;
    });
  }
  end(): void {
    this.ended = true;
  }
}
