// SPDX-License-Identifier: Apache-2.0
/** Trajectories: selection, start, progress, pause, resume, stop. */
import type { Trajectory } from "../state/robot";
import { fetchJson } from "../state/robot";
import { limitsInTheWay, nameOf } from "../state/descriptions";
import { describeSummary } from "../state/summary";
import { Action, Phase } from "../wire/messages";
import type { RunSummary } from "../wire/messages";
import type { Context, Panel } from "./context";
import { order, whyNotMove } from "./context";
import { action, card, h, setAttribute, setClass, setShown, setText, setUsable } from "./dom";
import { confirmed } from "./hold";
import { millimetres } from "../state/numbers";

export class Run implements Panel {
  readonly element: HTMLElement;
  private readonly choice = h("select", { id: "trajectory", "aria-label": "Trajectory" });
  private readonly text = h("textarea", {
    id: "trajectory-text",
    rows: "6",
    spellcheck: "false",
    "aria-label": "The trajectory as YAML",
  });
  private readonly bar = h("progress", { max: "1", value: "0", "aria-label": "Progress of the trajectory" });
  private readonly progress = h("output.progress", { id: "progress", "aria-live": "off" }, "no trajectory");
  private readonly errors = h("output", { id: "errors" });
  private readonly limits = h("p.limits", { hidden: true, id: "limits" });
  private readonly result = h("details.result", { hidden: true, open: "", id: "run-summary" });
  private shown: RunSummary | null = null;
  private readonly start: HTMLButtonElement;
  private readonly pause: HTMLButtonElement;
  private readonly resume: HTMLButtonElement;
  private readonly stop: HTMLButtonElement;
  private trajectories: Trajectory[] = [];

  constructor(private readonly c: Context) {
    const { commander } = c;
    this.start = action(
      "Start",
      "Follow this trajectory from the present joints",
      () => void order(c, "Start", commander.start(this.text.value)),
      "go",
    );
    this.pause = action(
      "Pause",
      "Pause at this point",
      () => void order(c, "Pausing the trajectory", commander.pauseTrajectory()),
    );
    this.resume = confirmed(
      "Hold to resume",
      "Resume the trajectory",
      () => void order(c, "Resuming the trajectory", commander.resumeTrajectory()),
    );
    this.stop = action(
      "End",
      "End the trajectory; the arms stay ENABLED",
      () => void order(c, "Ending the trajectory", commander.stopTrajectory()),
    );
    [this.start.id, this.pause.id, this.resume.id, this.stop.id] = ["run-start", "run-pause", "run-resume", "run-end"];
    this.choice.addEventListener("change", () => this.show());
    this.element = card(
      "Trajectory",
      h("div.row", {}, this.choice, this.start),
      h("details", {}, h("summary", {}, "As YAML, editable before the start"), this.text),
      this.bar,
      h("div.line", {}, this.progress, this.errors),
      this.limits,
      h("div.row", {}, this.pause, this.resume, this.stop),
      this.result,
    );
    void this.load();
  }

  private async load(): Promise<void> {
    try {
      this.trajectories = await fetchJson<Trajectory[]>("/api/trajectories");
      const usable = (t: Trajectory): boolean => t.refused === "";
      const option = (t: Trajectory): HTMLOptionElement =>
        usable(t)
          ? h("option", { value: t.name }, t.name)
          : h("option", { value: t.name, disabled: "", title: t.refused }, `${t.name}: not for this robot`);
      const others = this.trajectories.filter((t) => !usable(t));
      this.choice.replaceChildren(...this.trajectories.filter(usable).map(option), ...others.map(option));
      this.show();
    } catch (error) {
      this.c.messages.add("bad", `Trajectories: ${String(error)}`);
    }
  }
  private show(): void {
    this.text.value = this.trajectories.find((t) => t.name === this.choice.value)?.yaml ?? "";
  }

  /** Result of the last run, from its end to the start of the next. */
  private showSummary(): void {
    const summary = this.c.world.lastRun();
    setShown(this.result, summary !== null && summary.trajectory_id === this.c.world.plan()?.trajectory_id);
    if (summary === null || summary === this.shown) return;
    this.shown = summary;
    const text = describeSummary(
      summary,
      this.c.robot.arms.map(({ name }) => name),
    );
    this.result.replaceChildren(
      h("summary", {}, text.headline),
      h("ul", {}, ...text.lines.map((line) => h("li", {}, line))),
    );
    setClass(this.result, "bad", text.bad);
  }

  update(now: number): void {
    const plan = this.c.world.plan();
    const status = this.c.world.controlStatus();
    const phase = plan?.phase ?? Phase.idle;
    const share = plan && plan.point_count > 0 ? plan.point / plan.point_count : 0;
    setAttribute(this.bar, "value", share.toFixed(3));
    setText(
      this.progress,
      plan && plan.trajectory_id !== 0
        ? `${phase === Phase.running && this.c.world.paused() ? "waits for the PAUSED arms" : nameOf("Phase", phase)} · point ${plan.point} of ${plan.point_count} · ${plan.total_iterations} steps`
        : plan
          ? "no trajectory yet"
          : "not known",
    );
    const errors = status ? [...status.task_error.slice(0, status.task_count)] : [];
    setText(this.errors, errors.length > 0 ? `error ${errors.map((e) => millimetres(e, 3)).join(" / ")} mm` : "");
    const limits = status ? limitsInTheWay(status, this.c.robot.arms) : "";
    setText(this.limits, limits);
    setShown(this.limits, limits !== "");

    this.showSummary();

    const why = whyNotMove(this.c, now);
    const goes = phase === Phase.running || phase === Phase.paused;
    const start = this.c.world.whyNot(Action.start) || (this.text.value === "" ? "There is no trajectory." : "");
    setUsable(this.start, why || start);
    setUsable(this.pause, why || (phase === Phase.running ? "" : "No trajectory runs."));
    this.resume.dataset["help"] = `Hold for a second: ${this.c.world.continues()}`;
    setUsable(this.resume, why || (phase === Phase.paused ? "" : "No trajectory is paused."));
    setUsable(this.stop, why || (goes ? "" : "No trajectory runs."));
  }
}
