// SPDX-License-Identifier: Apache-2.0
/** Age of data by the server's clock. */
import { expect, test } from "vitest";

import { ServerClock } from "../src/state/server";
import { seeded } from "./random";

test("data is never older than said, and at most by the quickest way there and back", () => {
  const random = seeded();
  for (let run = 0; run < 300; ++run) {
    const clock = new ServerClock();
    expect(clock.age(0, 0)).toBe(Infinity);
    const offset = 1e12 * random(); // of the server's clock
    let now = 1e6 * random();
    let quickest = Infinity;
    for (let k = 0; k < 5; ++k) {
      const [there, back] = [100 * random() ** 4, 100 * random() ** 4];
      clock.note(now, now + there + back, now + there + offset);
      quickest = Math.min(quickest, there);
      now += there + back + 100 * random();
      const held = 20_000 * random() ** 3; // by the link
      const said = clock.age(now - held + offset, now);
      expect(said).toBeGreaterThanOrEqual(held - 1e-3);
      expect(said).toBeLessThanOrEqual(held + quickest + 1e-3);
    }
    expect(clock.age(now + offset, now + 10_000 + 300)).toBe(Infinity);
  }
});

test("a change of the server's clock makes nothing young", () => {
  const random = seeded();
  for (let run = 0; run < 300; ++run) {
    const clock = new ServerClock();
    const change = (random() < 0.5 ? -1 : 1) * (50 + 1e6 * random());
    for (let k = 0; k < 5; ++k) clock.note(1000 * k, 1000 * k + 20, 1000 * k + 10);
    clock.note(5000, 5020, 5010 + change);
    const held = 20_000 * random();
    expect(clock.age(5030 + change - held, 5030)).toBeGreaterThanOrEqual(held - 1e-3);
    expect(clock.age(5030 + change - held, 5030)).toBeLessThanOrEqual(held + 20);
  }
});
