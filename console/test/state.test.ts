// SPDX-License-Identifier: Apache-2.0
import { readFileSync } from "node:fs";
import { expect, test } from "vitest";

import { age, ageText, staleAfter } from "../src/state/age";
import { parametersOf } from "../src/state/robot";
import type { Robot } from "../src/state/robot";
import { allowed, place, rotationRange, turns, wrap } from "../src/state/track";
import {
  driveRecord,
  faultsOf,
  idleText,
  limitName,
  limitsInTheWay,
  useDescriptions,
  whyNot,
  valuesOf,
} from "../src/state/descriptions";
import type { Descriptions } from "../src/state/descriptions";
import type { ControlPermissions, ControlStatus, HalStatus } from "../src/wire/messages";
import { Action, actionsPerArm, RefusalReason } from "../src/wire/messages";
import { seeded } from "./random";

/** Texts as from the server: generated from idl/ like the server's (tests/unit/console compares them). */
const kDescriptions = JSON.parse(readFileSync("generated/descriptions.json", "utf8")) as Descriptions;
const kMethods = kDescriptions["Method"]!.map((word) => word.name);
useDescriptions(kDescriptions);

const kTubes = ["arm_a", "arm_b"].map((name) => ({
  name,
  joints: [1, 2, 3, 1, 2, 3].map((tube, j) => ({ translation: j < 3, part: `tube ${tube}` })),
}));
const kCatheter = {
  name: "arm_b",
  joints: ["insertion", "roll", "bend"].map((part, j) => ({ translation: j === 0, part })),
};

test("words for limits are those of tandem solve", () => {
  expect(limitName(0, kTubes[0]!, 2)).toBe("tube 2 of arm A against tube 1");
  expect(limitName(99, kTubes[1]!, 1)).toContain("unknown limit");
  expect([1, 5, 7].map((kind) => limitName(kind, kCatheter, kind === 7 ? 2 : 1))).toEqual([
    "velocity limit of insertion of arm B",
    "rotation limit of roll of arm B",
    "largest rotation in a step of bend of arm B",
  ]);
});

test("masks of faults become all their words, and bits of a newer robot are not lost", () => {
  const random = seeded();
  for (let run = 0; run < 50; ++run) {
    const mask = Math.floor(random() * 2 ** 31);
    const names = faultsOf(mask).map((f) => f.name);
    const faults = valuesOf("Fault");
    for (const fault of faults) expect(names.includes(fault.name)).toBe((mask & fault.value) !== 0);
    expect(names.includes("unknown")).toBe(mask >= 1 << faults.length);
  }
  expect(faultsOf(0)).toEqual([]);
});

test("the drives' record reads as in tandem status", () => {
  const hal = {
    first_fault: Uint32Array.of(0, 1 << 9),
    fault_cause: Uint8Array.of(0, 2),
    fault_joint: Uint8Array.of(255, 4),
    fault_amount: Float64Array.of(0, 0.031),
    fault_allowed: Float64Array.of(0, 0.02),
  } as unknown as HalStatus;
  expect(driveRecord(hal, 0, 6)).toBe("");
  expect(driveRecord(hal, 1, 6)).toBe("drive (following error) of joint 5: 0.031 rad, allowed 0.02 rad");
  // Of a catheter's three joints only the insertion is a length.
  const roll = { ...hal, fault_joint: Uint8Array.of(255, 1) } as HalStatus;
  expect(driveRecord(roll, 1, 3)).toBe("drive (following error) of joint 2: 0.031 rad, allowed 0.02 rad");
});

test("an idle arm is reported with the time until power-off", () => {
  const status = {
    idle: Float64Array.of(0, 48, 130, 2),
    idle_left: Float64Array.of(-1, 12, -1, 58),
  } as unknown as ControlStatus;
  expect(idleText(status, 0)).toBe("");
  expect(idleText(status, 1)).toContain("power off in 12 s");
  expect(idleText(status, 2)).toContain("without a commander for 130 s");
  expect(idleText(status, 3)).toBe("");
});

test("limits in the way are named, however many there are said to be", () => {
  const status = {
    limited: 1,
    limit_count: 200,
    limit_kind: Uint8Array.of(0, 2),
    limit_arm: Uint8Array.of(0, 9),
    limit_tube: Uint8Array.of(2, 3),
  } as unknown as ControlStatus;
  expect(limitsInTheWay(status, kTubes)).toContain("tube 2 of arm A against tube 1, rotation velocity limit of tube 3");
  expect(limitsInTheWay({ ...status, limited: 0 }, [])).toBe("");
});

test("what control does not allow is said with its reason, arm by arm", () => {
  const random = seeded();
  const known = valuesOf("RefusalReason");
  for (let run = 0; run < 100; ++run) {
    const reason = Uint8Array.from({ length: 256 }, () => Math.floor(random() * (known.length + 2)));
    const permissions = { arm_count: 2, reason } as unknown as ControlPermissions;
    for (const { value: action } of valuesOf("Action")) {
      const said = [0, 1].map((arm) => whyNot(permissions, action, ["arm_a", "arm_b"], arm));
      said.forEach((text, arm) => {
        const code = reason[arm * actionsPerArm + action]!;
        expect(text === "").toBe(code === 0);
        const words = known.find(({ value }) => value === code)?.name ?? "unknown reason";
        expect(text).toContain(words);
      });
      expect(whyNot(permissions, action, ["arm_a", "arm_b"])).toBe(said[0] || said[1]);
    }
  }
  expect(whyNot(null, 0, ["arm_a"])).toBe("");
  const wrong = {
    arm_count: 1,
    reason: new Uint8Array(256).fill(RefusalReason.wrongState),
  } as unknown as ControlPermissions;
  expect(whyNot(wrong, Action.resume, ["arm_a"], -1, ["ENABLED"])).toBe(
    "Arm A is ENABLED: only a PAUSED arm can be resumed.",
  );
  expect(whyNot(wrong, Action.resume, ["arm_a"])).toContain("not allowed in this state");
});

test("old is old: by five periods, at least half a second", () => {
  expect(staleAfter(0.001)).toBe(500);
  expect(staleAfter(1)).toBe(5000);
  const random = seeded();
  for (let run = 0; run < 500; ++run) {
    const [at, later] = [1e4 * random(), 1e4 * random()];
    expect(age(at, at + later)).toBeCloseTo(later, 6);
    expect(age(at, at - later)).toBe(0);
  }
  expect(ageText(Infinity)).toBe("never received");
  expect(ageText(420)).toBe("420 ms old");
  expect(ageText(3200)).toBe("3.2 s old");
  expect(ageText(7.3e6)).toBe("2 h old");
});

test("bars: what is inside stays inside and in order", () => {
  const random = seeded();
  for (let run = 0; run < 200; ++run) {
    const range = { from: -random(), to: random() };
    const [a, b] = [4 * random() - 2, 4 * random() - 2].sort((x, y) => x - y) as [number, number];
    expect(place(a, range)).toBeLessThanOrEqual(place(b, range));
    const [{ left, right }] = allowed(a, b, range, false);
    expect(left).toBeGreaterThanOrEqual(0);
    expect(right).toBeLessThanOrEqual(1);
    expect(left).toBeLessThanOrEqual(right);
    const angle = 100 * (random() - 0.5);
    expect(Math.abs(wrap(angle))).toBeLessThanOrEqual(Math.PI + 1e-9);
    expect(Math.cos(wrap(angle))).toBeCloseTo(Math.cos(angle), 9);
  }
  expect(allowed(-Infinity, Infinity, { from: -1, to: 0 }, false)[0]).toEqual({ left: 0, right: 1 });
  expect(rotationRange(null, 3)).toEqual({ from: -Math.PI, to: Math.PI });
  expect(place(1, { from: 1, to: 1 })).toBe(0);
});

test("bars of one turn: an angle is drawn in the allowed part exactly when it is allowed, and numbered as it is drawn", () => {
  const random = seeded();
  const range = rotationRange(null, null);
  for (let run = 0; run < 2000; ++run) {
    const lower = 40 * (random() - 0.5);
    const upper = lower + 2 * Math.PI * random() * 1.2;
    const angle = lower + 2 * Math.PI * (1.4 * random() - 0.2);
    expect(wrap(angle) + 2 * Math.PI * turns(angle)).toBeCloseTo(angle, 9);
    const at = place(wrap(angle), range);
    const inside = allowed(lower, upper, range, true).some(
      ({ left, right }) => left < right && left <= at && at <= right,
    );
    const away = [-2, 0, 2].some((k) => angle + k * Math.PI >= lower && angle + k * Math.PI <= upper);
    const near = [lower, upper].some((bound) => Math.abs(wrap(angle - bound)) < 1e-9);
    if (!near) expect(inside).toBe(away || upper - lower >= 2 * Math.PI);
  }
});

test("parameters: those that the method reads, in their order", () => {
  const parameters = [
    { name: "shared", value: 1, methods: kMethods },
    { name: "own", value: 2, methods: ["nspqp"] },
  ];
  const robot = { control: { parameters } } as unknown as Robot;
  for (const method of kMethods) {
    const names = parametersOf(robot, method).map((p) => p.name);
    expect(names).toEqual(["shared", ...(method === "nspqp" ? ["own"] : [])]);
  }
});
