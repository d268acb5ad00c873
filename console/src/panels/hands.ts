// SPDX-License-Identifier: Apache-2.0
/** Teleoperation: driven arm, mode, and control's stages of processing. */
import { shortName } from "../state/descriptions";
import { Mode } from "../teleop/pilot";
import { describeOrientation, describeTurn, TurnWatch, turnOf } from "../state/turning";
import type { TeleopStatus } from "../wire/messages";
import type { Context, Panel } from "./context";
import { whyNot } from "./context";
import { Choice, Reasons } from "./choice";
import { action, card, h, setAttribute, setClass, setShown, setText, setUsable } from "./dom";
import { degrees, millimetres } from "../state/numbers";

/** Stages whose results are velocities of the device; the results of the others are positions, or rotations. */
const kVelocities = ["deadband", "dead_man", "clutch", "frame", "scale"];
const kStates = ["no input", "refused", "released", "clutched", "following", "stopped: release and hold again"];

export class Hands implements Panel {
  readonly element: HTMLElement;
  private readonly arm: HTMLButtonElement;
  private readonly lamp = h("output.lamp", { id: "teleop-held" });
  private readonly state = h("output.line", { id: "teleop-state" });
  private readonly clamped: HTMLElement;
  /** How far the driven tip is from its commanded orientation. */
  private readonly turn = h("output.line", { id: "teleop-turn" });
  private readonly stuck: HTMLElement;
  private readonly turnWatch = new TurnWatch();
  private readonly numbers = h("output.line");
  private readonly stages = h("ol.stages", { "aria-label": "Teleoperation pipeline, stage by stage" });
  private readonly mode: Choice;
  private readonly driven: Choice;
  private readonly scale = h("input", {
    type: "range",
    id: "teleop-scale",
    min: "0.05",
    max: "1",
    step: "0.05",
    "aria-label": "Scale of the motion",
  });
  private readonly reasons = new Reasons();
  private readonly scaleText = h("output");
  private shown = -1;
  private announced = "";

  constructor(private readonly c: Context) {
    const { pilot, robot } = c;
    this.arm = action(
      "Teleoperation on",
      "Accept input from keys, pointer and gamepad. The robot moves only while one of them is held.",
      () => pilot.arm(!pilot.armed),
      "go",
    );
    this.arm.id = "teleop-on";
    this.clamped = c.notices.line("limits", { id: "teleop-clamped" });
    this.stuck = c.notices.line("limits", { id: "teleop-stuck" });
    this.scale.value = String(pilot.choice.scale);
    const choose = (): void => {
      pilot.gate.release("the selection was changed"); // so that held input does not continue with another meaning
      pilot.choice.mode = Number(this.mode.value);
      pilot.choice.arm = Number(this.driven.value);
      pilot.choice.otherArm = robot.arms.length > 1 ? (pilot.choice.arm === 0 ? 1 : 0) : pilot.choice.arm;
      pilot.choice.scale = Number(this.scale.value);
    };
    this.scale.addEventListener("input", choose);
    const why = robot.arms.length > 1 ? "" : "needs two arms";
    const modes = [
      { value: String(Mode.pair), text: "tip; relative position kept", why },
      { value: String(Mode.relative), text: "relative position; other tip stays", why },
      { value: String(Mode.tip), text: "tip; the other one stays" },
    ];
    this.mode = new Choice("teleop-mode", "Teleoperation mode", modes, choose);
    this.mode.value = String(pilot.choice.mode);
    const arms = robot.arms.map((arm, k) => ({ value: String(k), text: `arm ${shortName(arm.name)}` }));
    this.driven = new Choice("teleop-arm", "Driven arm", arms, choose);
    this.element = card(
      "Teleoperation",
      h("div.row", {}, this.arm, this.lamp),
      this.reasons.element,
      this.driven.element,
      this.mode.element,
      h("label.parameter", {}, h("span", {}, "scale"), this.scale, this.scaleText),
      h("p.fine", { id: "teleop-orientation" }, describeOrientation(robot.teleoperation)),
      this.state,
      this.turn,
      this.numbers,
      this.stages,
      h(
        "p.fine",
        {},
        "Hold to move, let go to stop. In the 3D view: arrows, PageUp and PageDown (or WASD, Q, E); C is the clutch. Drag the driven tip with the pointer, wheel for depth. Gamepad: hold RT, sticks move, LB is the clutch, Back stops.",
      ),
      robot.teleoperation.orientation === "ignored"
        ? null
        : h(
            "p.fine",
            {},
            "Turn: I and K about the view's horizontal axis, J and L about its vertical one, U and O about the line of sight. Drag inside the ring to turn the tip like a ball, along the ring to turn it in the plane of the screen. Gamepad: hold RB, too.",
          ),
    );
  }

  update(now: number): void {
    const { pilot, world } = this.c;
    const gate = pilot.gate;
    gate.allow("link", this.c.link.state === "open");
    gate.allow("live", world.live(now));
    gate.allow("lease", this.c.commander.holds);
    const why = whyNot(this.c, "teleoperate", now, pilot.choice.arm);
    gate.allow("enabled", why === "");
    const whyNoTurn = whyNot(this.c, "turn", now, pilot.choice.arm);
    pilot.turns = whyNoTurn === "";
    setText(this.arm, pilot.armed ? "Teleoperation off" : "Teleoperation on");
    setAttribute(this.arm, "aria-pressed", pilot.armed ? "true" : "false");
    setUsable(this.arm, pilot.armed ? "" : why);
    this.reasons.show([
      ["Teleoperation", why],
      ["Turning", whyNoTurn],
    ]);
    const locked = this.c.replayed === "" ? "" : why; // the choices are those of the robot's pilot
    this.mode.allow(locked);
    this.driven.allow(locked);
    this.scale.disabled = locked !== "";
    setAttribute(this.lamp, "data-held", gate.held ? "yes" : "no");
    let lamp = "○ off";
    if (gate.held) lamp = `● held: ${gate.source}`;
    else if (pilot.armed)
      lamp = gate.obstacle ? `◌ ${gate.obstacle}` : gate.cut ? `○ released: ${gate.cut}` : "○ ready: hold to move";
    setText(this.lamp, lamp);
    if (lamp !== this.announced && this.announced !== "")
      this.c.messages.announcer.event(`Teleoperation ${lamp.slice(2)}`);
    this.announced = lamp;
    setText(this.scaleText, Number(this.scale.value).toFixed(2));
    this.updateStatus(world.teleop.value<TeleopStatus>(), now);
  }

  private updateTurn(teleop: TeleopStatus | null, now: number): void {
    const turn = turnOf(teleop);
    setText(this.turn, turn ? describeTurn(turn, shortName(this.c.robot.arms[turn.arm]?.name ?? "")) : "");
    setShown(this.turn, turn !== null);
    const why = this.turnWatch.see(now, turn, (turn && this.c.world.tip(turn.arm)?.pose.orientation) ?? null);
    setShown(this.stuck, why !== "");
    setText(this.stuck, why);
  }

  private updateStatus(teleop: TeleopStatus | null, now: number): void {
    const fresh = teleop !== null && !this.c.world.stale(this.c.world.teleop, now);
    setClass(this.stages, "stale", !fresh);
    if (!teleop) {
      setText(this.state, "No teleop/status received.");
      return;
    }
    this.updateTurn(fresh ? teleop : null, now);
    const mine = teleop.client === this.c.commander.client;
    const others = teleop.client !== 0n && !mine ? " (another client)" : "";
    setText(
      this.state,
      `${kStates[teleop.state] ?? "unknown"}${others}${teleop.reason ? `: ${teleop.reason}` : ""}${fresh ? "" : " · old"}`,
    );
    setAttribute(this.state, "data-state", String(teleop.state));
    setShown(this.clamped, teleop.clamped !== 0);
    setText(this.clamped, teleop.clamped ? `Clamped by ${teleop.limited_by || "an unknown limit"}` : "");
    setText(
      this.numbers,
      `control receives ${teleop.input_rate.toFixed(0)} inputs/s · round trip ${(1e3 * teleop.latency).toFixed(0)} ms · tip delay ${(1e3 * teleop.tip_latency).toFixed(0)} ms · late ${teleop.late} · refused ${teleop.refused}`,
    );
    if (this.c.world.teleop.count === this.shown) return;
    this.shown = this.c.world.teleop.count;
    const rows = teleop.stages.map((stage) => {
      const ofRotations = stage.name.startsWith("rotation_");
      const speed = kVelocities.includes(stage.name.replace("rotation_", "")) ? "/s" : "";
      const unit = (ofRotations ? "deg" : "mm") + speed;
      const number = ofRotations ? degrees : millimetres;
      const digits = (v: Float64Array): string => `${[...v].map((x) => number(x, 1)).join("  ")} ${unit}`;
      const row = h(
        "li",
        { class: stage.active ? "active" : "" },
        h("b", {}, stage.name),
        h("span", {}, digits(stage.output)),
      );
      if (stage.limited_by) row.append(h("em", {}, stage.limited_by));
      return row;
    });
    this.stages.replaceChildren(...rows);
  }
}
