// SPDX-License-Identifier: Apache-2.0
/** Recording of all topics on the server: start, marks, stop. Every page shows it, as one recording runs at a time. */
import type { RecordingState } from "../state/recording";
import { describeRecording } from "../state/recording";
import { fetchJson, mayCommand } from "../state/robot";
import type { Context, Panel } from "./context";
import { action, card, h, setAttribute, setText, setUsable } from "./dom";

const kLook = 1000; // ms between two requests of the state

export class Recording implements Panel {
  readonly element: HTMLElement;
  private readonly toggle: HTMLButtonElement;
  private readonly mark: HTMLButtonElement;
  private readonly text = h("input", {
    type: "text",
    id: "record-mark-text",
    maxlength: "60",
    autocomplete: "off",
    "aria-label": "Text of the mark",
    placeholder: "what happens now",
  });
  private readonly shown = h("output.recording", { id: "recording", "aria-live": "off" });
  private state: RecordingState | null = null;
  /** performance.now() of the last request */
  private asked = -Infinity;

  /** @param replay  the recordings that can be shown */
  constructor(
    private readonly c: Context,
    replay: HTMLElement,
  ) {
    this.toggle = action(
      "Start recording",
      "Record all topics to a file on the robot's machine",
      () => void this.order(this.state?.recording === true ? "stop" : "start"),
    );
    this.toggle.id = "record";
    this.mark = action(
      "Mark",
      "Add a mark with this text and the present time to the recording",
      () => void this.put(),
    );
    this.mark.id = "record-mark";
    this.text.addEventListener("keydown", (event) => event.key === "Enter" && void this.put());
    this.element = card(
      "Recording",
      h("div.row", {}, this.toggle),
      h("div.row", {}, this.text, this.mark),
      this.shown,
      replay,
    );
  }

  private async put(): Promise<void> {
    const text = this.text.value.trim();
    if (this.whyNoMark() !== "") return;
    if (await this.order("mark", `text=${encodeURIComponent(text)}`)) this.text.value = "";
  }
  /** @returns whether the server has done it */
  private async order(what: "start" | "stop" | "mark", query = ""): Promise<boolean> {
    const name = { start: "Start of the recording", stop: "End of the recording", mark: "Mark" }[what];
    try {
      this.take(await fetchJson<RecordingState>(`/api/recording/${what}`, query, "POST"));
      this.c.messages.add("done", `${name}: done`);
      return true;
    } catch (error) {
      this.c.messages.add("bad", `${name} refused: ${String(error)}`);
      return false;
    }
  }
  private async look(): Promise<void> {
    try {
      this.take(await fetchJson<RecordingState>("/api/recording"));
    } catch {
      this.state = null; // the page says elsewhere that the server does not answer
    }
  }
  private take(state: RecordingState): void {
    if (this.state?.recording === true && !state.recording)
      this.c.messages.add(state.problem === "" ? "info" : "bad", `Recording: ${describeRecording(state)}`);
    this.state = state;
  }

  private whyNot(): string {
    if (!mayCommand(this.c.robot)) return "Viewer: this page can read and stop, but not record.";
    return this.state === null ? "The server does not answer." : "";
  }
  private whyNoMark(): string {
    if (this.whyNot() !== "") return this.whyNot();
    if (this.state?.recording !== true) return "Nothing is recorded.";
    return this.text.value.trim() === "" ? "The mark has no text." : "";
  }

  update(now: number): void {
    if (now - this.asked > kLook) {
      this.asked = now;
      void this.look();
    }
    const recording = this.state?.recording === true;
    setUsable(this.toggle, this.whyNot());
    setText(this.toggle, recording ? "Stop recording" : "Start recording");
    setAttribute(this.toggle, "aria-pressed", String(recording));
    setUsable(this.mark, this.whyNoMark());
    setText(this.shown, this.state ? describeRecording(this.state) : "");
    setAttribute(this.shown, "data-recording", String(recording));
    setAttribute(this.shown, "title", this.state?.file ?? "");
  }
}
