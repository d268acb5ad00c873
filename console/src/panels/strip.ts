// SPDX-License-Identifier: Apache-2.0
/** A strip chart: lines of the last seconds, their names with present values, and a cursor with the values at its time. */
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";

import { History } from "../state/history";
import type { Value } from "../state/history";
import type { Trace } from "../state/traces";
import { h, setAttribute, setText } from "./dom";

const kWindow = 30; // s
const kStep = 0.05; // s: less than a pixel of charts up to 600 px wide
const kAges = [30, 20, 10, 0]; // s, of the ticks
const kSync = "strips"; // one cursor in all charts
const kKeyStep = 0.5; // s for each arrow key

export interface Strip {
  /** What is on the vertical axis, with the unit. */
  title: string;
  traces: Trace[];
  /** Lower end of the axis, while no value is below it. */
  least: number;
  /** The axis ends here, or above all values, but not below `span`. */
  most?: number;
  span?: number;
  /** A value as text, without unit. */
  text(value: number): string;
}

/** Digits by size, without trailing zeros. */
export const digits = (value: number): string => Number(value.toPrecision(3)).toString();

export class StripChart {
  readonly element: HTMLElement;
  private readonly plot: uPlot;
  private readonly history: History;
  private readonly when = h("output.when");
  private readonly keys: { mark: HTMLElement; name: HTMLElement; value: HTMLElement; row: HTMLElement }[];
  private readonly colours: string[] = [];
  private ink = "";
  private grid = "";
  /** Time of the newest sample by the server's clock, s, and when it came, ms. */
  private newest = 0;
  private cameAt = -1;

  /** @param gap  s without samples, after which there is no line
   * @param say  announces the values at the cursor to screen readers */
  constructor(
    private readonly strip: Strip,
    gap: number,
    private readonly say: (text: string) => void,
    /** Newest time on the axis, s; absent: it runs on from the newest sample. */
    private readonly present?: () => number,
  ) {
    this.history = new History(strip.traces.length, kWindow, kStep, gap);
    this.keys = strip.traces.map(() => {
      const [mark, name, value] = [h("i"), h("span"), h("output")];
      return { mark, name, value, row: h("span", {}, mark, name, value) };
    });
    const canvas = h("div.plot", { "aria-hidden": "true" });
    this.element = h(
      "div.chart",
      {
        role: "group",
        tabindex: "0",
        "aria-label": `Chart: ${strip.title}, the last ${kWindow} seconds. Arrow keys move the cursor.`,
      },
      h("div.title", {}, h("strong", {}, strip.title), this.when),
      h("div.key", {}, ...this.keys.map(({ row }) => row)),
      canvas,
    );
    this.plot = new uPlot(this.options(), this.history.columns(), canvas);
    this.element.addEventListener("keydown", (event) => this.step(event));
    this.element.addEventListener("blur", () => this.plot.setCursor({ left: -10, top: -10 }));
    new ResizeObserver(() => {
      const { clientWidth: width, clientHeight: height } = canvas;
      if (width === 0 || height === 0) return;
      this.recolour(); // elements outside of the page have no colours
      this.plot.setSize({ width, height });
    }).observe(canvas);
  }

  private options(): uPlot.Options {
    const { strip } = this;
    const axis = {
      stroke: () => this.ink,
      grid: { stroke: () => this.grid, width: 1 },
      ticks: { show: false },
      font: "10px system-ui, sans-serif",
    };
    const range = (_: uPlot, least: number | null, most: number | null): [number, number] => [
      Math.min(strip.least, 1.15 * (least ?? 0)),
      Math.max(strip.most ?? 1.15 * (most ?? 0), strip.span ?? 0),
    ];
    return {
      width: 160,
      height: 120,
      pxAlign: false,
      legend: { show: false },
      cursor: {
        y: false,
        drag: { x: false, y: false },
        points: { show: false },
        sync: { key: kSync, scales: ["x", null] },
      },
      padding: [8, 14, 0, 0],
      scales: { x: { time: false, range: () => [this.now() - kWindow, this.now()] }, y: { range } },
      axes: [
        {
          ...axis,
          size: 18,
          splits: (plot) => kAges.map((age) => (plot.scales["x"]?.max ?? 0) - age),
          values: () => kAges.map((age) => `${-age} s`),
        },
        { ...axis, size: 44, space: 22, values: (_, splits) => splits.map(digits) },
      ],
      series: [
        {},
        ...strip.traces.map((trace, k) => ({
          stroke: () => this.colours[k] ?? "",
          width: 1.4,
          dash: trace.dashed ? [6, 3] : [],
          points: { show: false },
        })),
      ],
      hooks: { setCursor: [() => this.read()] },
    };
  }

  /** Names a line; an empty name hides its key. */
  rename(k: number, trace: Trace): void {
    const before = this.strip.traces[k]!;
    if (trace.name !== before.name || trace.colour !== before.colour) this.show(k, trace);
  }
  private show(k: number, { name, colour, dashed }: Trace): void {
    const { mark, name: text, row } = this.keys[k]!;
    setText(text, name);
    mark.style.borderTopStyle = dashed ? "dashed" : "solid";
    mark.style.borderTopColor = `var(${colour})`;
    row.hidden = name === "";
    this.colours[k] = this.colour(colour);
    this.strip.traces[k] = { name, colour, dashed };
    this.plot.series[k + 1]!.dash = dashed ? [6, 3] : [];
  }
  /** After a change of the theme. */
  recolour(): void {
    [this.ink, this.grid] = [this.colour("--soft"), this.colour("--line")];
    this.strip.traces.forEach((trace, k) => this.show(k, trace));
    this.plot.redraw(false);
  }
  /** A canvas needs the value itself, of the theme in force. */
  private colour(name: string): string {
    this.when.style.color = `var(${name})`;
    const value = getComputedStyle(this.when).color;
    this.when.style.color = "";
    return value;
  }

  close(): void {
    this.plot.destroy();
  }

  /** Newest time on the axis. */
  private now(): number {
    if (this.present) return this.present();
    return this.cameAt < 0 ? 0 : this.newest + (performance.now() - this.cameAt) / 1000;
  }
  /** @param time  when the server received it, ms */
  add(time: number, values: readonly Value[]): void {
    this.newest = time / 1000;
    this.cameAt = performance.now();
    this.history.add(this.newest, values);
  }
  draw(): void {
    if (this.element.clientWidth === 0) return;
    this.plot.setData(this.history.columns());
    this.read();
  }

  /** Values at the cursor, or the present ones. @returns them as text */
  private read(): string {
    const { left } = this.plot.cursor;
    const set = left !== undefined && left >= 0;
    const time = set ? this.plot.posToVal(left, "x") : this.now();
    const { strip } = this;
    const ranges = this.history.at(time);
    const texts = this.keys.map(({ value, name }, k) => {
      const range = ranges[k];
      const [least, most] = range ? [strip.text(range.least), strip.text(range.most)] : ["–", "–"];
      const text = least === most || !set ? most : `${least} to ${most}`;
      setText(value, text);
      return `${name.textContent} ${text}`;
    });
    const age = set ? `${(time - this.now()).toFixed(1)} s` : "";
    setText(this.when, age);
    setAttribute(this.element, "data-cursor", set ? "yes" : "no");
    return `${age}: ${texts.filter((_, k) => !this.keys[k]!.row.hidden).join(", ")}`;
  }

  private step(event: KeyboardEvent): void {
    const steps = event.key === "ArrowLeft" ? -1 : event.key === "ArrowRight" ? 1 : 0;
    if (steps === 0) return;
    event.preventDefault();
    const { width } = this.plot.over.getBoundingClientRect();
    const { left } = this.plot.cursor;
    const from = left !== undefined && left >= 0 ? left : width;
    const to = Math.min(width, Math.max(0, from + (steps * kKeyStep * width) / kWindow));
    this.plot.setCursor({ left: to, top: 1 });
    this.say(this.read());
  }
}
