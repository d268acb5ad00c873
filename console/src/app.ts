// SPDX-License-Identifier: Apache-2.0
/** Composition of the page: panels, scene, link events, and one display loop. */
import { Display } from "./display";
import type { Announcer } from "./panels/announcer";
import type { Context } from "./panels/context";
import { Currency } from "./panels/currency";
import { h } from "./panels/dom";
import { LogPanel } from "./panels/log";
import { Notices } from "./panels/notices";
import { Recording } from "./panels/recording";
import { Replay } from "./panels/replay";
import type { Shown } from "./panels/replay";
import { StopKey } from "./panels/stop";
import { askForToken } from "./panels/token";
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
import { Link } from "./wire/link";

/** Display period of the panels, ms: values that change faster are unreadable. */
const kShow = 50;

export class App {
  readonly stop: StopKey;
  readonly replay: Replay;
  readonly recording: Recording;
  /** Of the robot, whatever is shown. */
  private readonly c: Context;
  private readonly robot: Display;
  /** What is shown: the robot, or a recording. */
  private display: Display;
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
    const pilot = new Pilot(robot, world, link, commander, (held) =>
      this.robot.view.place.classList.toggle("held", held),
    );
    const orders = new Orders((level, text) => messages.add(level, text));
    const notices = new Notices();
    const current = new Currency(robot, world, link, messages);
    this.c = { robot, world, current, replayed: "", link, commander, pilot, messages, notices, orders };
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
    keepAcknowledged(messages.log, robot.fingerprint);
    const events = new Events(robot, link, commander, messages.log, (time) => server.when(time), this.past);
    world.taps.stop.push((stop, time) => events.requested(stop, time));
    world.taps.diagnostics.push((array, time) => events.ended(array, time));
    world.taps.hal.push((status, time) => events.receivedHal(status, time));
    world.taps.summary.push((summary, time) => events.ran(summary, time));
    world.taps.status.push((status, time) => {
      events.received(status, time);
      commander.received(status);
      orders.look(performance.now());
    });

    this.stop = new StopKey(this.c, () => {
      pilot.gate.release("stop was pressed");
      this.replay.close("a stop was sent");
    });
    this.replay = new Replay(
      this.c,
      (shown) => this.show(shown),
      () => this.display.restart(),
    );
    messages.log.urgent = (what) => this.replay.close(what);
    this.recording = new Recording(this.c, this.replay.list);
    this.robot = this.display = new Display(this.c, this);
    new Devices(this.robot.view, pilot, (by) => this.stop.press(by));
    const clock = new Clock(robot, link, (milliseconds) => this.robot.charts.setRoundTrip(milliseconds));
    root.classList.toggle("phone", onPhone());
    this.display.show(root);
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

  /** @param shown  a recording; null: the robot */
  private show(shown: Shown | null): void {
    if (this.display !== this.robot) this.display.close();
    this.display = shown ? new Display(shown.c, this, shown.present) : this.robot;
    this.root.classList.toggle("replaying", shown !== null);
    this.display.show(this.root);
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
    const panels = now - this.shownAt >= kShow;
    if (panels) this.c.current.update(now);
    this.display.update(now, panels);
    if (panels) {
      this.shownAt = now;
      for (const panel of [this.recording, this.replay, this.c.messages]) panel.update(now);
    }
    const seconds = (now - this.measuredAt) / 1000;
    if (seconds < 1) return;
    this.display.setRates(this.frames / seconds, seconds, this.c.link.takeBytes() / seconds);
    this.frames = 0;
    this.measuredAt = now;
  }
}
