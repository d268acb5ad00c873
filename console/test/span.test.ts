// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import { presentRange } from "../src/panels/span";
import { segmentsOf } from "../src/scene/span";

test("a joint without limits has the turn around its place, one with limits what they leave", () => {
  expect(presentRange(-Infinity, Infinity, 7)).toEqual({ lower: 7 - Math.PI, upper: 7 + Math.PI });
  expect(presentRange(-0.15, -0.1, -0.12)).toEqual({ lower: -0.15, upper: -0.1 });
});

test("the line of a tip has a gap where the arm has no solution", () => {
  const [a, b, c] = [0, 1, 2].map((x) => [x, 0, 0]);
  expect(segmentsOf([a!, b!, c!])).toEqual([0, 0, 0, 1, 0, 0, 1, 0, 0, 2, 0, 0]);
  expect(segmentsOf([a!, null, c!, b!])).toEqual([2, 0, 0, 1, 0, 0]);
  expect(segmentsOf([])).toEqual([]);
});
