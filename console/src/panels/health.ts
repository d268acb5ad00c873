// SPDX-License-Identifier: Apache-2.0
/** System health: loops, watchdogs, services, and the load of the page itself. */
import { age, ageText } from "../state/age";
import { nameOf, valuesOf } from "../state/descriptions";
import { lackingProtections } from "../state/protections";
import type { Context, Panel } from "./context";
import { themeChoice } from "./theme";
import { card, h, setAttribute, setShown, setText } from "./dom";

const kLevels = ["ok", "warning", "error", "stale"];
const kSilent = 3; // level of a service that no longer reports
const kLost = 3000; // ms: services report once a second

/** A service, as it last reported. */
interface Service {
  row: HTMLElement;
  at: number;
  text: string;
  level: number;
}

export class Health implements Panel {
  readonly element: HTMLElement;
  private readonly loop = h("dl.facts");
  private readonly guards = h("dl.facts");
  private readonly services = h("ul.services", { id: "services" });
  /** Of the robot, not of a recording. */
  private readonly live = card("Services", this.services);
  private readonly lacking = h("p.lacking", { id: "lacking" });
  private readonly known = new Map<string, Service>();
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
    c.world.taps.diagnostics.push((array) => {
      for (const { name, level, message } of array.status) this.service(name, level, message);
    });
  }

  private service(name: string, level: number, message: string): void {
    let entry = this.known.get(name);
    if (!entry) {
      entry = { row: h("li", {}), at: 0, text: "", level };
      this.known.set(name, entry);
      this.services.append(entry.row);
    }
    if (entry.level === kSilent && entry.text !== "") this.c.messages.add("info", `${name} reports again`);
    entry.at = performance.now();
    entry.level = level;
    entry.text = `${name}: ${message}`;
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
    for (const [name, entry] of this.known) this.showService(name, entry, now);
  }

  private showService(name: string, entry: Service, now: number): void {
    const old = age(entry.at, now);
    if (old > kLost && entry.level !== kSilent) {
      // The end of the link, or of a process that says so, is an event of its own.
      if (this.c.link.state === "open" && !this.c.world.ends.has(name))
        this.c.messages.add("bad", `${name} no longer reports: last ${ageText(old)}`);
      entry.level = kSilent;
    }
    setAttribute(entry.row, "data-level", String(entry.level));
    const silent = entry.level === kSilent;
    setText(
      entry.row,
      silent ? `silent · last ${ageText(old)} · ${entry.text}` : `${kLevels[entry.level] ?? "unknown"} · ${entry.text}`,
    );
  }
}
