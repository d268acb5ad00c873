// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import { describeRelative } from "../src/state/relative";
import type { PlanningReference, TaskReference } from "../src/wire/messages";
import { TaskKind } from "../src/wire/messages";

const kArms = ["arm_a", "arm_b", "arm_c"];
const kTips = [
  [0, 0, 0.2],
  [0.001, 0.002, 0.2],
  [0.01, 0, 0.21],
];
const task = (kind: number, arm: number, other_arm: number): TaskReference =>
  ({ kind, arm, other_arm, position: [0.009, 0, 0.01] }) as unknown as TaskReference;
const plan = (...tasks: TaskReference[]): PlanningReference =>
  ({ tasks, task_count: tasks.length }) as unknown as PlanningReference;

test("the relative position is that of the task's arms, in their order", () => {
  const other = task(TaskKind.tipPosition, 2, 0);
  expect(describeRelative(plan(other, task(TaskKind.relativePosition, 2, 1)), kTips, kArms)).toBe(
    "tip C from tip B: 9.0, -2.0, 10.0 mm · error 2.000 mm",
  );
  expect(describeRelative(plan(task(TaskKind.relativePosition, 1, 0)), kTips, kArms)).toMatch(
    /^tip B from tip A: 1\.0, 2\.0, 0\.0 mm · error/,
  );
});

test("without such a task it is that of the first two arms, and without a tip there is none", () => {
  const text = "tip A from tip B: -1.0, -2.0, 0.0 mm";
  expect(describeRelative(null, kTips, kArms)).toBe(text);
  expect(describeRelative(plan(task(TaskKind.tipPosition, 2, 0)), kTips, kArms)).toBe(text);
  const over = { tasks: [task(TaskKind.relativePosition, 2, 1)], task_count: 0 };
  expect(describeRelative(over, kTips, kArms)).toBe(text);
  expect(describeRelative(null, [kTips[0]!, null], kArms)).toBe("");
  expect(describeRelative(null, [kTips[0]!], ["arm"])).toBe("");
});
