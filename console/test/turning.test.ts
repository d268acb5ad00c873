// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import type { Teleoperation } from "../src/state/robot";
import {
  angleOf,
  describeOrientation,
  describeTurn,
  quaternionOf,
  TurnWatch,
  turnOf,
  whyNoOrientation,
} from "../src/state/turning";
import type { TeleopStatus } from "../src/wire/messages";
import { TeleopState } from "../src/wire/messages";
import { seeded } from "./random";

const kRank =
  "found full with arm_a, whose joints turn its tip with rank 2 behind its position (at home), expected rank 3";
const robot = (orientation: Teleoperation["orientation"], axis = "", full = ""): Teleoperation => ({
  orientation,
  refused: { axis, full },
});

function status(filter: number[], reach: number[], limited = "", state: number = TeleopState.following): TeleopStatus {
  const stage = (name: string, output: number[], limited_by: string): object => ({
    name,
    active: 0,
    limited_by,
    input: Float64Array.from(output),
    output: Float64Array.from(output),
  });
  const stages = [
    stage("reach", [9, 9, 9], ""),
    stage("rotation_filter", filter, ""),
    stage("rotation_reach", reach, limited),
  ];
  return { state, arm: 1, stages } as unknown as TeleopStatus;
}
const tip = (angle: number): { x: number; y: number; z: number; w: number } => ({
  x: 0,
  y: 0,
  z: Math.sin(angle / 2),
  w: Math.cos(angle / 2),
});

test("where orientations are ignored the page says so, and what the arms could follow", () => {
  expect(whyNoOrientation(robot("ignored"))).toMatch(/ignores orientations .*ignored\); its arms could follow full\.$/);
  expect(whyNoOrientation(robot("ignored", "", kRank))).toContain(`could follow axis, but not full: ${kRank}.`);
  expect(whyNoOrientation(robot("ignored", "rank 0", kRank))).toMatch(/its arms cannot follow them: rank 0\.$/);
  expect(describeOrientation(robot("ignored"))).toBe("");
  for (const followed of ["axis", "full"] as const) expect(whyNoOrientation(robot(followed))).toBe("");
});

test("before anything turns, the page says what the arms cannot turn", () => {
  expect(describeOrientation(robot("axis", "", kRank))).toContain(`The arms cannot turn more: ${kRank}.`);
  expect(describeOrientation(robot("axis"))).toMatch(/about it the tip is free\.$/);
  expect(describeOrientation(robot("full"))).toMatch(/^Turns the whole tip/);
});

test("the commanded orientation is that of the last stage of rotations, while somebody drives", () => {
  const turn = turnOf(status([0, 0, 0.3], [0, 0, 0.1], "leash_angle"))!;
  expect(turn).toMatchObject({ arm: 1, leashed: true });
  expect([...turn.commanded]).toEqual([0, 0, 0.1]);
  expect(describeTurn(turn, "B")).toBe("tip B 5.7° from its commanded orientation, 17.2° from the one asked for");
  expect(describeTurn(turnOf(status([0, 0, 0.1], [0, 0, 0.1]))!, "B")).toBe(
    "tip B 5.7° from its commanded orientation",
  );
  expect(turnOf(status([0, 0, 0], [0, 0, 0], "", TeleopState.released))).toBeNull();
  expect(turnOf({ ...status([], []), stages: [] })).toBeNull();
  expect(turnOf(null)).toBeNull();
});

test("rotation vectors become quaternions: axis and angle are kept", () => {
  const random = seeded();
  for (let run = 0; run < 200; ++run) {
    const vector = [0, 1, 2].map(() => 4 * (random() - 0.5) * (run < 20 ? 1e-10 : 1));
    const [x, y, z, w] = quaternionOf(vector);
    expect(Math.hypot(x, y, z, w)).toBeCloseTo(1, 12);
    const angle = angleOf(vector);
    expect(2 * Math.atan2(Math.hypot(x, y, z), w)).toBeCloseTo(angle, 9);
    expect(x * vector[0]! + y * vector[1]! + z * vector[2]!).toBeGreaterThanOrEqual(0);
  }
});

test("a tip on its leash that does not turn for a second cannot turn further; one that turns can", () => {
  const leashed = turnOf(status([0, 0, 0.3], [0, 0, 0.1], "leash_angle"));
  const free = turnOf(status([0, 0, 0.1], [0, 0, 0.1]));
  const watch = new TurnWatch();
  for (let time = 0; time <= 1000; time += 50) expect(watch.see(time, leashed, tip(0))).toBe("");
  expect(watch.see(1050, leashed, tip(0.001))).toBe("The arm cannot turn further in this direction: 5.7° are left.");
  expect(watch.see(1100, leashed, tip(0.05))).toBe(""); // it has turned
  for (let time = 1150; time <= 5000; time += 50) expect(watch.see(time, leashed, tip(2e-5 * time + 0.028))).toBe("");
  expect(watch.see(9000, leashed, tip(0.128))).not.toBe("");
  expect(watch.see(9050, free, tip(0.1))).toBe("");
  expect(watch.see(9100, leashed, tip(0.1))).toBe("");
  expect(watch.see(20000, leashed, null)).toBe("");
});

test("a tip that turns about another axis than it is asked to, or away from it, cannot turn further", () => {
  const asked = turnOf(status([0, 0, 0.3], [0, 0, 0.1], "leash_angle"));
  const about = (axis: "x" | "z", angle: number) => ({
    ...tip(0),
    [axis]: Math.sin(angle / 2),
    w: Math.cos(angle / 2),
  });
  for (const [axis, sign] of [
    ["x", 1],
    ["x", -1],
    ["z", -1],
  ] as const) {
    const watch = new TurnWatch();
    for (let time = 0; time <= 1000; time += 50)
      expect(watch.see(time, asked, about(axis, sign * 1e-4 * time))).toBe("");
    for (let time = 1050; time <= 9000; time += 50)
      expect(watch.see(time, asked, about(axis, sign * 1e-4 * time))).toMatch(/cannot turn further/); // and it stays said
  }
  const slow = new TurnWatch(); // 0.1 degrees per second
  for (let time = 0; time <= 9000; time += 50)
    expect(slow.see(time, asked, tip((time * 1e-3 * 0.1) / 57.3)) === "").toBe(time <= 1000);
});
