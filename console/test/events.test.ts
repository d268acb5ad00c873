// SPDX-License-Identifier: Apache-2.0
import { readFileSync } from "node:fs";
import { expect, test } from "vitest";

import type { Descriptions } from "../src/state/descriptions";
import { useDescriptions, valuesOf } from "../src/state/descriptions";
import { changesOf, clientName } from "../src/state/events";
import type { ControlStatus } from "../src/wire/messages";
import { seeded } from "./random";

useDescriptions(JSON.parse(readFileSync("generated/descriptions.json", "utf8")) as Descriptions);
const kArms = ["arm_a", "arm_b"];

test("each fault that comes is one alarm, with meaning and remedy, and none that stays or goes", () => {
  const random = seeded();
  const known = valuesOf("Fault");
  const masks = (): Uint32Array =>
    Uint32Array.from(kArms, () => known.reduce((mask, { value }) => (random() < 0.2 ? mask | value : mask), 0));
  for (let run = 0; run < 200; ++run) {
    const [before, now] = [masks(), masks()].map(
      (faults) => ({ faults, operating_state: Uint8Array.of(1, 1) }) as unknown as ControlStatus,
    );
    const alarms = changesOf(before!, now!, kArms).map(([level, text]) => `${level} ${text}`);
    const come = kArms.flatMap((arm, k) =>
      known
        .filter(({ value }) => (now!.faults[k]! & value) !== 0 && (before!.faults[k]! & value) === 0)
        .map(({ name, meaning, remedy }) =>
          `alarm Arm ${arm.at(-1)!.toUpperCase()}: ${name}: ${meaning}. ${remedy ?? ""}`.trim(),
        ),
    );
    expect(alarms.sort()).toEqual(come.sort());
  }
});

test("clients without a name have the end of their number", () => {
  expect(clientName(0xabcd1f3an)).toBe("client 1f3a");
  expect(clientName(2n ** 64n - 1n)).toBe("CRTK clients");
});
