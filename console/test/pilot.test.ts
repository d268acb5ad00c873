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
import type { TeleopStatus } from "../src/wire/messages";
import { TeleopState } from "../src/wire/messages";

interface Input {
  sequence: bigint;
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
function armed(turns: boolean): { pilot: Pilot; sent: Input[]; answer: (of: Partial<TeleopStatus>) => void } {
  const sent: Input[] = [];
  let teleop: Partial<TeleopStatus> | null = null;
  const status = { session: 3n, sequence: 40n };
  const pilot = new Pilot(
    { prefix: "tandem", arms: [{}, {}] } as unknown as Robot,
    { controlStatus: () => status, teleop: { value: () => teleop } } as unknown as World,
    { state: "open", publish: (_: string, message: Input) => sent.push(message) > 0 } as unknown as Link,
    { client: 5n } as unknown as Commander,
    () => {},
  );
  pilot.view = () => kView;
  pilot.turns = turns;
  pilot.arm(true);
  for (const condition of Object.keys(kConditions) as Condition[]) pilot.gate.allow(condition, true);
  return { pilot, sent, answer: (of) => (teleop = of) };
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

test("a hold that control has stopped ends, and one that was pressed anew does not end by the same status", () => {
  const { pilot, sent, answer } = armed(false);
  const stopped = { state: TeleopState.stopped, client: 5n, reason: "no input within the budget" };
  const held = (): number => {
    vi.advanceTimersByTime(40);
    return sent.at(-1)!.operator_present;
  };
  pilot.gate.update("KeyU", true);
  expect(held()).toBe(1);
  const { sequence } = sent.at(-1)!;
  answer({ ...stopped, client: 6n, answers_input: sequence });
  expect(held(), "another client's").toBe(1);
  answer({ ...stopped, answers_input: 0n });
  expect(held(), "of a hold before").toBe(1);
  answer({ ...stopped, answers_input: sequence });
  expect(held()).toBe(0);
  expect(pilot.gate.cut).toBe("control has stopped: no input within the budget");
  pilot.gate.update("KeyU", true); // still down
  expect(held()).toBe(0);
  pilot.gate.update("KeyU", false);
  pilot.gate.update("KeyU", true);
  expect(held(), "the status is older than this hold").toBe(1);
});
