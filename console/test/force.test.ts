// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import { arrowUnit, forceOf, newtons } from "../src/state/force";
import type { Shape } from "../src/wire/messages";
import { seeded } from "./random";

test("forces are said in mN or N, and are not known without a load", () => {
  expect(newtons(0.0002134)).toBe("0.213 mN");
  expect(newtons(0.25)).toBe("250 mN");
  expect(newtons(1.25)).toBe("1.25 N");
  const shape = (loaded: number): Shape => ({ loaded, wrench: Float64Array.of(1, 2, 3, 4, 5, 6) }) as unknown as Shape;
  expect(forceOf(shape(1))).toEqual([1, 2, 3]);
  expect(forceOf(shape(0))).toBeNull();
  expect(forceOf(null)).toBeNull();
});

test("the unit of arrows is round, keeps them in sight, and stays while the force changes little", () => {
  const random = seeded();
  for (let k = 0; k < 1000; ++k) {
    const largest = 10 ** (8 * random() - 5);
    const unit = arrowUnit(largest, 0);
    expect([1, 2, 5]).toContain(Number((unit / 10 ** Math.floor(Math.log10(unit) + 1e-9)).toPrecision(6)));
    expect(largest / unit).toBeGreaterThan(0.999);
    expect(largest / unit).toBeLessThan(2.501);
    expect(arrowUnit(largest * (0.6 + 0.5 * random()), unit)).toBe(unit);
    const far = arrowUnit(100 * largest, unit);
    expect((100 * largest) / far).toBeLessThan(2.501);
  }
  expect(arrowUnit(0, 0)).toBe(0);
});
