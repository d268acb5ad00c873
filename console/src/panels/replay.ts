// SPDX-License-Identifier: Apache-2.0
/** Replay of a recording in place of the robot: the list of recordings, and a banner with time, speed, marks and events. */
import { whyNoReplay } from "../state/permission";
import { kSpeeds, Player } from "../state/player";
import type { RecordingAbout } from "../state/player";
import { fetchJson } from "../state/robot";
import { Timeline } from "../state/timeline";
import type { Happening } from "../state/timeline";
import { World } from "../state/world";
import { Choice } from "./choice";
import type { Context, Panel } from "./context";
import { action, h, setAttribute, setShown, setText, setUsable } from "./dom";
import { Notices } from "./notices";

/** What is shown in place of the robot. */
export interface Shown {
  c: Context;
  /** Newest time in the charts, s. */
  present: () => number;
}

interface Files {
  folder: string;
  recordings: { file: string; bytes: number }[];
}

const kGlyph = { mark: "⚑", fault: "✕", stop: "■", run: "▶" } as const;
const kMostListed = 100;

/** "1:02.40" @param digits  of a second */
export const duration = (milliseconds: number, digits = 2): string => {
  const unit = 10 ** digits;
  const all = Math.round((Math.max(0, milliseconds) / 1000) * unit); // 59.996 s are a minute
  const seconds = ((all % (60 * unit)) / unit).toFixed(digits).padStart(3 + digits, "0");
  return `${Math.floor(all / (60 * unit))}:${seconds}`;
};
const dateTime = (time: number): string =>
  new Date(time).toLocaleString("en-GB", { dateStyle: "full", timeStyle: "medium" });

export class Replay implements Panel {
  /** Above the scene, while a recording is shown. */
  readonly element: HTMLElement;
  /** For the card of recordings. */
  readonly list: HTMLElement;
  private readonly files = h("ol.recordings", { id: "recordings", "aria-label": "Recordings, the newest first" });
  private readonly folder = h("p.fine");
  private readonly file = h("b", { id: "replay-file" });
  private readonly other = h("b.other", { id: "replay-other", hidden: true });
  private readonly when = h("span", { id: "replay-when" });
  private readonly time = h("output.time", { id: "replay-time" });
  private readonly scrub = h("input", {
    type: "range",
    id: "replay-scrub",
    min: "0",
    step: "0.01",
    "aria-label": "Time in the recording",
  });
  private readonly ticks = h("div.ticks", { "aria-hidden": "true" });
  private readonly events = h("ol.events", { id: "replay-events", "aria-label": "Marks and events of the recording" });
  private readonly play: HTMLButtonElement;
  private readonly speed: Choice;
  private readonly end: HTMLButtonElement;
  private buttons: HTMLButtonElement[] = [];
  private listed = -1;
  /** The recording that is shown once the server has described it; empty: none. */
  private opening = "";
  private player: Player | null = null;
  private timeline: Timeline | null = null;
  private shown: Shown | null = null;

  /** @param show  shows a recording, or the robot again (null) @param jumped  what was drawn before does not lead here */
  constructor(
    private readonly c: Context,
    private readonly show: (shown: Shown | null) => void,
    private readonly jumped: () => void,
  ) {
    const small = (id: string, label: string, help: string, act: () => void): HTMLButtonElement => {
      const button = action(label, help, act, "small");
      button.id = id;
      return button;
    };
    this.play = small("replay-play", "Play", "Let the recording run, or hold it", () => this.toggle());
    const back = small("replay-back", "◂ step", "To the sample before", () => void this.player?.step(-1));
    const step = small("replay-step", "step ▸", "To the next sample", () => void this.player?.step(1));
    this.end = small("replay-end", "Return to live", "Show the robot again", () => this.close());
    this.speed = new Choice(
      "replay-speed",
      "Speed",
      kSpeeds.map((times) => ({ value: String(times), text: `${times}×` })),
      () => this.player && (this.player.speed = Number(this.speed.value)),
    );
    this.scrub.addEventListener("input", () => this.seek(Number(this.scrub.value) * 1000));
    this.element = h(
      "section.replay",
      { id: "replay", "aria-label": "Replay of a recording", hidden: true },
      h("div.line", {}, h("strong", {}, "⟲ REPLAY, not the robot"), this.file, this.other, this.when, this.end),
      h("div.line", {}, back, this.play, step, this.speed.element, this.time),
      h("div.scrub", {}, this.scrub, this.ticks),
      this.events,
    );
    const more = h("summary", {}, "Replay a recording");
    this.list = h("details", { id: "replay-list", ontoggle: () => void this.look() }, more, this.files, this.folder);
  }

  /** Asks for the list of recordings. */
  private async look(): Promise<void> {
    if (!(this.list as HTMLDetailsElement).open) return;
    try {
      const { folder, recordings } = await fetchJson<Files>("/api/recordings");
      this.buttons = recordings.slice(0, kMostListed).map(({ file, bytes }) => {
        const button = action(`${file} · ${(bytes / 1e6).toFixed(1)} MB`, "Show it in place of the robot", () => {
          void this.open(file);
        });
        button.dataset["file"] = file;
        return button;
      });
      this.files.replaceChildren(...this.buttons.map((button) => h("li", {}, button)));
      const more =
        recordings.length > kMostListed ? ` The newest ${kMostListed} of ${recordings.length} are listed.` : "";
      setText(this.folder, `${recordings.length === 0 ? "No recordings" : "Recordings"} in ${folder}.${more}`);
    } catch (error) {
      this.c.messages.add("bad", `Recordings: ${String(error)}`);
    }
  }

  private whyNot(): string {
    return whyNoReplay({ lease: this.c.commander.holds ? "mine" : "free" });
  }

  private async open(file: string): Promise<void> {
    if (this.whyNot() !== "") return;
    this.opening = file;
    try {
      const about = await fetchJson<RecordingAbout>("/api/recordings/about", `file=${encodeURIComponent(file)}`);
      if (this.whyNot() !== "" || this.opening !== file) return;
      this.opening = "";
      if (this.player) this.close();
      this.begin(about);
    } catch (error) {
      this.c.messages.add("bad", `Replay of ${file} refused: ${String(error)}`);
    }
  }

  private begin(about: RecordingAbout): void {
    const { messages } = this.c;
    const failed = (why: string): void => messages.add("bad", `Replay of ${about.file}: ${why}`);
    const player = new Player(about, failed);
    const foreign = about.description !== null;
    const robot = { ...this.c.robot, ...about.description };
    const world = new World(robot, player, player);
    const timeline = new Timeline(about, robot);
    this.player = player;
    this.timeline = timeline;
    this.listed = -1;
    const notices = new Notices();
    this.shown = {
      c: { ...this.c, robot, world, replayed: about.file, notices },
      present: () => player.time / 1000,
    };
    player.jumped = this.jumped;
    player.speed = 1;
    this.speed.value = "1";
    setText(this.file, about.file);
    setShown(this.other, foreign);
    const name = `another robot or deployment: ${robot.robot} · ${robot.deployment}`;
    setText(this.other, `${name}, as the recording describes it`);
    setText(this.when, `recorded ${dateTime(about.start_ms)}`);
    this.scrub.max = ((about.end_ms - about.start_ms) / 1000).toFixed(2);
    const of = foreign ? ` of ${name}` : "";
    messages.add("info", `Replay of ${about.file}${of}, recorded ${dateTime(about.start_ms)}: commands are locked`);
    for (const damage of about.damage) messages.add("bad", `Replay: ${damage}`);
    this.show(this.shown);
    void player.seek(about.start_ms);
    timeline.look().catch((error: unknown) => failed(String(error)));
  }

  /** The robot is shown again. @param why  what has happened to it; empty: it was asked for */
  close(why = ""): void {
    if (this.opening !== "" && why !== "") {
      this.c.messages.add("bad", `Replay of ${this.opening} has not begun: ${why}`);
      this.opening = "";
    }
    if (!this.shown) return;
    const file = this.shown.c.replayed;
    this.shown = this.player = null;
    this.timeline?.end();
    this.timeline = null;
    this.show(null);
    const text = `Replay of ${file} has ended${why === "" ? "" : `: ${why}`}. The robot is shown.`;
    this.c.messages.add(why === "" ? "info" : "bad", text);
  }

  private toggle(): void {
    const { player } = this;
    if (!player) return;
    if (!player.playing && player.time >= player.about.end_ms) void player.seek(player.about.start_ms);
    player.playing = !player.playing;
  }
  /** @param from  ms from the beginning */
  private seek(from: number): void {
    if (this.player) void this.player.seek(this.player.about.start_ms + from);
  }

  /** Called for each image. */
  tick(now: number): void {
    this.player?.tick(now);
  }

  update(): void {
    for (const button of this.buttons) setUsable(button, this.whyNot());
    setShown(this.element, this.player !== null);
    const { player, timeline } = this;
    if (!player || !timeline) return;
    const { start_ms, end_ms } = player.about;
    const at = player.time - start_ms;
    const all = end_ms - start_ms;
    setText(this.play, player.playing ? "Pause" : "Play");
    setAttribute(this.play, "aria-pressed", String(player.playing));
    const waits = player.waiting ? " · loading" : "";
    const looked = timeline.looked < end_ms ? ` · events until ${duration(timeline.looked - start_ms)}` : "";
    const clock = new Date(player.time).toLocaleTimeString("en-GB");
    setText(this.time, `${duration(at, 3)} of ${duration(all)} · ${clock}${waits}${looked}`);
    if (!player.waiting || player.playing) this.scrub.value = (at / 1000).toFixed(2);
    setAttribute(this.scrub, "aria-valuetext", `${duration(at)} of ${duration(all)}`);
    if (timeline.all.length !== this.listed) this.showEvents(timeline.all, start_ms, all);
  }

  private showEvents(happenings: readonly Happening[], start: number, all: number): void {
    this.listed = happenings.length;
    this.events.replaceChildren(
      ...happenings.map(({ time, kind, text }) =>
        h(
          "li",
          { "data-kind": kind },
          action(`${kGlyph[kind]} ${duration(time - start)} ${text}`, text, () => this.seek(time - start), "small"),
        ),
      ),
    );
    this.ticks.replaceChildren(
      ...happenings.map(({ time, kind }) => {
        const tick = h("i", { "data-kind": kind });
        tick.style.left = `${((100 * (time - start)) / Math.max(1, all)).toFixed(2)}%`;
        return tick;
      }),
    );
  }
}
