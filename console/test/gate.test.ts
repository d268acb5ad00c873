// SPDX-License-Identifier: Apache-2.0
import { readFileSync } from "node:fs";

import { expect, test, vi } from "vitest";

import type { Condition } from "../src/teleop/gate";
import { InputGate, kConditions } from "../src/teleop/gate";
import {
  Button,
  buttonBits,
  kFullSpeed,
  kFullTurn,
  kKeys,
  kTurnKeys,
  keyTurn,
  keyVelocity,
  pressed,
  stickTurn,
  stickVelocity,
} from "../src/teleop/motion";
import { kFirstRepeat, kNextRepeat, Repeats } from "../src/teleop/repeats";
import { seeded } from "./random";

const conditions = Object.keys(kConditions) as Condition[];

function open(changed: (held: boolean) => void = () => {}): InputGate {
  const gate = new InputGate(changed);
  for (const condition of conditions) gate.allow(condition, true);
  return gate;
}

test("nothing is held before everything allows it", () => {
  const gate = new InputGate(() => {});
  for (const condition of conditions) {
    gate.update("KeyW", true);
    expect(gate.held).toBe(false);
    expect(gate.obstacle).not.toBe("");
    gate.update("KeyW", false);
    gate.allow(condition, true);
  }
  expect(gate.obstacle).toBe("");
  gate.update("KeyW", true);
  expect(gate.held).toBe(true);
});

test.each(conditions)("losing '%s' releases at once, and does not take up again by itself", (condition) => {
  const reported: boolean[] = [];
  const gate = open((held) => reported.push(held));
  gate.update("pointer", true);
  gate.allow(condition, false);
  expect(gate.held).toBe(false);
  expect(gate.cut).toBe(kConditions[condition]);
  expect(reported).toEqual([true, false]);
  gate.allow(condition, true);
  gate.update("pointer", true); // still down: repeated reports of the device
  expect(gate.held).toBe(false);
  gate.update("pointer", false);
  gate.update("pointer", true);
  expect(gate.held).toBe(true);
});

test("a key of the same hand takes over without a gap; another device does not", () => {
  const reported: boolean[] = [];
  const gate = open((held) => reported.push(held));
  gate.update("KeyW", true);
  gate.update("KeyD", true);
  gate.hand("KeyW", "KeyD");
  expect(gate.source).toBe("KeyD");
  expect(reported).toEqual([true]);
  gate.update("gamepad", true);
  gate.update("KeyD", false);
  expect(gate.held).toBe(false);
  gate.hand("gamepad", "KeyW"); // neither holds
  expect(gate.held).toBe(false);
});

test("random events: held means pressed while allowed, and every change is reported", () => {
  const random = seeded();
  let reported = false;
  const gate = open((held) => (reported = held));
  let held = 0;
  const bad = new Set<Condition>();
  const down = new Set<string>();
  for (let event = 0; event < 20_000; ++event) {
    if (random() < 0.6) {
      const source = ["KeyW", "pointer", "gamepad"][Math.floor(3 * random())]!;
      const isDown = random() < 0.5;
      if (isDown) down.add(source);
      else down.delete(source);
      gate.update(source, isDown);
    } else {
      const condition = conditions[Math.floor(conditions.length * random())]!;
      const good = random() < 0.8;
      if (good) bad.delete(condition);
      else bad.add(condition);
      gate.allow(condition, good);
    }
    const right = reported === gate.held && (!gate.held || (bad.size === 0 && down.has(gate.source!)));
    if (!right)
      throw new Error(
        `event ${event}: held ${gate.held}, reported ${reported}, forbidden by ${[...bad].join()}, down ${[...down].join()}`,
      );
    held += gate.held ? 1 : 0;
  }
  expect(held).toBeGreaterThan(100); // otherwise the test proves nothing
});

test("keys: opposite ones cancel, diagonals are no faster", () => {
  expect(keyVelocity(["KeyA", "KeyD"])).toEqual([0, 0, 0]);
  expect(keyVelocity([])).toEqual([0, 0, 0]);
  const random = seeded();
  for (let run = 0; run < 200; ++run) {
    const codes = Object.keys(kKeys).filter(() => random() < 0.3);
    expect(Math.hypot(...keyVelocity(codes))).toBeLessThanOrEqual(kFullSpeed + 1e-12);
  }
});

test("keys that turn are those of the teleoperation client, whose z axis points away, and turn as fast", () => {
  const folder = `${process.env["TANDEM_SOURCE"] ?? ".."}/services/teleop`;
  const turns = /turns\{(.*?)\};/s.exec(readFileSync(`${folder}/keyboard.cpp`, "utf8"))![1]!;
  const keys = [...turns.matchAll(/\{'(.)', \{(-?\d), (-?\d), (-?\d)\}\}/g)].map(
    ([, key, x, y, z]): [string, number[]] => [`Key${key!.toUpperCase()}`, [Number(x), Number(y), -Number(z)]],
  );
  expect(keys.length).toBe(6);
  const plain = (vector: readonly number[]): number[] => vector.map((value) => value + 0); // no -0
  expect(Object.fromEntries(keys.map(([code, axis]) => [code, plain(axis)]))).toEqual(kTurnKeys);
  const speed = /kAngularSpeed = ([\d.]+);/.exec(readFileSync(`${folder}/device.h`, "utf8"))![1];
  expect(kFullTurn).toBe(Number(speed));
  expect(Object.keys(kTurnKeys).filter((code) => code in kKeys || code === "KeyC")).toEqual([]);
  const random = seeded();
  for (let run = 0; run < 200; ++run) {
    const codes = [...Object.keys(kTurnKeys), ...Object.keys(kKeys)].filter(() => random() < 0.3);
    expect(Math.hypot(...keyTurn(codes))).toBeLessThanOrEqual(kFullTurn + 1e-12);
    expect(Math.hypot(...keyTurn(Object.keys(kKeys)))).toBe(0);
  }
});

test("sticks: bounded, and nothing that is not a number goes through", () => {
  const buttons = (...down: number[]): { pressed: boolean; value: number }[] =>
    Array.from({ length: 17 }, (_, k) => ({ pressed: down.includes(k), value: 0 }));
  const pad = { axes: [1, -1, 0, 7], buttons: buttons(Button.hold) };
  expect(stickVelocity(pad)).toEqual([kFullSpeed, kFullSpeed, kFullSpeed]);
  expect(stickTurn(pad).map(Math.abs)).toEqual([0, 0, 0]);
  const turning = { ...pad, buttons: buttons(Button.hold, Button.turn) };
  expect(stickTurn(turning)).toEqual([kFullTurn, kFullTurn, kFullTurn]);
  expect(stickVelocity(turning).map(Math.abs)).toEqual([0, 0, 0]);
  for (const read of [stickVelocity, stickTurn])
    expect(read({ axes: [NaN], buttons: [] }).map(Math.abs)).toEqual([0, 0, 0]);
  expect(pressed(pad, Button.hold)).toBe(true);
  expect(pressed(pad, Button.clutch)).toBe(false);
  expect(buttonBits(pad)).toBe(1 << Button.hold);
});

test("a key counts as held while it repeats in time, and its silence is reported once", () => {
  vi.useFakeTimers();
  let missing = 0;
  const repeats = new Repeats(() => (missing += 1));
  repeats.seen(false);
  vi.advanceTimersByTime(kFirstRepeat - 1);
  for (let k = 0; k < 20; ++k) {
    repeats.seen(true);
    vi.advanceTimersByTime(kNextRepeat - 1);
  }
  expect(missing).toBe(0);
  vi.advanceTimersByTime(10 * kFirstRepeat);
  expect(missing).toBe(1);
  repeats.seen(false);
  repeats.end();
  vi.advanceTimersByTime(10 * kFirstRepeat);
  expect(missing).toBe(1);
  vi.useRealTimers();
});
