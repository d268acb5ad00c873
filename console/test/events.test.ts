// SPDX-License-Identifier: Apache-2.0
import { readFileSync } from "node:fs";
import { expect, test } from "vitest";

import type { Descriptions } from "../src/state/descriptions";
import { useDescriptions, valuesOf } from "../src/state/descriptions";
import { changesOf, clientName, describeRequest } from "../src/state/events";
import { ControlKind } from "../src/wire/messages";
import type { ControlRequest, ControlStatus } from "../src/wire/messages";
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

test("requests of others are named, and renewals of the lease are not mentioned", () => {
  const request = (kind: number, more: Partial<ControlRequest> = {}): string =>
    describeRequest({ kind, arm: 255, text: "", value: "", ...more } as ControlRequest, kArms);
  expect(request(ControlKind.keepLease)).toBe("");
  expect(request(ControlKind.stateCommand, { value: "enable" })).toBe("enable");
  expect(request(ControlKind.stateCommand, { value: "pause", arm: 1 })).toBe("pause of arm B");
  expect(request(ControlKind.setParameter, { text: "tip_gain", value: "3" })).toBe("tip_gain = 3");
  expect(request(ControlKind.jog, { arm: 0 })).toBe("jog of arm A");
  for (const kind of Object.values(ControlKind))
    if (kind !== ControlKind.keepLease && kind !== ControlKind.stateCommand) expect(request(kind)).not.toBe("");
  expect(clientName(0xabcd1f3an)).toBe("client 1f3a");
  expect(clientName(2n ** 64n - 1n)).toBe("CRTK clients");
});
