// SPDX-License-Identifier: Apache-2.0
/** Strip charts of the last 30 s: what the arms do beside the bars, and what the loop does in the Health panel. */
import type { ControlStatus } from "../wire/messages";
import { forceOf } from "../state/force";
import { followedTasks, scaleOf } from "../state/taskerrors";
import { armTrace, errorTraces, kNoTrace, plain, taskTraces } from "../state/traces";
import { shortName } from "../state/descriptions";
import type { Context, Panel } from "./context";
import { h } from "./dom";
import { digits, StripChart } from "./strip";
import type { Strip } from "./strip";
import { whenThemeChanges } from "./theme";

const kRedraw = 200; // ms
const kTasks = 4;
const kRoundTripGap = 2.5; // s: one is measured every 0.5 s
const kNoTasks = Array.from({ length: kTasks }, () => kNoTrace);

const tasks = (status: ControlStatus, values: Float64Array, factor: (k: number) => number): (number | null)[] =>
  [...values].map((value, k) => (k < status.task_count ? factor(k) * value : null));
/** Metres as millimetres; below 0, bodies overlap. */
const distance = (mm: number): string => (mm < 0 ? `overlap of ${digits(-mm)}` : digits(mm));

export class Charts implements Panel {
  readonly element = h("section.charts", { "aria-label": "Charts of the last 30 seconds" });
  /** Of the loop and the link. */
  readonly loop = h("div.charts");
  private readonly all: StripChart[] = [];
  private readonly error: StripChart;
  private readonly scale: StripChart;
  private readonly solver: StripChart;
  private readonly jitter: StripChart;
  private readonly roundTrip: StripChart;
  private last: { sequence: bigint; stamp: bigint } | null = null;
  private drawnAt = 0;
  private readonly forgetTheme: () => void;

  /** @param present  newest time on the axes, s; absent: they run on from the newest sample */
  constructor(
    private readonly c: Context,
    private readonly present?: () => number,
  ) {
    const { element, loop } = this;
    const text = digits;
    this.error = this.make(element, { title: "task error, mm or °", traces: [...kNoTasks], least: 0, span: 0.1, text });
    this.scale = this.make(element, { title: "task scale, 0 to 1", traces: [...kNoTasks], least: 0, most: 1.05, text });
    if (c.robot.capabilities.computation) this.makeClearance();
    if (c.robot.capabilities.common_path) this.makeForces();
    const solver = [plain("solve", 0), plain("cycle", 1)];
    this.solver = this.make(element, { title: "time of a cycle, ms", traces: solver, least: 0, span: 0.1, text });
    const jitter = [plain("mean", 0), plain("worst", 1)];
    this.jitter = this.make(loop, { title: "deviation of the period, ms", traces: jitter, least: 0, span: 0.1, text });
    const there = [plain("page to control and back", 0)];
    const trip = { title: "round trip, ms", traces: there, least: 0, span: 5, text };
    this.roundTrip = this.make(loop, trip, kRoundTripGap);
    c.world.taps.status.push((status, time) => this.take(status, time));
    this.forgetTheme = whenThemeChanges(() => this.all.forEach((chart) => chart.recolour()));
  }

  /** They are not shown any more. */
  close(): void {
    this.forgetTheme();
    for (const chart of this.all) chart.close();
  }

  private make(place: HTMLElement, strip: Strip, gap = this.c.world.late / 1000): StripChart {
    const chart = new StripChart(strip, gap, (text) => this.c.messages.announcer.event(text), this.present);
    place.append(chart.element);
    this.all.push(chart);
    return chart;
  }
  private makeClearance(): void {
    const strip = {
      title: "least distance, mm",
      traces: [plain("distance (−: overlap)", 0)],
      least: 0,
      span: 1,
      text: distance,
    };
    const chart = this.make(this.element, strip);
    this.c.world.taps.clearance.push(({ bodies }, time) => {
      const distances = bodies.map((body) => 1e3 * body.distance);
      chart.add(time, [distances.length > 0 ? Math.min(...distances) : null]);
    });
  }

  private makeForces(): void {
    const { arms } = this.c.robot;
    const traces = arms.map(({ name }, k) => armTrace(`on tip ${shortName(name)}`, k));
    const chart = this.make(this.element, { title: "contact force, mN", traces, least: 0, span: 0.01, text: digits });
    this.c.world.taps.shape.push((_, time) => {
      const forces = arms.map((_, k) => forceOf(this.c.world.shape(k)));
      chart.add(
        time,
        forces.map((force) => (force ? 1e3 * Math.hypot(...force) : null)),
      );
    });
  }

  setRoundTrip(milliseconds: number): void {
    const { status } = this.c.world;
    if (status.at >= 0) this.roundTrip.add(status.time + (performance.now() - status.at), [milliseconds]);
  }

  /** Deviation of the cycles since the last sample from the period, ms, by control's clock. */
  private deviation(status: ControlStatus): number | null {
    const cycles = this.last ? Number(status.sequence - this.last.sequence) : 0;
    const off =
      cycles > 0 ? Math.abs(Number(status.stamp - this.last!.stamp) / cycles / 1e6 - 1e3 * status.period) : null;
    this.last = { sequence: status.sequence, stamp: status.stamp };
    return off;
  }

  private take(status: ControlStatus, time: number): void {
    const plan = this.c.world.followed(status);
    if (status.task_count > 0) {
      const arms = this.c.robot.arms.map(({ name }) => name);
      errorTraces(status.task_count, plan, arms).forEach((trace, k) => this.error.rename(k, trace));
      taskTraces(status.task_count, plan, arms).forEach((trace, k) => this.scale.rename(k, trace));
    }
    const followed = followedTasks(status.task_count, plan);
    this.error.add(
      time,
      tasks(status, status.task_error, (k) => scaleOf(followed[k]).factor),
    );
    this.scale.add(
      time,
      tasks(status, status.task_scale, () => 1),
    );
    this.solver.add(time, [1e3 * status.solve_time, 1e3 * status.cycle_time]);
    this.jitter.add(time, [this.deviation(status), 1e3 * status.jitter_max]);
  }

  update(now: number): void {
    if (now - this.drawnAt < kRedraw) return;
    this.drawnAt = now;
    for (const chart of this.all) chart.draw();
  }
}
