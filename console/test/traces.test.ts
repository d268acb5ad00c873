// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import { errorTraces, taskTraces } from "../src/state/traces";
import type { PlanningReference } from "../src/wire/messages";
import { Phase, TaskKind } from "../src/wire/messages";

const kArms = ["arm_a", "arm_b"];
const plan = (phase: number): PlanningReference =>
  ({
    phase,
    task_count: 2,
    tasks: [
      { kind: TaskKind.relativePosition, arm: 0, other_arm: 1 },
      { kind: TaskKind.tipPosition, arm: 1, other_arm: 0 },
    ],
  }) as unknown as PlanningReference;

test("the colour of an arm means that arm, and no other line has one", () => {
  const [relative, tip, ...rest] = taskTraces(2, plan(Phase.running), kArms);
  expect(relative).toEqual({ name: "A from B", colour: "--trace-1", dashed: false });
  expect(tip).toEqual({ name: "tip B", colour: "--trace-arm-1", dashed: false });
  expect(rest.map(({ name }) => name)).toEqual(["", ""]);
});

test("tasks of no trajectory have no arm", () => {
  for (const traces of [
    taskTraces(2, plan(Phase.finished), kArms),
    taskTraces(3, plan(Phase.running), kArms),
    taskTraces(1, null, kArms),
  ])
    for (const { colour } of traces) expect(colour).not.toContain("arm");
  expect(taskTraces(2, null, kArms).map(({ name, dashed }) => [name, dashed])).toEqual([
    ["1st", false],
    ["2nd", true],
    ["", false],
    ["", false],
  ]);
});

test("lines of errors name their unit where it is not mm, and no angle has the colour of an arm", () => {
  const kinds = [TaskKind.tipPosition, TaskKind.relativeOrientation, TaskKind.tipPose, TaskKind.remoteCentre];
  const tasks = kinds.map((kind) => ({ kind, arm: 1, other_arm: 0 }));
  const run = { phase: Phase.running, task_count: 4, tasks } as unknown as PlanningReference;
  expect(errorTraces(4, run, kArms).map(({ name }) => name)).toEqual([
    "tip B",
    "orientation B from A, °",
    "pose B, mm with angles",
    "centre B",
  ]);
  expect(taskTraces(4, run, kArms)[1]!.name).toBe("orientation B from A");
  expect(errorTraces(4, run, kArms)[1]!.colour).not.toContain("arm");
  expect(errorTraces(2, null, kArms)[0]!.name).toBe("1st");
});
