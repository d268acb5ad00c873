// SPDX-License-Identifier: Apache-2.0
import { readFileSync } from "node:fs";
import { expect, test } from "vitest";

import { useDescriptions } from "../src/state/descriptions";
import type { Descriptions } from "../src/state/descriptions";
import { describeSummary, standingOf } from "../src/state/summary";
import { Phase, TaskKind } from "../src/wire/messages";
import type { RunSummary } from "../src/wire/messages";

useDescriptions(JSON.parse(readFileSync("generated/descriptions.json", "utf8")) as Descriptions);

const kRun: RunSummary = {
  trajectory_id: 1,
  name: "circle",
  phase: Phase.finished,
  reason: "",
  points: 100,
  reached: 100,
  iterations: 1000,
  duration: 12.34,
  task_count: 2,
  task_kind: Uint8Array.of(TaskKind.relativePosition, TaskKind.tipPosition, 0, 0),
  task_arm: Uint8Array.of(0, 1, 0, 0),
  task_other_arm: Uint8Array.of(1, 0, 0, 0),
  rms: Float64Array.of(1e-5, 2e-3, 0, 0),
  percentile_95: Float64Array.of(2e-5, 3e-3, 0, 0),
  maximum: Float64Array.of(3e-5, 4e-3, 0, 0),
  gate_interventions: 7n,
  least_clearance: 1.5e-3,
  limits: ["tube 2 of arm a against tube 1"],
  limit_shares: Float64Array.of(0.12345),
};

test("a finished run names its tasks, errors, gate, distance and limits", () => {
  expect(describeSummary(kRun, ["left", "arm_b"])).toEqual({
    headline: "circle: finished; 100 of 100 points reached in 12.3 s",
    lines: [
      "error, relative position of LEFT and B: RMS 0.010, 95 % within 0.020, maximum 0.030 mm",
      "error, tip of B: RMS 2.000, 95 % within 3.000, maximum 4.000 mm",
      "interventions of the safety gate: 7",
      "least distance of bodies: 1.500 mm",
      "tube 2 of arm a against tube 1 restricted the motion in 12.3 % of the control periods",
    ],
    bad: false,
  });
});

test("a result from before the start of planning, or of another system, is not that of the last run", () => {
  const plan = { fingerprint: 0xabn, trajectory_id: 1, point_count: 100 };
  const own = "00000000000000ab";
  expect(standingOf(kRun, plan, own)).toBe("last");
  expect(standingOf(kRun, { ...plan, trajectory_id: 2 }, own)).toBe("none"); // the next run is under way
  // Planning was started again: it has another number, and no run yet.
  expect(standingOf(kRun, { ...plan, trajectory_id: 77, point_count: 0 }, own)).toBe("earlier");
  expect(standingOf(kRun, { ...plan, fingerprint: 0xacn }, own)).toBe("earlier");
  expect(standingOf(null, plan, own)).toBe("none");
  expect(standingOf(kRun, null, own)).toBe("none");
});

test("errors of axes and orientations are in degrees", () => {
  const run = {
    ...kRun,
    task_count: 4,
    task_other_arm: Uint8Array.of(0, 0, 1, 0),
    task_kind: Uint8Array.of(TaskKind.tipPosition, TaskKind.tipAxis, TaskKind.relativeOrientation, TaskKind.lookAt),
    rms: Float64Array.of(1e-5, Math.PI / 180, Math.PI / 90, 0),
  };
  expect(describeSummary(run, ["a", "b"]).lines.slice(0, 4)).toEqual([
    "error, tip of A: RMS 0.010, 95 % within 0.020, maximum 0.030 mm",
    "error, axis of B: RMS 1.000, 95 % within 0.172, maximum 0.229 deg",
    "error, relative orientation of A and B: RMS 2.000, 95 % within 0.000, maximum 0.000 deg",
    "error, direction of view of A: RMS 0.000, 95 % within 0.000, maximum 0.000 deg",
  ]);
});

test("soft tasks are named, with errors in mm or as a stability", () => {
  const run = { ...kRun, task_kind: Uint8Array.of(TaskKind.jointLimits, TaskKind.elasticStability, 0, 0) };
  expect(describeSummary(run, ["a", "b"]).lines.slice(0, 2)).toEqual([
    "error, joint limits of A: RMS 0.010, 95 % within 0.020, maximum 0.030 mm",
    "error, elastic stability of B: RMS 0.002, 95 % within 0.003, maximum 0.004 stability",
  ]);
});

test("a missed point, an overlap and an ended run are said", () => {
  const missed = describeSummary({ ...kRun, phase: Phase.failed, reason: "missed 8 of 12 points" }, ["a", "b"]);
  expect(missed.headline).toContain("circle: failed: missed 8 of 12 points; ");
  expect(missed.bad).toBe(true);
  const overlapped = describeSummary({ ...kRun, least_clearance: -6.5e-4 }, ["a", "b"]);
  expect(overlapped.lines[0]).toBe("WARNING: bodies overlapped by up to 0.650 mm");
  expect(overlapped.bad).toBe(true);
  const unknown = describeSummary({ ...kRun, phase: Phase.idle, least_clearance: Infinity }, ["a", "b"]);
  expect(unknown.headline).toContain("ended by a client");
  expect(unknown.lines.join()).not.toContain("distance");
});

test("remote centres and poses are named, with errors in mm", () => {
  const run = {
    ...kRun,
    task_count: 3,
    task_arm: Uint8Array.of(0, 1, 0, 0),
    task_other_arm: Uint8Array.of(0, 0, 1, 0),
    task_kind: Uint8Array.of(TaskKind.remoteCentre, TaskKind.tipPose, TaskKind.relativePose, 0),
  };
  expect(describeSummary(run, ["a", "b"]).lines.slice(0, 3)).toEqual([
    "error, remote centre of A: RMS 0.010, 95 % within 0.020, maximum 0.030 mm",
    "error, pose of B: RMS 2.000, 95 % within 3.000, maximum 4.000 mm",
    "error, relative pose of A and B: RMS 0.000, 95 % within 0.000, maximum 0.000 mm",
  ]);
});
