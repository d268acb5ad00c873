// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import type { Answer } from "../src/state/commander";
import { Orders, stopIsRepeated } from "../src/state/orders";

const kAccepted: Answer = { accepted: true, code: 0, reason: "", value: 7, took: 1 };

function orders(): { given: Orders; said: string[] } {
  const said: string[] = [];
  return { given: new Orders((level, text) => said.push(`${level}: ${text}`)), said };
}

test("an order is done when its effect is there, and not when it is accepted", async () => {
  const { given, said } = orders();
  let there = false;
  await given.give("Enable", Promise.resolve(kAccepted), { there: ({ value }) => there && value === 7, within: 1e6 });
  given.look(performance.now());
  expect(said).toEqual([]);
  there = true;
  given.look(performance.now());
  given.look(performance.now());
  expect(said.length).toBe(1);
  expect(said[0]).toMatch(/^done: Enable: done after \d+\.\d s$/);
});

test("an effect that is prevented, or does not come, is reported once", async () => {
  const { given, said } = orders();
  let why = "";
  await given.give("Home", Promise.resolve(kAccepted), { there: () => false, prevented: () => why, within: 0 });
  await given.give("Pause", Promise.resolve(kAccepted), { there: () => false, within: 2000 });
  given.look(performance.now() + 1000);
  expect(said).toEqual([]);
  given.look(performance.now() + 3000);
  expect(said).toEqual(["bad: Pause: NOT done: no effect within 2 s"]);
  why = "an arm is PAUSED";
  given.look(performance.now() + 9e9);
  given.look(performance.now() + 9e9);
  expect(said.slice(1)).toEqual(["bad: Home: NOT done: an arm is PAUSED"]);
});

test("a refusal is reported at once, and effects that can no longer be seen are not done", async () => {
  const { given, said } = orders();
  const refused = { ...kAccepted, accepted: false, reason: "take control first" };
  expect(await given.give("Start", Promise.resolve(refused), { there: () => true, within: 1 })).toBe(false);
  await given.give("Disable", Promise.resolve(kAccepted), { there: () => true, within: 1 });
  given.abandon("the connection was lost");
  given.look(performance.now());
  expect(said).toEqual([
    "bad: Start refused: take control first",
    "bad: Disable: accepted, effect not known: the connection was lost",
  ]);
});

test("a stop is repeated on its connection; on a later one only while the lease may last", () => {
  expect(stopIsRepeated(60_000, true, 2)).toBe(true);
  expect(stopIsRepeated(1900, false, 2)).toBe(true);
  expect(stopIsRepeated(2100, false, 2)).toBe(false);
});
