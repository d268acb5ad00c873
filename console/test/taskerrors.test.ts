// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import { describeErrors, followed, scaleOf } from "../src/state/taskerrors";
import type { PlanningReference, TaskReference } from "../src/wire/messages";
import { Phase, Source, TaskKind, TeleopMode } from "../src/wire/messages";

const kRadian = 0.05; // m, as control weighs it
const status = (...errors: number[]) => ({ task_count: errors.length, task_error: Float64Array.of(...errors, 0, 0) });
const plan = (phase: number, ...kinds: number[]) => ({
  phase,
  task_count: kinds.length,
  tasks: kinds.map((kind) => ({ kind }) as TaskReference),
});

test("an error of an angle is shown in degrees, that of a position in mm", () => {
  const run = plan(Phase.running, TaskKind.tipPosition, TaskKind.tipOrientation);
  expect(describeErrors(status(1.2e-5, (kRadian * Math.PI) / 180), run)).toBe("error 0.012 mm / 1.000°");
  expect(
    describeErrors(status(1.2e-5, 3.4e-4), plan(Phase.paused, TaskKind.relativePosition, TaskKind.tipPosition)),
  ).toBe("error 0.012 / 0.340 mm");
  for (const kind of [TaskKind.tipAxis, TaskKind.tipOrientation, TaskKind.relativeOrientation, TaskKind.lookAt])
    expect(kRadian * scaleOf({ kind }).factor).toBeCloseTo(180 / Math.PI, 9);
});

test("an error of a pose says that it contains angles, and one of the stability has no unit", () => {
  expect(
    describeErrors(status(1e-3, 5e-3), plan(Phase.running, TaskKind.relativePose, TaskKind.elasticStability)),
  ).toBe("error 1.000 mm with angles / 0.100");
});

test("an operator's tasks are known, and the error of the orientation is an angle", () => {
  const kinds = (mode: number, arm: number, other_arm: number, orientation: "ignored" | "axis" | "full"): string[] =>
    followed({ source: Source.teleoperation }, null, { mode, arm, other_arm }, orientation)!.tasks.map(
      ({ kind, arm: whose }) => `${Object.entries(TaskKind).find(([, value]) => value === kind)![0]} ${whose}`,
    );
  expect(kinds(TeleopMode.pair, 0, 1, "full")).toEqual(["relativePosition 0", "tipPosition 0", "tipOrientation 0"]);
  expect(kinds(TeleopMode.relative, 1, 0, "axis")).toEqual(["relativePosition 1", "tipPosition 0", "tipAxis 1"]);
  expect(kinds(TeleopMode.tip, 1, 0, "ignored")).toEqual(["tipPosition 1", "tipPosition 0"]);
  expect(kinds(TeleopMode.tip, 0, 0, "axis")).toEqual(["tipPosition 0", "tipAxis 0"]);
  const pair = { mode: TeleopMode.pair, arm: 0, other_arm: 1 };
  const errors = status(1e-5, 2e-5, kRadian * 0.1);
  expect(describeErrors(errors, followed({ source: Source.teleoperation }, null, pair, "full"))).toBe(
    "error 0.010 mm / 0.020 mm / 5.730°",
  );
  const run = plan(Phase.running, TaskKind.tipPosition) as unknown as PlanningReference;
  expect(followed({ source: Source.planning }, run, pair, "full")).toBe(run);
});

test("errors of tasks whose kinds are not known are lengths, as control states them", () => {
  const two = status(1e-5, 2e-5);
  for (const other of [
    null,
    plan(Phase.finished, TaskKind.tipAxis, TaskKind.tipAxis),
    plan(Phase.running, TaskKind.tipAxis),
  ])
    expect(describeErrors(two, other)).toBe("error 0.010 / 0.020 mm");
  expect(describeErrors(status(), null)).toBe("");
});
