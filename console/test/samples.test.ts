// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import { whyNoReplay } from "../src/state/permission";
import { parseSamples } from "../src/wire/samples";
import { packed } from "./packed";
import { seeded } from "./random";

test("samples are read as the server packs them, and a part of an answer is an error", () => {
  const random = seeded();
  for (let run = 0; run < 100; ++run) {
    const samples = Array.from({ length: Math.floor(6 * random()) }, () => ({
      channel: Math.floor(1000 * random()),
      time: BigInt(Math.floor(1e15 * random())) * 1000n,
      bytes: Array.from({ length: Math.floor(9 * random()) }, () => Math.floor(256 * random())),
    }));
    const answer = packed(123_000_000n, samples);
    const read = parseSamples(answer);
    expect(read.reached).toBe(123);
    expect(
      read.samples.map(({ channel, time, payload }) => ({
        channel,
        time: Math.round(1000 * time),
        bytes: Array.from({ length: payload.byteLength }, (_, k) => payload.getUint8(k)),
      })),
    ).toEqual(samples.map(({ channel, time, bytes }) => ({ channel, time: Number(time / 1000n), bytes })));
    const ends = [8];
    for (const { bytes } of samples) ends.push(ends.at(-1)! + 17 + bytes.length);
    const cut = Math.floor(answer.byteLength * random());
    if (ends.includes(cut)) expect(parseSamples(answer.slice(0, cut)).samples.length).toBe(ends.indexOf(cut));
    else expect(() => parseSamples(answer.slice(0, cut))).toThrow(/samples: /);
  }
});

test("who has control does not look at the past", () => {
  expect(whyNoReplay({ lease: "mine" })).toMatch(/has control/);
  expect(whyNoReplay({ lease: "free" })).toBe("");
  expect(whyNoReplay({ lease: "another's" })).toBe("");
});
