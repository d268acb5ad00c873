// SPDX-License-Identifier: Apache-2.0
import { afterEach, beforeEach, expect, test, vi } from "vitest";

import { Region } from "../src/panels/announcer";
import { seeded } from "./random";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

test("each event is said once or counted, at most one text a second, and nothing stays to be read", () => {
  const random = seeded();
  for (let run = 0; run < 100; ++run) {
    const shown: { text: string; at: number }[] = [];
    const region = new Region((text) => shown.push({ text, at: performance.now() }));
    const events = 1 + Math.floor(60 * random());
    for (let k = 0; k < events; ++k) {
      region.say(`event ${k}`);
      vi.advanceTimersByTime(random() < 0.5 ? 0 : 3000 * random() ** 4);
    }
    vi.advanceTimersByTime(20_000);
    const texts = shown.filter(({ text }) => text !== "");
    const said = texts.flatMap(({ text }) => [...text.matchAll(/event (\d+)/g)].map((m) => Number(m[1])));
    const counted = texts.reduce((sum, { text }) => sum + Number(/And (\d+) more/.exec(text)?.[1] ?? 0), 0);
    expect(said.length + counted).toBe(events);
    expect(said).toEqual([...new Set(said)].sort((a, b) => a - b));
    for (let k = 1; k < texts.length; ++k) expect(texts[k]!.at - texts[k - 1]!.at).toBeGreaterThan(998); // timers count whole milliseconds, at both ends
    expect(shown.at(-1)!.text).toBe("");
  }
});

test("the first event is said at once, and the same text is said again", () => {
  const shown: string[] = [];
  const region = new Region((text) => shown.push(text));
  for (let k = 0; k < 3; ++k) {
    region.say("Jog refused");
    vi.advanceTimersByTime(k === 0 ? 100 : 1000);
    expect(shown.length).toBe(k + 1);
    expect(shown[k]).toMatch(/^Jog refused/);
    expect(shown[k]).not.toBe(shown[k - 1]);
  }
});
