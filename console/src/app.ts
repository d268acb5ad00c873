// SPDX-License-Identifier: Apache-2.0
/** Composition of the page: panels, scene, link events, and one display loop. */
import type { Announcer } from "./panels/announcer";
import { Bars } from "./panels/bars";
import { Charts } from "./panels/charts";
import type { Context, Panel } from "./panels/context";
import { h } from "./panels/dom";
import { Hands } from "./panels/hands";
import { Header } from "./panels/header";
import { Health } from "./panels/health";
import { Hud } from "./panels/hud";
import { LogPanel } from "./panels/log";
import { Notices } from "./panels/notices";
import { MethodPanel } from "./panels/method";
import { Operate } from "./panels/operate";
import { Recording } from "./panels/recording";
import { Replay } from "./panels/replay";
import type { Shown } from "./panels/replay";
import { Run } from "./panels/run";
import { Span } from "./panels/span";
import { StopKey } from "./panels/stop";
import { tabs } from "./panels/tabs";
import { askForToken } from "./panels/token";
import { View } from "./scene/view";
import { Clock } from "./state/clock";
import { Commander } from "./state/commander";
import { Events } from "./state/events";
import { keepAcknowledged } from "./state/log";
import { Orders } from "./state/orders";
import { Past } from "./state/past";
import type { Robot } from "./state/robot";
import { fetchBytes, fetchJson, TokenRequired } from "./state/robot";
import { onPhone } from "./state/screen";
import { ServerClock } from "./state/server";
import { World } from "./state/world";
import { Devices } from "./teleop/devices";
import { Pilot } from "./teleop/pilot";
import { Drawing } from "./scene/drawing";
import { Link } from "./wire/link";

/** Display period of the panels, ms: values that change faster are unreadable. */
const kShow = 50;

export class App {
  private readonly c: Context;
  private readonly panels: Panel[];
  private readonly stop: StopKey;
  private readonly view: View;
  private readonly drawing: Drawing;
  private readonly hud: Hud;
  private readonly health: Health;
  private readonly replay: Replay;
  private readonly past: Past;
  private ended = false;
  /** The link was open: its loss is news. */
  private linkedBefore = false;
  private frames = 0;
  private shownAt = 0;
  private measuredAt = performance.now();

  constructor(
    private readonly root: HTMLElement,
    robot: Robot,
    private readonly announcer: Announcer,
    url: string,
  ) {
    const messages = new LogPanel(announcer);
    const link = new Link(url, robot.session, {
      again: () => this.again(),
      state: (state, reason) => this.linked(state, reason),
      status: (level, message) => messages.add(level > 0 ? "bad" : "info", `Server: ${message}`),
    });
    const commander = new Commander(robot, link, (why) => {
      messages.add("alarm", `Control lease lost: ${why}`);
      this.c.pilot.gate.allow("lease", false);
      this.c.pilot.arm(false);
    });
    const server = new ServerClock();
    const world = new World(robot, link, server);
    const pilot = new Pilot(robot, world, link, commander, (held) => place.classList.toggle("held", held));
    const orders = new Orders((level, text) => messages.add(level, text));
    this.c = { robot, world, replayed: "", link, commander, pilot, messages, notices: new Notices(), orders };
    /** Of the robot, whatever is shown. */
    const live = { ...this.c };
    const ask = async (): Promise<ArrayBuffer> => {
      await server.known;
      return fetchBytes("/api/events", "");
    };
    this.past = new Past(
      ask,
      (sample) => link.decode(sample),
      (past) => {
        messages.log.past = past;
        if (!past) messages.showPast();
      },
    );
    keepAcknowledged(messages.log, robot.session);
    const events = new Events(robot, link, commander, messages.log, (time) => server.when(time), this.past);
    world.taps.diagnostics.push((array, time) => events.ended(array, time));
    world.taps.hal.push((status, time) => events.receivedHal(status, time));
    world.taps.summary.push((summary, time) => events.ran(summary, time));
    world.taps.status.push((status, time) => {
      events.received(status, time);
      commander.received(status);
      orders.look(performance.now());
    });

    const place = h("div.view", {
      tabindex: "0",
      role: "application",
      id: "view",
      "aria-label":
        "The arms in 3D. While teleoperation is on, hold arrow keys, Page Up or Page Down to move the driven tip; letting go stops it.",
    });
    this.view = new View(place, robot);
    this.drawing = new Drawing(this.c, this.view);
    this.stop = new StopKey(live, () => {
      pilot.gate.release("stop was pressed");
      this.replay.close("a stop was sent");
    });
    new Devices(this.view, pilot, (by) => this.stop.press(by));
    this.hud = new Hud(this.c, this.view, (times) => this.drawing.setThickness(times));
    const charts = new Charts(live);
    this.health = new Health(this.c, charts.loop);
    const clock = new Clock(robot, link, (milliseconds) => charts.setRoundTrip(milliseconds));
    const operate = new Operate(this.c);
    const run = new Run(this.c, this.view);
    const footer = h("footer");
    const show = (shown: Shown | null): void => {
      this.c.world = shown?.world ?? world;
      this.c.replayed = shown?.file ?? "";
      root.classList.toggle("replaying", shown !== null);
      footer.replaceChildren(bars.element, (shown?.charts ?? charts).element);
      this.drawing.restart();
    };
    this.replay = new Replay(this.c, show, () => this.drawing.restart());
    messages.log.urgent = (what) => this.replay.close(what);
    const recording = new Recording(this.c, this.replay.list);
    const method = new MethodPanel(this.c);
    const hands = robot.capabilities.tips ? new Hands(this.c) : null;
    const header = new Header(this.c);
    const span = new Span(this.c, this.view);
    this.hud.figures.append(span.element);
    const bars = new Bars(this.c, span);
    place.append(this.hud.element);
    const phone = onPhone();
    root.classList.toggle("phone", phone);
    const commands: [string, HTMLElement][] = [
      ["Operate", h("div", {}, operate.element, run.element, recording.element, run.result)],
      ["Method", method.element],
      ...(hands ? [["Teleoperate", hands.element] as [string, HTMLElement]] : []),
    ];
    const side = h(
      "aside.side",
      {},
      tabs([...(phone ? [] : commands), ["Health", this.health.element], ["Log", messages.element]]),
      messages.newest,
    );
    root.replaceChildren(
      header.element,
      this.stop.element,
      this.replay.element,
      h("main", {}, h("div.stage", {}, place, this.hud.legend), run.controls, side),
      footer,
    );
    footer.append(bars.element, charts.element);
    this.panels = [
      header,
      operate,
      run,
      recording,
      this.replay,
      method,
      ...(hands ? [hands] : []),
      bars,
      span,
      charts,
      this.hud,
      this.health,
      messages,
    ];
    for (const warning of robot.warnings) messages.add("bad", warning);
    clock.start();
    server.start();
    link.open();
    const frame = (): void => {
      if (this.ended) return;
      this.frame();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  /** Whether the server still serves the robot of this page: its session; null if not, and the page is over. */
  private async again(): Promise<string | null> {
    const { robot } = this.c;
    const found = await fetchJson<Robot>("/api/robot").catch((error: unknown) => {
      if (error instanceof TokenRequired) return error;
      throw error;
    });
    if (found instanceof TokenRequired) {
      this.announcer.alarm(found.message);
      return this.end(askForToken(found.message));
    }
    if (found.fingerprint === robot.fingerprint && found.prefix === robot.prefix && found.role === robot.role)
      return found.session;
    const another = `Another system answers here now: ${found.robot} · ${found.deployment}.`;
    this.announcer.alarm(another);
    return this.end(
      h(
        "div.boot",
        { id: "exchanged" },
        h("p", {}, another),
        h("p", {}, `This page was for ${robot.robot} · ${robot.deployment}. Nothing of it is shown or sent any more.`),
        h("button", { type: "button", id: "reload", onclick: () => window.location.reload() }, "Load its page"),
      ),
    );
  }
  /** Shows this instead of the robot. */
  private end(reason: HTMLElement): null {
    this.ended = true;
    this.root.replaceChildren(reason);
    return null;
  }

  private linked(state: string, reason: string): void {
    if (!this.c) return; // during construction
    if (state === "closed") {
      this.c.pilot.gate.allow("link", false);
      this.c.pilot.arm(false);
      this.c.commander.disconnected();
      this.c.orders.abandon("the connection was lost");
      if (this.linkedBefore) this.c.messages.add("alarm", `The link is down: ${reason}`);
      this.linkedBefore = false;
    }
    if (state === "open") {
      this.linkedBefore = true;
      this.past.opened().catch((error: unknown) => this.c.messages.add("bad", `Earlier events: ${String(error)}`));
      this.c.messages.add("info", "Connected to the server; no motion until a client takes control");
    }
  }

  private frame(): void {
    const now = performance.now();
    this.frames += 1;
    this.stop.update(now);
    this.replay.tick(now);
    this.drawing.update(now);
    if (now - this.shownAt >= kShow) {
      this.shownAt = now;
      for (const panel of this.panels) panel.update(now);
    }
    this.view.draw(now);
    const seconds = (now - this.measuredAt) / 1000;
    if (seconds < 1) return;
    this.hud.setRate(this.frames / seconds, this.view.drawn / seconds);
    this.health.setTraffic(this.c.link.takeBytes() / seconds);
    this.frames = 0;
    this.view.drawn = 0;
    this.measuredAt = now;
  }
}
