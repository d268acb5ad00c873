// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import { Log } from "../src/state/log";
import { Past } from "../src/state/past";
import { seeded } from "./random";

/** An answer of the server: events are their number as one byte. */
function answer(events: readonly number[]): ArrayBuffer {
  const out = new DataView(new ArrayBuffer(8 + 18 * events.length));
  events.forEach((event, k) => {
    const at = 8 + 18 * k;
    out.setUint32(at, 14, true);
    out.setUint8(at + 4, 1);
    out.setUint32(at + 5, event % 3, true);
    out.setBigUint64(at + 9, BigInt(1e6 * event), true);
    out.setUint8(at + 17, event);
  });
  return out.buffer;
}

test("each event is taken once and in order, however link and history overlap, over any number of connections", async () => {
  const random = seeded();
  for (let run = 0; run < 200; ++run) {
    const taken: [number, boolean][] = [];
    let before = false;
    let give: (bytes: ArrayBuffer) => void = () => {};
    const past = new Past(
      () => new Promise((resolve) => (give = resolve)),
      ({ channel, payload }) => ({ topic: `t${channel}`, message: payload.getUint8(0) }),
      (is) => (before = is),
    );
    const listeners = [0, 1, 2].map((k) => past.listen<number>(`t${k}`, (event) => taken.push([event, before])));
    let made = 0;
    for (let connection = 0; connection < 3; ++connection) {
      made += Math.floor(4 * random()); // nobody sees them but the server
      const first = made + 1;
      const opened = past.opened();
      const early = made + Math.floor(5 * random()); // the link brings these before the answer is there
      for (; made < early; ++made) listeners[(made + 1) % 3]!(made + 1, made + 1);
      const known = Math.min(made, Math.floor(first + (made + 1 - first) * random())); // which of them the answer has, too
      give(answer(Array.from({ length: Math.max(known, first - 1) }, (_, k) => k + 1)));
      await opened;
      const late = made + Math.floor(4 * random());
      for (; made < late; ++made) listeners[(made + 1) % 3]!(made + 1, made + 1);
    }
    expect(taken.map(([event]) => event)).toEqual(Array.from({ length: made }, (_, k) => k + 1));
  }
});

test("without an answer the link's events are taken all the same", async () => {
  const taken: number[] = [];
  const past = new Past(
    () => Promise.reject(new Error("no server")),
    () => null,
    () => {},
  );
  const listen = past.listen<number>("t", (event) => taken.push(event));
  const opened = past.opened();
  listen(1, 1);
  expect(taken).toEqual([]);
  await expect(opened).rejects.toThrow("no server");
  listen(2, 2);
  expect(taken).toEqual([1, 2]);
});

test("events of the past take their place by time; alarms that were acknowledged stay so", () => {
  const log = new Log();
  const urgent: string[] = [];
  log.urgent = (what) => urgent.push(what);
  log.known = [{ source: "robot", text: "first", time: 1010, acknowledged: 1500 }];
  log.add("info", "now", "page", 3000);
  log.past = true;
  log.add("alarm", "first", "robot", 1000);
  log.add("alarm", "second", "robot", 2000);
  log.past = false;
  expect(log.entries.map(({ text }) => text)).toEqual(["first", "second", "now"]);
  expect(log.open.map(({ text }) => text)).toEqual(["second"]);
  expect(urgent).toEqual([]);
  let kept: readonly unknown[] = [];
  log.acknowledging = (alarms) => (kept = alarms);
  log.acknowledge(log.open, 2500);
  expect(kept).toEqual([{ source: "robot", text: "second", time: 2000, acknowledged: 2500 }]);
  log.add("alarm", "third", "robot", 4000);
  expect(urgent).toEqual(["robot: third"]);
});
