// SPDX-License-Identifier: Apache-2.0
import { readFileSync } from "node:fs";
import { expect, test } from "vitest";

import { useDescriptions } from "../src/state/descriptions";
import type { Descriptions } from "../src/state/descriptions";
import { lackingProtections } from "../src/state/protections";
import type { Arm } from "../src/state/robot";
import type { HalStatus } from "../src/wire/messages";
import { maxJointsPerArm, Protection } from "../src/wire/messages";

useDescriptions(JSON.parse(readFileSync("generated/descriptions.json", "utf8")) as Descriptions);

const arm = (name: string): Arm =>
  ({ name, joints: ["beta_1", "alpha_1"].map((joint) => ({ name: joint })) }) as unknown as Arm;
const hal = (lost: Record<number, number>): HalStatus => {
  const axis_lost = new Uint16Array(64);
  for (const [index, mask] of Object.entries(lost)) axis_lost[Number(index)] = mask;
  return { axis_lost } as unknown as HalStatus;
};
const kDeadline = 1 << Protection.commandDeadline;
const kRamp = 1 << Protection.quickStopRamp;

test("nothing is said where no drive lacks anything", () => {
  expect(lackingProtections(hal({}), [arm("arm_a"), arm("left")])).toEqual([]);
});

test("what all drives lack is said once, with its meaning", () => {
  const all = hal({ 0: kDeadline, 1: kDeadline });
  const [found, ...others] = lackingProtections(all, [arm("arm_a")]);
  expect(others).toEqual([]);
  expect(found?.who).toBe("all drives");
  expect(found?.what).toHaveLength(1);
  expect(found?.what[0]).toMatch(/^command_deadline: .*1400:05/);
});

test("joints with the same loss stand together, by their arms' names", () => {
  const some = hal({ 0: kDeadline, [maxJointsPerArm]: kDeadline, [maxJointsPerArm + 1]: kDeadline | kRamp });
  const found = lackingProtections(some, [arm("arm_a"), arm("left")]);
  expect(found.map(({ who, what }) => [who, what.length])).toEqual([
    ["beta_1 of arm A, beta_1 of arm LEFT", 1],
    ["alpha_1 of arm LEFT", 2],
  ]);
});
