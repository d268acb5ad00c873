// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import type { Robot } from "../src/state/robot";
import { World } from "../src/state/world";
import { Slot } from "../src/wire/link";
import type { DiagnosticArray, PlanningReference } from "../src/wire/messages";
import { Phase } from "../src/wire/messages";

/** A world of a robot of which nothing comes but what a test puts there. */
function world(): { of: World; put: (topic: string, message: object, time: number) => void } {
  const slots = new Map<string, { slot: Slot; listener: ((message: never, time: number) => void) | undefined }>();
  const subscribe = (topic: string, listener?: (message: never, time: number) => void): Slot => {
    const slot = new Slot(topic, listener, 20, () => {});
    slots.set(topic, { slot, listener });
    return slot;
  };
  const robot = { prefix: "tandem", arms: [], control: { period: 0.1 }, status_period: 0.1 } as unknown as Robot;
  const source = { state: "open" as const, subscribe: subscribe as never };
  return {
    of: new World(robot, source, { age: (time, now) => now - time }),
    put(topic, message, time) {
      const { slot, listener } = slots.get(`/tandem/${topic}`)!;
      slot.at = slot.time = time;
      slot.value = () => message as never;
      listener?.(message as never, time);
    },
  };
}
const running = { phase: Phase.running, trajectory_id: 7, point: 15, point_count: 100 } as PlanningReference;
const named = (id: number, name: string): DiagnosticArray =>
  ({
    status: [{ name: "tandem-planning", level: 0, message: "", values: [{ key: `trajectory ${id}`, value: name }] }],
  }) as unknown as DiagnosticArray;

test("planning is silent once its reference is older than the data of others may be", () => {
  const { of, put } = world();
  expect(of.planningSilent(0)).toBe("never received");
  put("planning/reference", running, 1000);
  expect(of.planningSilent(1000 + of.late)).toBe("");
  expect(of.planningSilent(1001 + of.late)).toMatch(/ms old$/);
  put("planning/reference", running, 2000);
  expect(of.planningSilent(2000)).toBe("");
});

test("what is resumed has the name that planning reports for it, and no other's", () => {
  const { of, put } = world();
  expect(of.continues()).toBe("nothing moves by itself");
  put("planning/reference", running, 0);
  expect(of.continues()).toBe("continues the trajectory from point 15 of 100");
  put("diagnostics", named(6, "square"), 0);
  expect(of.continues()).toBe("continues the trajectory from point 15 of 100");
  put("diagnostics", named(7, "circle"), 0);
  expect(of.continues()).toBe("continues circle from point 15 of 100");
  put("planning/reference", { ...running, trajectory_id: 8 }, 0);
  expect(of.trajectoryName()).toBe("");
});
