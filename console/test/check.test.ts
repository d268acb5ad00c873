// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import { missesOf, pathsOf } from "../src/scene/preview";
import type { Planner, Wanted } from "../src/state/check";
import { TrajectoryCheck } from "../src/state/check";
import { describeCheck } from "../src/state/checktext";
import { rehearsedJoints } from "../src/state/rehearsal";
import type { Answer } from "../src/state/commander";
import type { ComputationResult, PointReport } from "../src/wire/messages";
import { ComputationKind, Outcome, Reach, RehearsalEnd, ReplyCode } from "../src/wire/messages";
import { seeded } from "./random";

const kYes: Answer = { accepted: true, code: 0, reason: "", value: 0, took: 1 };

/** Records what a check asks for. */
class Asked implements Planner {
  requests: Record<string, unknown>[] = [];
  sent: [number, bigint][] = [];
  next: Promise<Answer> = Promise.resolve(kYes);
  compute(what: object): { request: bigint; answer: Promise<Answer> } {
    this.requests.push(what as Record<string, unknown>);
    return { request: BigInt(this.requests.length), answer: this.next };
  }
  tellComputation(kind: number, computation: bigint): void {
    this.sent.push([kind, computation]);
  }
}

const wanted = (yaml: string, joints: number[] | null = [0, 0], not = "", gain = "3"): Wanted => ({
  yaml,
  method: "nspqp",
  parameters: new Map([["tip_gain", gain]]),
  joints,
  not,
});
const result = (request: number, of: Partial<ComputationResult> = {}): ComputationResult =>
  ({
    request: BigInt(request),
    outcome: Outcome.good,
    start: Float64Array.of(0, 0),
    report: { start: "", points: [] },
    ...of,
  }) as unknown as ComputationResult;

function checked(): { check: TrajectoryCheck; planner: Asked } {
  const planner = new Asked();
  const check = new TrajectoryCheck(planner, [true, false]);
  check.look(0, wanted("a"));
  check.look(1000, wanted("a"));
  expect(planner.requests).toHaveLength(1);
  return { check, planner };
}

test("a text is checked once it is not typed any more, as tandem plan check does by default", () => {
  const planner = new Asked();
  const check = new TrajectoryCheck(planner, [true, false]);
  for (let now = 0; now < 2000; now += 50) check.look(now, wanted(`text ${now}`));
  expect(planner.requests).toHaveLength(0);
  for (let now = 2000; now < 4000; now += 50) check.look(now, wanted("text"));
  expect(planner.requests).toHaveLength(1);
  expect(planner.requests[0]).toMatchObject({
    kind: ComputationKind.check,
    trajectory: "text",
    rehearse: "nspqp",
    stability: 0.05,
    accept: 1e-5,
    starts: 12,
    seed: 1n,
  });
  expect(check.state).toEqual({ kind: "running", share: 0 });
  check.progressed({ request: 1n, fraction: 0.5 } as never, 4000);
  expect(check.state).toEqual({ kind: "running", share: 0.5 });
  check.ended(result(7)); // of another request
  expect(check.state.kind).toBe("running");
  check.ended(result(1));
  expect(check.state).toMatchObject({ kind: "done", moved: false });
  check.look(5000, wanted("text"));
  expect(planner.requests).toHaveLength(1);
});

test("nothing is asked while there is a reason not to, and the reason is shown", () => {
  const planner = new Asked();
  const check = new TrajectoryCheck(planner, [true, false]);
  for (let now = 0; now < 3000; now += 50) check.look(now, wanted("a", [0, 0], "a trajectory runs."));
  for (let now = 3000; now < 6000; now += 50) check.look(now, wanted("a", null));
  for (let now = 6000; now < 9000; now += 50) check.look(now, wanted(""));
  expect(planner.requests).toHaveLength(0);
  check.look(9000, wanted("a", [0, 0], "a trajectory runs."));
  expect(describeCheck(check.state).text).toBe("Not checked: a trajectory runs.");
});

test("a check counts for its text and its joints only, and is repeated when the arms stand elsewhere", () => {
  const random = seeded();
  for (let round = 0; round < 50; ++round) {
    const { check, planner } = checked();
    check.ended(result(1));
    const joint = Math.floor(2 * random());
    const away = [5e-4, 5e-3][joint]! * (round % 2 === 0 ? 0.9 : 1.1);
    const there = [0, 0].map((_, j) => (j === joint ? away : 0));
    check.look(2000, wanted("a", there));
    expect(check.state).toMatchObject({ kind: "done", moved: round % 2 === 1 });
    check.look(
      2100,
      wanted(
        "a",
        there.map((q) => 2 * q),
      ),
    ); // still moving
    expect(planner.requests).toHaveLength(1);
    for (let now = 2200; now < 4000; now += 50) check.look(now, wanted("a", there));
    expect(planner.requests).toHaveLength(round % 2 === 1 ? 2 : 1);
    check.look(5000, wanted("b", there));
    expect(check.state.kind).not.toBe("done");
  }
});

test("a check is kept alive, cancelled when another text is wanted, and given up in silence", () => {
  const { check, planner } = checked();
  for (let now = 1000; now < 3500; now += 50) check.look(now, wanted("a"));
  expect(planner.sent).toEqual([1, 2].map(() => [ComputationKind.keepAlive, 1n]));
  for (let now = 3500; now < 4400; now += 50) check.look(now, wanted("b"));
  expect(planner.sent).toHaveLength(3);
  expect(planner.sent.at(-1)).toEqual([ComputationKind.cancel, 1n]);
  check.ended(result(1, { outcome: Outcome.cancelled }));
  check.look(4500, wanted("b"));
  expect(planner.requests).toHaveLength(2);
  for (let now = 4500; now < 36000; now += 50) check.look(now, wanted("b"));
  expect(describeCheck(check.state)).toEqual({ text: "✕ planning has not answered", level: "bad" });
});

test("a check rehearses with the parameters that control reports, and anew when they change", () => {
  const { check, planner } = checked();
  expect(planner.requests[0]).toMatchObject({ parameters: [{ name: "tip_gain", value: "3" }] });
  check.ended(result(1));
  check.look(2000, wanted("a"));
  check.look(3000, wanted("a"));
  expect(planner.requests).toHaveLength(1);
  check.look(3050, wanted("a", [0, 0], "", "0.5"));
  expect(check.state.kind).toBe("none");
  check.look(4000, wanted("a", [0, 0], "", "0.5"));
  expect(planner.requests).toHaveLength(2);
  expect(planner.requests[1]).toMatchObject({ parameters: [{ name: "tip_gain", value: "0.5" }] });
});

test("the parser's reason is shown, and a busy planning is asked again", async () => {
  const planner = new Asked();
  const check = new TrajectoryCheck(planner, [true, false]);
  planner.next = Promise.resolve({ ...kYes, accepted: false, code: ReplyCode.busy, reason: "planning is busy" });
  check.look(0, wanted("a"));
  check.look(1000, wanted("a"));
  await planner.next;
  planner.next = Promise.resolve({ ...kYes, accepted: false, code: ReplyCode.malformed, reason: "line 3: points" });
  check.look(1050, wanted("a"));
  expect(planner.requests).toHaveLength(1);
  check.look(2100, wanted("a"));
  expect(planner.requests).toHaveLength(2);
  await planner.next;
  expect(describeCheck(check.state)).toEqual({ text: "✕ line 3: points", level: "bad" });
});

const point = (k: number, reach: number, of: Partial<PointReport> = {}): PointReport =>
  ({
    point: k,
    reach,
    reason: "arm a: 4.2 mm beyond the edge of the workspace",
    wanted: Float64Array.of(k, 0, 0),
    wanted_relative: Float64Array.of(0, 1, 0),
    tip: Float64Array.of(k, 2, 0),
    clearance: Infinity,
    ...of,
  }) as unknown as PointReport;
const done = (points: PointReport[], end: number, more: object = {}): string =>
  describeCheck({
    kind: "done",
    method: "nspqp",
    moved: false,
    result: result(1, {
      report: { start: "", points } as never,
      rehearsed: 1,
      without_posture: {
        end,
        converged: 3,
        points: points.length,
        iterations: 104,
        reason: "held back",
        least_clearance: 0.0006,
      } as never,
      ...more,
    }),
  }).text;

test("what a check has found is said in a few words", () => {
  const good = [1, 2, 3].map((k) => point(k, Reach.reached, { clearance: 0.001 * k }));
  expect(done(good, RehearsalEnd.completed)).toBe(
    "✓ All 3 points can be reached. nspqp needs 104 control periods. Least clearance of the arms: 0.60 mm.",
  );
  expect(done(good, 0, { rehearsed: 0 })).toMatch(/Least clearance of the arms: 1.00 mm\.$/);
  const overlapping = { end: RehearsalEnd.completed, converged: 3, points: 3, iterations: 104, least_clearance: -2e-3 };
  expect(done(good, 0, { without_posture: overlapping as never })).toBe(
    "✓ All 3 points can be reached. nspqp needs 104 control periods. ⚠ The arms overlap by up to 2.00 mm.",
  );
  expect(done(good, RehearsalEnd.stalls)).toMatch(/^All 3.*✕ In the rehearsal, nspqp reaches 3 of 3: held back\./);
  expect(done([...good, point(4, Reach.outsideWorkspace)], RehearsalEnd.completed)).toMatch(
    /^✕ 1 of 4 points cannot be reached. Point 4: arm a: 4.2 mm beyond/,
  );
  expect(done([], 0, { report: { start: "arms touch", points: [] }, rehearsed: 0 })).toBe(
    "✕ It cannot start from the present joints: arms touch",
  );
});

test("the scene shows both paths, and each missed point with the nearest one", () => {
  const points = [point(1, Reach.reached), point(2, Reach.limits)];
  expect(pathsOf(points)).toEqual([
    [
      [1, 0, 0],
      [2, 0, 0],
    ],
    [
      [1, -1, 0],
      [2, -1, 0],
    ],
  ]);
  const alone = points.map((one) => ({ ...one, wanted_relative: new Float64Array(3) }));
  expect(pathsOf(alone)).toHaveLength(1);
  const ends = missesOf(points);
  expect(ends).toHaveLength(8);
  expect(ends.slice(-2)).toEqual([
    [2, 0, 0],
    [2, 2, 0],
  ]);
});

test("a rehearsal has the joints of its periods, and their times", () => {
  const rehearsal = {
    joints: Float64Array.from([1, 2, 3, 4, 5, 6]),
    joints_points: Uint32Array.from([0, 1, 3]),
    stride: 4,
    iterations: 7,
  };
  const of = (rehearsed: number): ComputationResult => result(1, { rehearsed, without_posture: rehearsal as never });
  expect(rehearsedJoints(of(1), 2, 0.1)).toEqual([
    { joints: [1, 2], point: 0, time: 0 },
    { joints: [3, 4], point: 1, time: expect.closeTo(0.4) as number },
    { joints: [5, 6], point: 3, time: expect.closeTo(0.7) as number },
  ]);
  expect(rehearsedJoints(of(0), 2, 0.1)).toEqual([]);
  expect(rehearsedJoints(of(1), 4, 0.1)).toHaveLength(1); // never more than there are joints for
});
