// SPDX-License-Identifier: Apache-2.0
/** Overlay of the scene: cameras, legend, distances, and a curtain when data is stale. */
import type { Vector3 } from "three";

import { kCloseBelow } from "../scene/closeness";
import { kAxisColors, kClose, kForbidden, kGoal, kNear, kWorkspace } from "../scene/colors";
import { kThickness } from "../scene/drawing";
import { kUnit } from "../scene/forces";
import type { Insets } from "../scene/fit";
import type { Preset, View } from "../scene/view";
import { kPresets } from "../scene/view";
import { age, ageText } from "../state/age";
import { shortName } from "../state/descriptions";
import { forceOf, newtons } from "../state/force";
import { describeRelative } from "../state/relative";
import { describeTurn, turnOf } from "../state/turning";
import { kBall } from "../teleop/ring";
import type { TeleopStatus } from "../wire/messages";
import { port } from "../wire/messages";
import { Choice } from "./choice";
import type { Context, Panel } from "./context";
import { action, h, setAttribute, setClass, setShown, setText } from "./dom";
import { millimetres } from "../state/numbers";

const kMostInset = 0.3; // of the height of the scene

export class Hud implements Panel {
  readonly element: HTMLElement;
  /** Below the scene, where it covers nothing. */
  readonly legend: HTMLElement;
  /** In a corner of the scene. */
  readonly figures: HTMLElement;
  private readonly near = h("output.figure", { id: "clearance" });
  private readonly relative = h("output.figure", { id: "relative" });
  private readonly forces = h("output.figure", { id: "forces", hidden: true });
  private readonly turn = h("output.figure", { id: "turn", hidden: true });
  private readonly curtain = h("div.curtain", { hidden: true, id: "curtain" });
  private readonly rate = h("output.rate", { id: "fps" });
  /** Handle at which the pointer grabs the driven tip. */
  private readonly handle = h("div.handle", { id: "handle", hidden: true, "aria-hidden": "true" });
  /** Ring of the ball by which the pointer turns it. */
  private readonly ring = h("div.handle.ring", { id: "ring", hidden: true, "aria-hidden": "true" });
  private readonly names: string[];
  private readonly cameras: HTMLElement;

  constructor(
    private readonly c: Context,
    private readonly view: View,
    private readonly thickness: (times: number) => void,
  ) {
    this.names = c.robot.arms.map((arm) => shortName(arm.name));
    const cameras = kPresets.map((preset: Preset, k) => {
      const button = action(preset, `Camera: ${preset}`, () => view.look(preset), "small");
      button.dataset["camera"] = String(k + 1);
      return button;
    });
    const thick = new Choice(
      "thickness",
      "Drawn thickness of the tubes",
      [1, 2, 4].map((times) => ({ value: String(times), text: times === 1 ? "true thickness" : `${times}×` })),
      () => this.thickness(Number(thick.value)),
    );
    thick.value = String(kThickness);
    const trail = action(
      "clear trail",
      "Clear the trails of the tips",
      () => {
        view.arms.forEach((arm) => arm.clearTrail());
        view.touch();
      },
      "small",
    );
    this.legend = this.makeLegend();
    this.figures = h("div.figures", {}, this.near, this.relative, this.forces, this.turn);
    this.cameras = h("div.cameras", { role: "toolbar", "aria-label": "Cameras" }, ...cameras, thick.element, trail);
    view.insets = () => this.insets();
    this.ring.style.setProperty("--radius", `${kBall}px`);
    this.element = h(
      "div.hud",
      {},
      this.cameras,
      c.notices.element,
      this.figures,
      this.rate,
      this.handle,
      this.ring,
      this.curtain,
    );
  }

  private makeLegend(): HTMLElement {
    const swatch = (color: string, text: string, kind = ""): HTMLElement => {
      const mark = h("i", { class: kind });
      mark.style.borderColor = color;
      return h("li", {}, mark, text);
    };
    const { arms, object, regions, capabilities } = this.c.robot;
    const forbidden = regions.forbidden.map(({ name }) => name).join(", ");
    return h(
      "ul.legend",
      { "aria-label": "Legend of the colours", id: "legend" },
      ...arms.flatMap(({ tubes }, k) => tubes.map((tube) => swatch(tube.color, `${this.names[k]} ${tube.name}`))),
      object && swatch(object.color, "grasped object"),
      ...arms.map(({ color }, k) => swatch(color, `trail of tip ${this.names[k]}`, "thin")),
      h("li", {}, "frames of the tips: ", ...this.axes()),
      capabilities.tips ? h("li", {}, "dashed, with balls: commanded") : null,
      swatch(kGoal, "target, planned path", "dashed"),
      swatch("#ffffff", "relative position", "thin"),
      capabilities.common_path ? h("li", {}, "arrows at the tips: contact forces") : null,
      capabilities.computation ? swatch(kNear, "nearest bodies", "thin") : null,
      capabilities.computation ? swatch(kClose, `closer than ${millimetres(kCloseBelow, 0)} mm`) : null,
      forbidden === "" ? null : swatch(kForbidden, `forbidden to targets: ${forbidden}`),
      regions.workspace ? swatch(kWorkspace, "workspace of targets", "thin") : null,
    );
  }
  private axes(): HTMLElement[] {
    return kAxisColors.map((color, k) => {
      const name = h("b", {}, `${"xyz"[k]} `);
      name.style.color = color;
      return name;
    });
  }

  setRate(frames: number, scene: number): void {
    setText(
      this.rate,
      `${frames.toFixed(0)} frames/s · scene ${scene.toFixed(0)}/s${this.view.software ? " · drawn in software" : ""}`,
    );
    this.rate.dataset["frames"] = frames.toFixed(1);
  }

  update(now: number): void {
    const { world, link } = this.c;
    const live = world.live(now);
    setClass(this.element.parentElement ?? this.element, "past", !live);
    setShown(this.curtain, !live);
    if (!live && this.c.replayed !== "")
      setText(this.curtain, "REPLAY. At this time of the recording there is no data from control and drives.");
    else if (!live) {
      const old = ageText(world.status.at < 0 ? age(link.receivedAt, now) : world.age(world.status, now));
      const what =
        link.state !== "open"
          ? [`No connection to the server: ${link.ended || "connecting"}`, ...world.services.gone(now)].join(". ")
          : world.status.at < 0
            ? "Waiting for control"
            : world.heldBack(now)
              ? "The link holds messages back, or the clocks are not compared yet"
              : ["No messages from the robot's processes", ...world.services.gone(now)].join(". ");
      setText(this.curtain, `${what}. Last data: ${old}. Commands are disabled.`);
    }
    const bodies = world.clearances()?.bodies ?? [];
    const nearest = bodies.reduce<(typeof bodies)[number] | null>(
      (best, body) => (!best || body.distance < best.distance ? body : best),
      null,
    );
    const other = nearest ? (nearest.other_arm === port ? "port" : `arm ${this.names[nearest.other_arm] ?? "?"}`) : "";
    setText(
      this.near,
      !nearest
        ? "distance between arms: not known"
        : nearest.distance < 0
          ? `arm ${this.names[nearest.arm] ?? "?"} and ${other} overlap by ${millimetres(-nearest.distance)} mm`
          : `arm ${this.names[nearest.arm] ?? "?"} to ${other}: ${millimetres(nearest.distance)} mm`,
    );
    setShown(this.near, this.c.robot.capabilities.computation);
    setClass(this.near, "danger", nearest !== null && nearest.distance < 0.001);
    setClass(this.near, "stale", world.stale(world.clearance, now));
    setClass(this.relative, "stale", !live);
    this.updateRelative();
    this.updateForces(live);
    const turn = live ? turnOf(world.teleop.value<TeleopStatus>()) : null;
    setShown(this.turn, turn !== null);
    if (turn) setText(this.turn, describeTurn(turn, this.names[turn.arm]));
    this.updateHandle();
    const screen = (points: readonly Vector3[]): string =>
      points
        .map((point) => this.view.toScreen(point))
        .map(({ x, y }) => `${x.toFixed(0)},${y.toFixed(0)}`)
        .join(" ");
    const { arms, place } = this.view;
    setAttribute(place, "data-tips", screen(arms.filter((arm) => arm.hasTip).map((arm) => arm.tip)));
    setAttribute(place, "data-letters", screen(arms.map((arm) => arm.letterAt)));
  }

  /** The edges of the scene that this covers. */
  private insets(): Insets {
    const scene = this.view.place.getBoundingClientRect();
    const insets = { left: 0, right: 0, top: 0, bottom: 0 };
    for (const part of [this.cameras, this.figures, this.rate]) {
      const box = part.getBoundingClientRect();
      const [above, below] = [box.bottom - scene.top, scene.bottom - box.top];
      if (box.height === 0) continue;
      if (above < below) insets.top = Math.max(insets.top, above / scene.height);
      else insets.bottom = Math.max(insets.bottom, below / scene.height);
    }
    return { ...insets, top: Math.min(insets.top, kMostInset), bottom: Math.min(insets.bottom, kMostInset) };
  }

  private updateForces(live: boolean): void {
    const known = this.names.flatMap((name, k) => {
      const force = forceOf(this.c.world.shape(k));
      return force ? [`tip ${name} ${newtons(Math.hypot(...force))}`] : [];
    });
    setShown(this.forces, known.length > 0);
    const { unit } = this.view.forces;
    const scale = unit > 0 ? ` · arrow of ${millimetres(kUnit, 0)} mm: ${newtons(unit)}` : "";
    setText(this.forces, `contact force on ${known.join(", ")} (by the model)${scale}`);
    setClass(this.forces, "stale", !live);
  }

  private updateHandle(): void {
    const { pilot } = this.c;
    const tip = this.view.arms[pilot.choice.arm];
    const shown = pilot.armed && tip?.hasTip === true;
    setShown(this.handle, shown);
    setShown(this.ring, shown && pilot.turns);
    if (!shown) return;
    const { x, y } = this.view.toScreen(tip.tip);
    for (const part of [this.handle, this.ring])
      part.style.transform = `translate(${x.toFixed(0)}px, ${y.toFixed(0)}px)`;
    setClass(this.handle, "held", pilot.gate.held && pilot.gate.source !== "ring");
    setClass(this.ring, "held", pilot.gate.source === "ring");
  }

  private updateRelative(): void {
    const { world, robot } = this.c;
    setShown(this.relative, robot.arms.length > 1);
    const text = describeRelative(
      world.plan(),
      this.view.arms.map((arm) => (arm.hasTip ? arm.tip.toArray() : null)),
      robot.arms.map(({ name }) => name),
    );
    if (text !== "") setText(this.relative, text);
  }
}
