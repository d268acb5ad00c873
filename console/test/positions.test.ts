// SPDX-License-Identifier: Apache-2.0
import { readFileSync } from "node:fs";
import { expect, test } from "vitest";

import { useDescriptions } from "../src/state/descriptions";
import type { Descriptions } from "../src/state/descriptions";
import { unconfirmedPositions } from "../src/state/positions";
import type { Arm } from "../src/state/robot";
import type { HalStatus, JointState } from "../src/wire/messages";
import { AxisPhase, LastPosition, maxJointsPerArm } from "../src/wire/messages";

useDescriptions(JSON.parse(readFileSync("generated/descriptions.json", "utf8")) as Descriptions);

const arm = (name: string): Arm =>
  ({
    name,
    joints: [
      { name: "beta_1", translation: true },
      { name: "alpha_1", translation: false },
    ],
  }) as unknown as Arm;
const arms = [arm("arm_a"), arm("left")];
const measured = [
  { position: Float64Array.of(0.0031, 0.1) },
  { position: Float64Array.of(-0.02, Math.PI) },
] as unknown as JointState[];
const hal = (phases: Record<number, number>, last: number): HalStatus => {
  const axis_phase = new Uint8Array(64).fill(AxisPhase.ready);
  for (const [index, phase] of Object.entries(phases)) axis_phase[Number(index)] = phase;
  return {
    axis_phase,
    axis_last: new Uint8Array(64).fill(last),
    axis_last_position: new Float64Array(64).fill(0.001),
    axis_jump_tolerance: new Float64Array(64).fill(0.0005),
  } as unknown as HalStatus;
};

test("only positions that have to be confirmed or measured are shown", () => {
  const shown: number[] = [AxisPhase.unconfirmed, AxisPhase.unmeasured];
  const others = Object.values(AxisPhase).filter((phase) => !shown.includes(phase));
  expect(others).toHaveLength(5);
  for (const phase of others)
    expect(unconfirmedPositions(hal({ 0: phase }, LastPosition.known), arms, measured)).toEqual([]);
});

test("what is expected and what is measured stand together, in the joint's unit", () => {
  const jumped = hal({ 0: AxisPhase.unconfirmed, [maxJointsPerArm + 1]: AxisPhase.unconfirmed }, LastPosition.known);
  expect(unconfirmedPositions(jumped, arms, measured)).toEqual([
    {
      arm: 0,
      unmeasured: false,
      joint: "beta_1 of arm A",
      text: "beta_1 of arm A: 3.10 mm measured; expected 1.00 mm ± 0.50 mm, as it was last",
    },
    {
      arm: 1,
      unmeasured: false,
      joint: "alpha_1 of arm LEFT",
      text: "alpha_1 of arm LEFT: 180.00° measured; expected 0.06° ± 0.03°, as it was last",
    },
  ]);
});

test("without a last position the reason stands in its place, and no number", () => {
  for (const last of [LastPosition.missing, LastPosition.damaged, LastPosition.changed]) {
    const [found] = unconfirmedPositions(hal({ 0: AxisPhase.unconfirmed }, last), arms, [null, null]);
    expect(found?.text).toMatch(/^beta_1 of arm A: – mm measured; nothing to compare it with: .*position/);
    expect(found?.text).not.toContain("expected");
  }
});

test("what has to be measured says how, in the joint's unit, and shows no number", () => {
  const both = hal({ 0: AxisPhase.unmeasured, [maxJointsPerArm + 1]: AxisPhase.unmeasured }, LastPosition.known);
  const found = unconfirmedPositions(both, arms, measured);
  expect(found.map(({ unmeasured }) => unmeasured)).toEqual([true, true]);
  expect(found[0]?.text).toMatch(
    /^beta_1 of arm A: measure the joint, then tandem home --arm \S+ --measured beta_1=MM$/,
  );
  expect(found[1]?.text).toMatch(/--measured alpha_1=DEGREES$/);
});
