// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import type { Quaternion, Vector } from "../src/teleop/motion";
import { ballPoint, kBall, kGrab, partAt, turnBetween } from "../src/teleop/ring";
import { seeded } from "./random";

const rotated = ([x, y, z, w]: Quaternion, v: Vector): number[] => {
  const t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])] as const;
  return [
    v[0] + w * t[0] + y * t[2] - z * t[1],
    v[1] + w * t[1] + z * t[0] - x * t[2],
    v[2] + w * t[2] + x * t[1] - y * t[0],
  ];
};

test("the tip is grabbed near it, the ball around it, and nothing farther out", () => {
  expect([0, kGrab - 1, kGrab, kBall, kBall + 5, kBall + 50].map(partAt)).toEqual([
    "pointer",
    "pointer",
    "ring",
    "ring",
    "ring",
    null,
  ]);
});

test("the pointer takes the point of the ball that it has grabbed with it, by a unit quaternion", () => {
  const random = seeded();
  const anywhere = (): Vector => ballPoint(4 * kBall * (random() - 0.5), 4 * kBall * (random() - 0.5));
  for (let run = 0; run < 500; ++run) {
    const [from, to] = [anywhere(), anywhere()];
    for (const point of [from, to]) expect(Math.hypot(...point)).toBeCloseTo(1, 12);
    const turn = turnBetween(from, to);
    expect(Math.hypot(...turn)).toBeCloseTo(1, 12);
    rotated(turn, from).forEach((value, k) => expect(value).toBeCloseTo(to[k]!, 9));
  }
});

test("its front follows the pointer, its rim turns about the line of sight", () => {
  const small = 0.1 * kBall;
  expect(turnBetween(ballPoint(0, 0), ballPoint(small, 0))[1]).toBeGreaterThan(0.04); // to the right: about y
  expect(turnBetween(ballPoint(0, 0), ballPoint(0, small))[0]).toBeLessThan(-0.04); // upwards: about -x
  const [x, y, z, w] = turnBetween(ballPoint(2 * kBall, 0), ballPoint(0, 1.5 * kBall)); // counterclockwise
  expect([x, y]).toEqual([0, 0]);
  expect([z, w].map((value) => value * Math.SQRT2)).toEqual([expect.closeTo(1), expect.closeTo(1)]);
  expect(turnBetween(ballPoint(kBall, 0), ballPoint(-kBall, 0))).toEqual([0, 0, 1, 0]);
  expect(turnBetween(ballPoint(3, 4), ballPoint(3, 4))[3]).toBeCloseTo(1, 12);
});
