// SPDX-License-Identifier: Apache-2.0
import { afterEach, beforeEach, expect, test, vi } from "vitest";

import type { Commander } from "../src/state/commander";
import type { Robot } from "../src/state/robot";
import type { World } from "../src/state/world";
import type { Condition } from "../src/teleop/gate";
import { kConditions } from "../src/teleop/gate";
import { Device, Pilot } from "../src/teleop/pilot";
import { kGap } from "../src/teleop/repeats";
import type { Link } from "../src/wire/link";

interface Input {
  operator_present: number;
  kind: number;
  frame: number;
  view: number[];
  linear: number[];
  angular: number[];
  position: number[];
  orientation: number[];
  answers_control: bigint;
}
const kView = [0, 0.6, 0, 0.8];
const kTurned = [0, 0, 0.6, 0.8] as const;

/** A pilot that is armed and may hold, with what it has sent. */
function armed(turns: boolean): { pilot: Pilot; sent: Input[] } {
  const sent: Input[] = [];
  const status = { session: 3n, sequence: 40n };
  const pilot = new Pilot(
    { prefix: "tandem", arms: [{}, {}] } as unknown as Robot,
    { controlStatus: () => status } as unknown as World,
    { state: "open", publish: (_: string, message: Input) => sent.push(message) > 0 } as unknown as Link,
    { client: 5n } as unknown as Commander,
    () => {},
  );
  pilot.view = () => kView;
  pilot.turns = turns;
  pilot.arm(true);
  for (const condition of Object.keys(kConditions) as Condition[]) pilot.gate.allow(condition, true);
  return { pilot, sent };
}

beforeEach(() => void vi.useFakeTimers({ toFake: ["setInterval", "clearInterval", "performance"] }));
afterEach(() => void vi.useRealTimers());

test.each([true, false])(
  "velocities of a device in the axes of the view; rotations only where they are offered: %s",
  (turns) => {
    const { pilot, sent } = armed(turns);
    pilot.read = () => ({ device: Device.keyboard, velocity: [0.01, 0, 0], angular: [0, 0, 0.5] });
    vi.advanceTimersByTime(40);
    expect(sent.at(-1)).toMatchObject({ operator_present: 0, linear: [0, 0, 0], angular: [0, 0, 0] });
    pilot.gate.update("KeyU", true);
    vi.advanceTimersByTime(40);
    expect(sent.at(-1)).toMatchObject({ operator_present: 1, kind: 1, frame: 1, view: kView, answers_control: 40n });
    expect(sent.at(-1)).toMatchObject({ linear: [0.01, 0, 0], angular: turns ? [0, 0, 0.5] : [0, 0, 0] });
    const before = sent.length;
    pilot.gate.update("KeyU", false);
    expect(sent.length).toBe(before + 1); // at once
    expect(sent.at(-1)).toMatchObject({ operator_present: 0, linear: [0, 0, 0], angular: [0, 0, 0] });
  },
);

test.each([true, false])(
  "the orientation of the ball in the axes of the base frame, where it is offered: %s",
  (turns) => {
    const { pilot, sent } = armed(turns);
    pilot.read = () => ({ device: Device.pointer, position: [0.1, 0.2, 0.3], orientation: kTurned });
    pilot.gate.update("ring", true);
    vi.advanceTimersByTime(40);
    expect(sent.at(-1)).toMatchObject({ operator_present: 1, kind: 2, frame: 0, position: [0.1, 0.2, 0.3] });
    expect(sent.at(-1)!.orientation).toEqual(turns ? kTurned : [0, 0, 0, 1]);
    pilot.read = () => ({ device: Device.pointer, position: [0.1, 0.2, 0.3] });
    vi.advanceTimersByTime(40);
    expect(sent.at(-1)!.orientation).toEqual([0, 0, 0, 1]);
  },
);

test("a gap of its timer ends a hold, and it has to be pressed anew", () => {
  const { pilot, sent } = armed(true);
  pilot.read = () => ({ device: Device.keyboard, velocity: [0, 0, 0], angular: [0, 0, 0.5] });
  pilot.gate.update("KeyU", true);
  vi.advanceTimersByTime(1000);
  expect(sent.at(-1)!.operator_present).toBe(1);
  const now = performance.now();
  const clock = vi.spyOn(performance, "now").mockImplementation(() => now + kGap + 20); // nothing runs meanwhile
  vi.advanceTimersByTime(16);
  expect(pilot.gate.held).toBe(false);
  expect(pilot.gate.cut).toMatch(/^this page hung for \d+ ms/);
  expect(sent.at(-1)).toMatchObject({ operator_present: 0, angular: [0, 0, 0] });
  clock.mockRestore();
  pilot.gate.update("KeyU", true); // still down
  expect(pilot.gate.held).toBe(false);
});
