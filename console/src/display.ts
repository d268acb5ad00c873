// SPDX-License-Identifier: Apache-2.0
/** All that shows one system, the robot or a recording, by its own description: scene, bars, charts, states and commands. */
import { Bars } from "./panels/bars";
import { Charts } from "./panels/charts";
import type { Context, Panel } from "./panels/context";
import { h } from "./panels/dom";
import { Hands } from "./panels/hands";
import { Header } from "./panels/header";
import { Health } from "./panels/health";
import { Hud } from "./panels/hud";
import { MethodPanel } from "./panels/method";
import { Operate } from "./panels/operate";
import type { Recording } from "./panels/recording";
import type { Replay } from "./panels/replay";
import { Run } from "./panels/run";
import { Span } from "./panels/span";
import type { StopKey } from "./panels/stop";
import { tabs } from "./panels/tabs";
import { Drawing } from "./scene/drawing";
import { View } from "./scene/view";
import { onPhone } from "./state/screen";

/** Parts of the page that every display has, one after the other. */
export interface Shared {
  stop: StopKey;
  replay: Replay;
  recording: Recording;
}

export class Display {
  readonly view: View;
  readonly charts: Charts;
  readonly health: Health;
  private readonly drawing: Drawing;
  private readonly hud: Hud;
  private readonly panels: Panel[];
  private readonly parts: HTMLElement[];
  private readonly record = h("div");
  private readonly log = h("div");
  private readonly side = h("aside.side");

  /** @param present  newest time in the charts, s; absent: they run on from the newest sample */
  constructor(
    private readonly c: Context,
    private readonly shared: Shared,
    present?: () => number,
  ) {
    const place = h("div.view", {
      tabindex: "0",
      role: "application",
      id: "view",
      "aria-label":
        "The arms in 3D. While teleoperation is on, hold arrow keys, Page Up or Page Down to move the driven tip, and I, K, J, L, U or O to turn it where orientations are followed; letting go stops it.",
    });
    this.view = new View(place, c.robot);
    this.drawing = new Drawing(c, this.view);
    this.hud = new Hud(c, this.view, (times) => this.drawing.setThickness(times));
    this.charts = new Charts(c, present);
    this.health = new Health(c, this.charts.loop);
    const operate = new Operate(c);
    const run = new Run(c, this.view);
    const method = new MethodPanel(c);
    const hands = c.robot.capabilities.tips ? [new Hands(c)] : [];
    const header = new Header(c);
    const span = new Span(c, this.view);
    this.hud.figures.append(span.element);
    const bars = new Bars(c, span);
    place.append(this.hud.element);
    const commands: [string, HTMLElement][] = [
      ["Operate", h("div", {}, operate.element, run.element, this.record, run.result)],
      ["Method", method.element],
      ...hands.map(({ element }): [string, HTMLElement] => ["Teleoperate", element]),
    ];
    this.side.append(tabs([...(onPhone() ? [] : commands), ["Health", this.health.element], ["Log", this.log]]));
    const main = h("main", {}, h("div.stage", {}, place, this.hud.legend), run.controls, this.side);
    const footer = h(c.robot.arms.length > 2 ? "footer.many" : "footer", {}, bars.element, this.charts.element);
    this.parts = [header.element, shared.stop.element, shared.replay.element, main, footer];
    this.panels = [header, operate, run, method, ...hands, bars, span, this.charts, this.hud, this.health];
  }

  /** Is what the page shows from now on. */
  show(root: HTMLElement): void {
    const { messages } = this.c;
    this.record.replaceChildren(this.shared.recording.element);
    this.log.replaceChildren(messages.element);
    this.side.append(messages.newest);
    root.replaceChildren(...this.parts);
    this.restart();
  }
  /** What was drawn before does not lead to what comes. */
  restart(): void {
    this.drawing.restart();
  }
  /** It is not shown any more. */
  close(): void {
    this.charts.close();
    this.view.close();
  }

  /** Called for each image. @param panels  whether they are due */
  update(now: number, panels: boolean): void {
    this.drawing.update(now);
    if (panels) for (const panel of this.panels) panel.update(now);
    this.view.draw(now);
  }
  /** Images of the page and bytes that it receives, per second. */
  setRates(frames: number, seconds: number, bytes: number): void {
    this.hud.setRate(frames, this.view.drawn / seconds);
    this.health.setTraffic(bytes);
    this.view.drawn = 0;
  }
}
