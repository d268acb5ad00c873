// SPDX-License-Identifier: Apache-2.0
/** Check of the chosen trajectory, beside its start: path, missed points and reason; and a preview in which ghosts of the arms play the
 * rehearsal. */
import { kThickness } from "../scene/drawing";
import type { Backbone } from "../scene/sweep";
import type { View } from "../scene/view";
import { TrajectoryCheck } from "../state/check";
import { describeCheck } from "../state/checktext";
import { nameOf } from "../state/descriptions";
import type { Rehearsed } from "../state/rehearsal";
import { rehearsedJoints } from "../state/rehearsal";
import { fetchJson, isTranslation, mayCommand } from "../state/robot";
import { Phase } from "../wire/messages";
import type { ComputationProgress, ComputationResult } from "../wire/messages";
import type { Context } from "./context";
import { action, h, setAttribute, setShown, setText, setUsable } from "./dom";

/** Shortest times of one pose and of all, ms. */
const [kPerPose, kPlays] = [80, 6000];

/** Bodies of the arms at some joints, from the server: GET /api/shape. */
interface Shapes {
  arms: ({ points: number[]; tubes: number[]; outer_radius: number[] } | null)[];
}

export class Preview {
  readonly button: HTMLButtonElement;
  readonly text = h("output.check", { id: "run-check", "aria-live": "off" });
  private readonly note: HTMLElement;
  private readonly check: TrajectoryCheck;
  private shown: ComputationResult | null = null;
  private rehearsed: readonly Rehearsed[] = [];
  /** performance.now() at the first pose; -1: the preview does not play */
  private began = -1;
  private readonly shapes = new Map<number, Backbone[] | null>();
  private asked = 0;

  constructor(
    private readonly c: Context,
    private readonly view: View,
  ) {
    const { robot, world, commander } = c;
    this.check = new TrajectoryCheck(
      commander,
      robot.arms.flatMap((arm) => arm.joints.map((_, j) => isTranslation(arm, j))),
    );
    const topic = (name: string): string => `/${robot.prefix}/planning/${name}`;
    world.link.subscribe<ComputationProgress>(topic("progress"), (progress) => {
      if (progress.client === commander.client) this.check.progressed(progress, performance.now());
    });
    world.link.subscribe<ComputationResult>(topic("result"), (result) => {
      if (result.client === commander.client) this.check.ended(result);
    });
    this.button = action("Preview", "Ghosts of the arms move as in the rehearsal; the robot does not move", () =>
      this.began < 0 ? this.play() : this.end(),
    );
    this.button.id = "run-preview";
    this.note = c.notices.line("hold", { id: "preview-note" });
  }

  /** @param yaml  of the chosen trajectory @param chosen  the operator has chosen or edited it */
  update(now: number, yaml: string, chosen: boolean): void {
    const { world, link, robot } = this.c;
    const phase = world.plan()?.phase ?? Phase.idle;
    const runs = phase === Phase.running || phase === Phase.paused;
    if (link.state !== "open") this.check.disconnected();
    const method = nameOf("Method", world.controlStatus()?.method ?? -1, "");
    this.check.look(now, {
      yaml,
      method,
      parameters: world.parameters,
      joints: this.joints(),
      not: this.whyNot(now, chosen, runs),
    });
    const { state } = this.check;
    const { text, level } = describeCheck(state);
    setText(this.text, text);
    setAttribute(this.text, "data-level", level);
    setAttribute(this.text, "title", text);
    const result = state.kind === "done" && !runs ? state.result : null;
    if (result !== this.shown) this.show(result);
    setShown(this.button, robot.capabilities.computation);
    setUsable(this.button, result && this.rehearsed.length > 0 ? "" : "There is no rehearsed trajectory.");
    setText(this.button, this.began < 0 ? "Preview" : "End preview");
    this.animate(now);
  }

  /** Reason of the parser for which the text is no trajectory; empty if it is one, or is not known to be none. */
  get refusal(): string {
    const { state } = this.check;
    return state.kind === "refused" ? state.reason : "";
  }

  /** Why no check is asked for. A page that only looks on leaves planning to the one that has control. */
  private whyNot(now: number, chosen: boolean, runs: boolean): string {
    if (!this.c.robot.capabilities.computation) return "planning has no checks for this type of robot.";
    if (!mayCommand(this.c.robot)) return "a viewer's page cannot ask for it.";
    if (this.c.replayed !== "") return "a recording is shown.";
    if (!this.c.world.live(now)) return "the robot's data is out of date.";
    if (this.c.world.planningSilent(now) !== "") return "planning does not answer.";
    if (runs) return "a trajectory runs.";
    return chosen || this.c.commander.holds ? "" : "take control, or choose a trajectory.";
  }
  private joints(): number[] | null {
    const all = this.c.robot.arms.map(({ joints }, k) => this.c.world.joints(k)?.position.slice(0, joints.length));
    return all.every((one) => one !== undefined) ? all.flatMap((one) => [...one]) : null;
  }
  private show(result: ComputationResult | null): void {
    const { arms, control } = this.c.robot;
    const count = arms.reduce((sum, { joints }) => sum + joints.length, 0);
    this.shown = result;
    this.rehearsed = result ? rehearsedJoints(result, count, control.period) : [];
    this.shapes.clear();
    this.end();
    this.view.preview.show(result?.report.points ?? []);
    this.view.guides.showPath(result === null);
    this.view.touch();
  }

  private play(): void {
    this.began = performance.now();
  }
  private end(): void {
    this.began = -1;
    setShown(this.note, false);
    this.view.preview.ghost(null, [], kThickness);
    this.view.touch();
  }

  private animate(now: number): void {
    if (this.began < 0) return;
    const at = Math.floor((now - this.began) / Math.max(kPerPose, kPlays / this.rehearsed.length));
    const pose = this.rehearsed[at];
    if (!pose) return this.end();
    const shapes = this.shapes.get(at);
    if (shapes) {
      const { joints, point, time } = pose;
      const all = this.shown!.without_posture.points;
      setShown(this.note, true);
      setText(this.note, `PREVIEW, not the robot: point ${point} of ${all}, ${time.toFixed(1)} s after the start`);
      setAttribute(this.note, "data-joints", joints.join(" "));
      let from = 0;
      const angles = this.c.robot.arms.map((arm) => {
        const turns = arm.tubes.length;
        const own = joints.slice(from + turns, from + 2 * turns);
        from += arm.joints.length;
        return own;
      });
      this.view.preview.ghost(shapes, angles, kThickness);
      this.view.touch();
    } else if (shapes === undefined && this.asked < 2) void this.fetch(at, pose);
  }

  private async fetch(at: number, { joints }: Rehearsed): Promise<void> {
    const of = this.shown;
    this.asked += 1;
    this.shapes.set(at, null);
    try {
      const { arms } = await fetchJson<Shapes>("/api/shape", `joints=${joints.join(",")}`);
      if (of !== this.shown) return;
      this.shapes.set(
        at,
        arms.flatMap((arm) =>
          arm
            ? [
                {
                  points: Float32Array.from(arm.points),
                  tubes: Uint8Array.from(arm.tubes),
                  radius: Float32Array.from(arm.outer_radius),
                },
              ]
            : [],
        ),
      );
    } catch (error) {
      this.c.messages.add("bad", `Preview: ${String(error)}`);
      this.end();
    } finally {
      this.asked -= 1;
    }
  }
}
