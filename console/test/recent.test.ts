// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { Recent } from "../src/state/recent";
import { seeded } from "./random";

test("the keys that were set last are kept, with their last values", () => {
  const random = seeded();
  const most = 20;
  const recent = new Recent<number, number>(most);
  const order: number[] = [];
  for (let k = 0; k < 2000; ++k) {
    const key = Math.floor(random() * 60);
    recent.set(key, k);
    const before = order.indexOf(key);
    if (before >= 0) order.splice(before, 1);
    order.push(key);
    expect([...recent.keys()]).toEqual(order.slice(-most));
    expect(recent.get(key)).toBe(k);
  }
});
