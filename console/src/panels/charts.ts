// SPDX-License-Identifier: Apache-2.0
/** Strip charts of the last 30 s. */
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";

import type { ControlStatus } from "../wire/messages";
import type { Context, Panel } from "./context";
import { h } from "./dom";

const kWindow = 30; // s
const kRedraw = 200; // ms
const kMost = 2048; // samples: in a loop of 1 kHz, only the latest of each frame is drawn
const kInk = "#8fa1b3";
const kLines = ["#56b4e9", "#e69f00", "#1fb88d", "#cc79a7"];
const kDashes = [[], [6, 3], [2, 2], [8, 2, 2, 2]];

interface Chart {
  title: string;
  series: string[];
  /** Value of the lower end of the axis, without errors. */
  least: number;
  /** Minimum value of the upper end. */
  span?: number;
  most?: number;
  values(status: ControlStatus): (number | null)[];
}

const tasks = (status: ControlStatus, values: Float64Array, factor: number): (number | null)[] =>
  [0, 1].map((k) => (k < status.task_count ? factor * values[k]! : null));

export class Charts implements Panel {
  readonly element = h("section.charts", { "aria-label": "Strip charts of the last 30 seconds" });
  private readonly plots: uPlot[] = [];
  private readonly data: (number | null)[][][] = [];
  private readonly charts: Chart[];
  private last: { sequence: bigint; stamp: bigint } | null = null;
  private roundTrip: number | null = null;
  private drawnAt = 0;
  private dirty = false;

  constructor(c: Context) {
    this.charts = [
      { title: "task error, mm", series: ["1st", "2nd"], least: 0, values: (s) => tasks(s, s.task_error, 1e3) },
      { title: "task scale", series: ["1st", "2nd"], least: 0, most: 1.05, values: (s) => tasks(s, s.task_scale, 1) },
      {
        title: "solver, ms",
        series: ["solve", "cycle"],
        least: 0,
        values: (s) => [1e3 * s.solve_time, 1e3 * s.cycle_time],
      },
      {
        title: "period jitter, ms",
        series: ["mean", "worst"],
        least: 0,
        values: (s) => [this.jitter(s), 1e3 * s.jitter_max],
      },
      { title: "round trip, ms", series: ["page to control"], least: 0, span: 5, values: () => [this.roundTrip] },
    ];
    for (const chart of this.charts) this.make(chart);
    c.world.taps.status.push((status) => this.take(status));
    new ResizeObserver(() => this.resize()).observe(this.element);
  }

  setRoundTrip(milliseconds: number): void {
    this.roundTrip = milliseconds;
  }

  /** Deviation of the cycles since the last sample from the period, ms, by control's clock. */
  private jitter(status: ControlStatus): number | null {
    const cycles = this.last ? Number(status.sequence - this.last.sequence) : 0;
    const off =
      cycles > 0 ? Math.abs(Number(status.stamp - this.last!.stamp) / cycles / 1e6 - 1e3 * status.period) : null;
    this.last = { sequence: status.sequence, stamp: status.stamp };
    return off;
  }

  private make(chart: Chart): void {
    const axis = {
      stroke: kInk,
      grid: { stroke: "#1c2732", width: 1 },
      ticks: { show: false },
      font: "10px system-ui",
    };
    const place = h("div.chart", { role: "img", "aria-label": chart.title });
    this.element.append(place);
    const data: (number | null)[][] = [[], ...chart.series.map(() => [])];
    this.data.push(data);
    this.plots.push(
      new uPlot(
        {
          title: chart.title,
          width: 160,
          height: 120,
          pxAlign: false,
          cursor: { show: false },
          legend: { show: false },
          padding: [2, 6, 0, 0],
          scales: {
            x: { time: false, range: (_u, _min, max) => [max - kWindow, max] },
            y: {
              range: (_u, _min, max) => [chart.least, chart.most ?? Math.max(1.15 * (max ?? 0), chart.span ?? 0.1)],
            },
          },
          axes: [
            {
              ...axis,
              size: 18,
              space: 60,
              values: (u, splits) => splits.map((v) => `${(v - (u.scales["x"]?.max ?? 0)).toFixed(0)} s`),
            },
            {
              ...axis,
              size: 42,
              space: 22,
              values: (_u, splits) => splits.map((v) => Number(v.toPrecision(3)).toString()),
            },
          ],
          series: [
            {},
            ...chart.series.map((name, k) => ({
              label: name,
              stroke: kLines[k]!,
              width: 1.4,
              dash: kDashes[k]!,
              points: { show: false },
              spanGaps: false,
            })),
          ],
        },
        data as uPlot.AlignedData,
        place,
      ),
    );
    const key = h(
      "div.key",
      {},
      ...chart.series.map((name, k) => {
        const entry = h("span", {}, `${["—", "╌"][k] ?? "—"} ${name}`);
        entry.style.color = kLines[k]!;
        return entry;
      }),
    );
    if (chart.series.length > 1) place.append(key);
  }

  private take(status: ControlStatus): void {
    const now = performance.now() / 1000;
    this.charts.forEach((chart, i) => {
      const columns = this.data[i]!;
      columns[0]!.push(now);
      chart.values(status).forEach((value, k) => columns[k + 1]!.push(value));
      if (columns[0]!.length > kMost || (columns[0]!.length > 64 && (columns[0]![32] as number) < now - kWindow)) {
        for (const column of columns) column.splice(0, 32);
      }
    });
    this.dirty = true;
  }

  update(now: number): void {
    if (!this.dirty || now - this.drawnAt < kRedraw) return;
    this.drawnAt = now;
    this.dirty = false;
    this.plots.forEach((plot, i) => plot.setData(this.data[i] as uPlot.AlignedData));
  }

  private resize(): void {
    const places = [...this.element.children] as HTMLElement[];
    this.plots.forEach((plot, i) => {
      const { clientWidth: width, clientHeight: height } = places[i]!;
      if (width > 0 && height > 0) plot.setSize({ width, height: Math.max(60, height - 18) });
    });
  }
}
