// SPDX-License-Identifier: Apache-2.0
import { parse } from "@foxglove/rosmsg";
import { MessageWriter } from "@foxglove/rosmsg2-serialization";
import { afterEach, expect, test, vi } from "vitest";

import { Player } from "../src/state/player";
import { packed } from "./packed";
import { seeded } from "./random";

const kTopic = "/tandem/control/status";
const kChannel = 7;
const kDefinition = "uint32 number";
const kStart = 1.7e12; // ms

afterEach(() => vi.unstubAllGlobals());

/** A recording whose samples have these times, ms, and a server whose answers come when the test says. */
function recording(times: readonly number[]) {
  const writer = new MessageWriter(parse(kDefinition, { ros2: true }));
  const answers: (() => void)[] = [];
  const ask = (url: string): Promise<Response> => {
    const query = new URL(url, "http://console").searchParams;
    const [from, to] = [Number(query.get("from")), Number(query.get("to"))];
    const samples = times.flatMap((time, number) =>
      time >= from && time <= to
        ? [{ channel: kChannel, time: BigInt(time) * 1_000_000n, bytes: [...writer.writeMessage({ number })] }]
        : [],
    );
    return new Promise((resolve) =>
      answers.push(() => resolve(new Response(packed(BigInt(Math.ceil(to)) * 1_000_000n, samples)))),
    );
  };
  vi.stubGlobal("fetch", ask);
  const failures: string[] = [];
  const about = { file: "a.mcap", robot: "", deployment: "", messages: times.length, marks: [], damage: [] };
  const player = new Player(
    {
      ...about,
      start_ms: times[0]!,
      end_ms: times.at(-1)!,
      channels: [{ id: kChannel, topic: kTopic, type: "a" }],
      definitions: { a: kDefinition },
      description: null,
    },
    (why) => failures.push(why),
  );
  return { player, answers, failures, slot: player.subscribe<{ number: number }>(kTopic) };
}
/** Lets everything run that waits for nothing else. */
const flush = (): Promise<void> => new Promise((resolve) => setTimeout(resolve, 0));

function randomTimes(random: () => number): number[] {
  const times = [kStart];
  while (times.length < 150) times.push(times.at(-1)! + 1 + Math.floor((random() < 0.02 ? 9000 : 300) * random()));
  return times;
}

test("after any seeks and steps the last one is shown, in whatever order the server answers", async () => {
  const random = seeded();
  for (let run = 0; run < 100; ++run) {
    const times = randomTimes(random);
    const { player, answers, failures, slot } = recording(times);
    let expected = kStart;
    const answerSome = async (share: number): Promise<void> => {
      while (answers.length > 0 && random() < share) {
        answers.splice(Math.floor(answers.length * random()), 1)[0]!();
        await flush();
      }
    };
    void player.seek(expected);
    for (let move = 0; move < 8; ++move) {
      await answerSome(0.6);
      if (random() < 0.4) {
        expected = Math.floor(kStart + (times.at(-1)! - kStart) * random());
        void player.seek(expected);
      } else if (random() < 0.5) {
        expected = times.find((time) => time > expected) ?? expected;
        void player.step(1);
      } else {
        expected = times.filter((time) => time < expected).at(-1) ?? expected;
        void player.step(-1);
      }
      if (random() < 0.3) await flush();
    }
    for (await flush(); answers.length > 0; await flush()) await answerSome(1);
    expect(player.time).toBeCloseTo(expected, 2);
    expect(player.waiting).toBe(false);
    expect(slot.value<{ number: number }>()?.number).toBe(times.filter((time) => time <= expected).length - 1);
    expect(failures).toEqual([]);
  }
});

test("what stands does not wait for samples to run on", async () => {
  const { player, answers } = recording([kStart, kStart + 4000, kStart + 20_000]);
  void player.seek(kStart + 4000);
  answers.shift()!();
  await flush();
  player.playing = true;
  for (let now = 0; !player.waiting; now += 200) player.tick(now); // up to what is not here yet
  player.playing = false;
  player.tick(10_000);
  expect(player.waiting).toBe(false);
});

test("a server that fails is said, and a later seek is not ended by it", async () => {
  const { player, answers, failures, slot } = recording([kStart, kStart + 6000, kStart + 60_000]);
  const answering = fetch;
  vi.stubGlobal("fetch", () => Promise.reject(new Error("no server")));
  const lost = player.seek(kStart + 60_000);
  vi.stubGlobal("fetch", answering);
  void player.seek(kStart);
  await lost;
  while (answers.length > 0) {
    answers.shift()!();
    await flush();
  }
  expect(failures).toEqual([]);
  expect(slot.value<{ number: number }>()?.number).toBe(0);
  vi.stubGlobal("fetch", () => Promise.reject(new Error("no server")));
  await player.seek(kStart + 60_000);
  expect(failures).toEqual(["Error: no server"]);
  expect(player.waiting).toBe(false);
});

test("samples that cannot be had leave the time that is shown", async () => {
  const { player, answers, failures, slot } = recording([kStart, kStart + 40_000, kStart + 90_000]);
  void player.seek(kStart + 90_000);
  for (await flush(); answers.length > 0; await flush()) answers.shift()!();
  expect(slot.value<{ number: number }>()?.number).toBe(2);
  vi.stubGlobal("fetch", () => Promise.reject(new Error("cut")));
  void player.seek(kStart + 20_000);
  await player.seek(kStart + 10_000); // before it the slots have nothing, and the last sample would pass for a new one
  expect(failures).toEqual(["Error: cut"]);
  expect(player.time).toBe(kStart + 90_000);
  expect(slot.value<{ number: number }>()?.number).toBe(2);
  await player.step(-1);
  expect(player.time).toBe(kStart + 90_000);
});
