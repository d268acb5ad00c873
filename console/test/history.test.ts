// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import type { Value } from "../src/state/history";
import { History } from "../src/state/history";
import { seeded } from "./random";

const kWindow = 30;
const kStep = 0.05;
const kGap = 0.5;

test("at any rate, extremes of one sample stay, points are few, and there are lines across no gap", () => {
  const random = seeded();
  for (let run = 0; run < 15; ++run) {
    const history = new History(2, kWindow, kStep, kGap);
    const period = 10 ** (-3 + 2 * random()); // 1 kHz to 10 Hz
    const samples: { time: number; values: Value[] }[] = [];
    let time = 1e9 * random();
    const end = time + 10 + 60 * random();
    while (time < end) {
      const values = [random() < 0.001 ? 100 * (random() - 0.5) : random(), random() < 0.1 ? null : -random()];
      samples.push({ time, values });
      history.add(time, values);
      time += random() < 0.003 ? 2 * random() : period * (0.5 + random());
    }
    const kept = samples.filter((one) => one.time >= samples.at(-1)!.time - kWindow);
    const [times, ...series] = history.columns();
    expect(times.length).toBeLessThan((2.1 * kWindow) / kStep + 100);
    expect(times.every((at, i) => i === 0 || at >= times[i - 1]!)).toBe(true);
    expect(times[0]!).toBeGreaterThan(samples.at(-1)!.time - kWindow - kStep - 1e-6);
    series.forEach((column, k) => {
      const all = kept.map(({ values }) => values[k]!).filter((value) => value !== null);
      const shown = column.filter((value) => value !== null);
      expect(Math.max(...shown)).toBeGreaterThanOrEqual(Math.max(...all));
      expect(Math.min(...shown)).toBeLessThanOrEqual(Math.min(...all));
    });
    // The first series has values everywhere: where it has none, there is a gap.
    const holes = times.filter((_, j) => series[0]![j] === null);
    // An interval stays until the next one begins, so the first may be from before the window.
    const drawn = samples.filter((one) => one.time >= times[0]!);
    const silences = drawn
      .slice(1)
      .flatMap(({ time: to }, i) => (to - drawn[i]!.time > kGap ? [[drawn[i]!.time, to]] : []));
    expect(holes.length).toBe(silences.length);
    holes.forEach((at, i) => expect(at > silences[i]![0]! && at < silences[i]![1]!).toBe(true));
    const some = kept[Math.floor(kept.length * random())]!;
    const range = history.at(some.time)[0]!;
    expect(range.least).toBeLessThanOrEqual(some.values[0]!);
    expect(range.most).toBeGreaterThanOrEqual(some.values[0]!);
    expect(history.at(samples.at(-1)!.time + kGap + 0.01)).toEqual([null, null]);
  }
});

test("a clock that goes back begins anew, and values that are no numbers are none", () => {
  const history = new History(1, kWindow, kStep, kGap);
  history.add(100, [1]);
  history.add(99, [NaN]);
  history.add(99.3, [2]);
  expect(history.columns()).toEqual([
    [99, 99.3],
    [null, 2],
  ]);
});
