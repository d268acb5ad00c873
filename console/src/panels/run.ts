// SPDX-License-Identifier: Apache-2.0
/** Trajectories: selection and start in a panel; progress, pause, resume and end in a bar that is always visible. */
import type { Trajectory } from "../state/robot";
import { fetchJson } from "../state/robot";
import { limitsInTheWay, nameOf } from "../state/descriptions";
import { describeSummary, standingOf } from "../state/summary";
import { describeErrors } from "../state/taskerrors";
import { Phase } from "../wire/messages";
import type { RunSummary } from "../wire/messages";
import type { Context, Panel } from "./context";
import { reachesPhase, whyNot } from "./context";
import { Choice, Reasons } from "./choice";
import { action, card, h, setAttribute, setClass, setShown, setText, setUsable } from "./dom";
import { confirmed } from "./hold";
import { TrajectoryForm } from "./form";
import { Preview } from "./preview";
import { formOf } from "../state/shape";
import type { View } from "../scene/view";

export class Run implements Panel {
  readonly element: HTMLElement;
  /** Beside the stop button, at any size of the window. */
  readonly controls: HTMLElement;
  private readonly choice = new Choice("trajectory", "Trajectory", [], () => {
    this.chosen = true;
    this.show();
  });
  private readonly text = h("textarea", {
    id: "trajectory-text",
    rows: "6",
    spellcheck: "false",
    "aria-label": "The trajectory as YAML",
  });
  private readonly bar = h("progress", { max: "1", value: "0", "aria-label": "Progress of the trajectory" });
  private readonly progress = h("output.progress", { id: "progress" }, "no trajectory");
  private readonly errors = h("output", { id: "errors" });
  private readonly limits: HTMLElement;
  private readonly reasons = new Reasons();
  /** Result of the last run: last in the panel, where its coming moves nothing. */
  readonly result = h("details.result", {
    hidden: true,
    open: "",
    id: "run-summary",
    ontoggle: () => (this.result.style.minHeight = ""),
  });
  private readonly past = h("strong", { hidden: true }, "Past, not of the system that runs now: ");
  private shown: RunSummary | null = null;
  private readonly start: HTMLButtonElement;
  private readonly pause: HTMLButtonElement;
  private readonly resume: HTMLButtonElement;
  private readonly stop: HTMLButtonElement;
  private trajectories: Trajectory[] = [];

  private readonly preview: Preview;
  private readonly form: TrajectoryForm;
  /** The operator has chosen or edited the trajectory. */
  private chosen = false;

  constructor(
    private readonly c: Context,
    view: View,
  ) {
    const { commander, orders } = c;
    this.preview = new Preview(c, view);
    this.text.addEventListener("input", () => {
      this.edited();
      this.form.follows(false);
    });
    this.form = new TrajectoryForm(
      c.robot.arms.map(({ name }) => name),
      (yaml) => {
        this.edited();
        this.text.value = yaml;
      },
    );
    const runs = [Phase.running, Phase.finished, Phase.failed];
    this.start = action(
      "Start",
      "Follow this trajectory from the present joints",
      () => void orders.give("Start", commander.start(this.text.value), reachesPhase(c, runs, true)),
      "go",
    );
    this.pause = action(
      "Pause",
      "Pause at this point",
      () => void orders.give("Pausing the trajectory", commander.pauseTrajectory(), reachesPhase(c, [Phase.paused])),
    );
    this.resume = confirmed(
      "Hold to resume",
      "Resume the trajectory",
      () => void orders.give("Resuming the trajectory", commander.resumeTrajectory(), reachesPhase(c, runs)),
      (text) => c.messages.add("bad", text),
    );
    this.stop = action(
      "End",
      "End the trajectory; the arms stay ENABLED",
      () => void orders.give("Ending the trajectory", commander.stopTrajectory(), reachesPhase(c, [Phase.idle])),
    );
    [this.start.id, this.pause.id, this.resume.id, this.stop.id] = ["run-start", "run-pause", "run-resume", "run-end"];
    this.start.setAttribute("aria-describedby", this.preview.text.id);
    this.limits = c.notices.line("limits", { id: "limits" });
    const yaml = h(
      "details",
      { id: "trajectory-yaml" },
      h("summary", {}, "As YAML, editable before the start"),
      this.text,
    );
    const replayed = c.replayed !== ""; // nothing is started there: there is no list
    setShown(this.form.element, c.robot.capabilities.tips && !replayed);
    setShown(yaml, !replayed);
    this.element = card(
      "Trajectory",
      this.choice.element,
      h("div.row", {}, this.start, this.preview.button),
      this.preview.text,
      this.reasons.element,
      this.form.element,
      yaml,
    );
    this.controls = h(
      "section.run",
      { "aria-label": "The trajectory under way" },
      this.progress,
      this.errors,
      this.bar,
      h("div.row", {}, this.pause, this.resume, this.stop),
    );
    if (!replayed) void this.load();
  }

  private async load(): Promise<void> {
    try {
      this.trajectories = await fetchJson<Trajectory[]>("/api/trajectories");
      const sorted = [...this.trajectories].sort((a, b) => Number(a.refused !== "") - Number(b.refused !== ""));
      this.choice.offer(sorted.map(({ name, refused }) => ({ value: name, text: name, why: refused })));
      if (this.chosen) this.edited();
      else this.show();
    } catch (error) {
      this.c.messages.add("bad", `Trajectories: ${String(error)}`);
    }
  }
  /** The text is the operator's: Start follows none of the list. */
  private edited(): void {
    this.chosen = true;
    this.choice.value = "";
  }
  private show(): void {
    const found = this.trajectories.find((t) => t.name === this.choice.value);
    this.text.value = found?.yaml ?? "";
    const arms = this.c.robot.arms.map(({ name }) => name);
    if (found?.spec) this.form.show(formOf(found.name, found.spec, arms));
  }

  /** Result of the last run, from its end to the start of the next; one from before the start of planning is marked as such. */
  private showSummary(): void {
    const { world, robot } = this.c;
    const summary = world.lastRun();
    const standing = standingOf(summary, world.plan(), robot.fingerprint);
    // Its space stays, so that nothing moves under the pointer that starts the next run.
    setClass(this.result, "away", standing === "none");
    if (standing !== "none") {
      setShown(this.result, true);
      setShown(this.past, standing === "earlier");
      setClass(this.result, "earlier", standing === "earlier");
    }
    if (summary === null || summary === this.shown) return;
    this.shown = summary;
    const text = describeSummary(
      summary,
      robot.arms.map(({ name }) => name),
    );
    this.result.style.minHeight = `${this.result.offsetHeight}px`;
    this.result.replaceChildren(
      h("summary", {}, this.past, text.headline),
      h("ul", {}, ...text.lines.map((line) => h("li", {}, line))),
    );
    setClass(this.result, "bad", text.bad);
  }

  private progressText(now: number): string {
    const { world, replayed } = this.c;
    const plan = world.plan();
    if (!plan) return "not known";
    if (plan.trajectory_id === 0) return "no trajectory yet";
    const silent = replayed === "" ? world.planningSilent(now) : "";
    const phase = nameOf("Phase", plan.phase);
    const waits = plan.phase === Phase.running && world.paused();
    // One line holds them all; the name, which may be of any length, is last.
    const parts =
      silent === ""
        ? [waits ? "waits for PAUSED arms" : phase, `point ${plan.point} of ${plan.point_count}`]
        : [`not known for ${silent}`, `then ${phase}`];
    return [...parts, world.trajectoryName()].filter((part) => part !== "").join(" · ");
  }

  update(now: number): void {
    const plan = this.c.world.plan();
    const status = this.c.world.controlStatus();
    const share = plan && plan.point_count > 0 ? plan.point / plan.point_count : 0;
    setAttribute(this.bar, "value", share.toFixed(3));
    const progress = this.progressText(now);
    setText(this.progress, progress);
    setAttribute(this.progress, "title", progress);
    setText(this.errors, status ? describeErrors(status, this.c.world.followed(status)) : "");
    const limits = status ? limitsInTheWay(status, this.c.robot.arms) : "";
    setText(this.limits, limits);
    setShown(this.limits, limits !== "");
    this.showSummary();

    const start = whyNot(this.c, "start", now) || (this.text.value === "" ? "There is no trajectory." : "");
    setUsable(this.start, start);
    this.reasons.show([["Start", start]]);
    this.preview.update(now, this.text.value, this.chosen);
    this.form.blame(this.preview.refusal);
    this.resume.dataset["help"] = `Hold for a second: ${this.c.world.continues()}`;
    setUsable(this.pause, whyNot(this.c, "pauseTrajectory", now));
    setUsable(this.resume, whyNot(this.c, "resumeTrajectory", now));
    setUsable(this.stop, whyNot(this.c, "endTrajectory", now));
  }
}
