// SPDX-License-Identifier: Apache-2.0
/** System health: loops, watchdogs, services, and the load of the page itself. */
import { nameOf, valuesOf } from "../state/descriptions";
import { lackingProtections } from "../state/protections";
import type { Context, Panel } from "./context";
import { themeChoice } from "./theme";
import { card, h, setAttribute, setShown, setText } from "./dom";

export class Health implements Panel {
  readonly element: HTMLElement;
  private readonly loop = h("dl.facts");
  private readonly guards = h("dl.facts");
  private readonly services = h("ul.services", { id: "services" });
  /** Of the robot, not of a recording. */
  private readonly live = card("Services", this.services);
  private readonly lacking = h("p.lacking", { id: "lacking" });
  private readonly rows = new Map<string, HTMLElement>();
  private readonly facts = new Map<string, HTMLElement>();
  private kilobytes = 0;

  /** @param charts  of the loop */
  constructor(
    private readonly c: Context,
    charts: HTMLElement,
  ) {
    this.element = h(
      "div",
      {},
      card("Loop", this.loop, charts),
      card("Guards of the drives", this.guards),
      card("Protections that drives lack", this.lacking),
      this.live,
      card("This page", h("div.line", {}, h("span", {}, "colours"), themeChoice())),
    );
  }

  setTraffic(bytesPerSecond: number): void {
    this.kilobytes = bytesPerSecond / 1024;
  }

  private fact(list: HTMLElement, name: string, text: string): void {
    const key = `${list === this.loop ? "loop" : "guard"} ${name}`;
    let element = this.facts.get(key);
    if (!element) {
      element = h("dd");
      list.append(h("dt", {}, name), element);
      this.facts.set(key, element);
    }
    setText(element, text);
  }

  update(now: number): void {
    const { world } = this.c;
    const status = world.controlStatus();
    const hal = world.halStatus();
    setShown(this.live, this.c.replayed === "");
    if (status) {
      this.fact(this.loop, "period", `${(1e3 * status.period).toFixed(2)} ms`);
      this.fact(this.loop, "cycles", `${status.cycles}, ${status.overruns} overruns`);
      this.fact(this.loop, "latest wake-up", `${(1e3 * status.jitter_max).toFixed(3)} ms late`);
      this.fact(this.loop, "longest cycle", `${(1e3 * status.cycle_time_max).toFixed(3)} ms`);
      this.fact(
        this.loop,
        "model",
        `${nameOf("Model", status.model)}, feedback ${nameOf("Feedback", status.feedback)}`,
      );
      this.fact(this.loop, "snaps", [...status.snaps.slice(0, status.arm_count)].join(" / "));
    }
    if (status && hal) {
      const arrived = {
        commands: hal.command_success,
        states: status.state_success,
        references: status.reference_success,
      };
      const buses = [...hal.bus_success.slice(0, hal.bus_count)].map((share, k) => [`bus ${k + 1}`, share] as const);
      this.fact(
        this.loop,
        "arrived of the last 100",
        [...Object.entries(arrived), ...buses].map(([what, share]) => `${what} ${Math.round(100 * share)}`).join(", "),
      );
    }
    this.fact(this.loop, "this page receives", `${this.kilobytes.toFixed(0)} kB/s`);
    if (hal) {
      this.fact(this.loop, "emergency stop", nameOf("EmergencyStop", hal.emergency_stop));
      const lacking = lackingProtections(hal, this.c.robot.arms).map(({ who, what }) => `${who}: ${what.join("; ")}`);
      setText(this.lacking, lacking.join("\n") || "none");
      valuesOf("Guard").forEach(({ name, value: k }) => {
        const count = hal.guard_count[k] ?? 0n;
        this.fact(
          this.guards,
          name,
          count === 0n ? "0" : `${count}, at most ${Number((hal.guard_largest[k] ?? 0).toPrecision(3))}`,
        );
      });
    }
    this.showServices(now);
  }

  private showServices(now: number): void {
    const { services } = this.c.world;
    for (const { name, silent, age } of this.c.replayed === "" ? services.changes(now) : []) {
      if (!silent) this.c.messages.add("info", `${name} reports again`);
      // The end of the link is an event of its own.
      else if (this.c.link.state === "open")
        this.c.messages.add("bad", `${name} no longer reports: its last report is ${age}`);
    }
    for (const { name, condition, message, age } of services.all(now)) {
      let row = this.rows.get(name);
      if (!row) {
        row = h("li", {});
        this.rows.set(name, row);
        this.services.append(row);
      }
      setAttribute(row, "data-condition", condition);
      const last = condition === "silent" || condition === "ended" ? ` · ${age}` : "";
      setText(row, `${condition}${last} · ${name}: ${message}`);
    }
  }
}
