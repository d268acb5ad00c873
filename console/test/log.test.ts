// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import type { Level } from "../src/state/log";
import { Log, toCsv } from "../src/state/log";
import { seeded } from "./random";

const kLevels: Level[] = ["done", "info", "bad", "alarm"];
const kAll = new Set(kLevels);

test("no alarm is lost, however many events come, and open ones stay open until they are acknowledged", () => {
  const random = seeded();
  for (let run = 0; run < 30; ++run) {
    const most = 1 + Math.floor(40 * random());
    const log = new Log(most);
    const open: string[] = [];
    let alarms = 0;
    let all = 0;
    for (let step = 0; step < 300; ++step) {
      if (random() < 0.02) {
        const seen = log.open.slice(0, Math.floor(3 * random()));
        log.acknowledge(seen);
        open.splice(0, seen.length);
      }
      const level = kLevels[Math.floor(4 * random() * random())]!;
      const text = random() < 0.5 ? "the same again" : `event ${step}`;
      log.add(level, text);
      all += 1;
      if (level !== "alarm") continue;
      alarms += 1;
      open.push(text);
    }
    expect(log.open.map(({ text }) => text)).toEqual(open);
    expect(log.find({ levels: new Set(["alarm"]), search: "" }).length).toBe(alarms);
    expect(log.entries.length + log.leftOut).toBe(all);
    expect(log.entries.length).toBeLessThanOrEqual(Math.max(most, alarms));
  }
});

test("an alarm that comes while others are acknowledged stays open", () => {
  const log = new Log();
  log.add("alarm", "seen");
  const seen = log.open;
  log.add("alarm", "too late to be seen");
  log.acknowledge(seen, 5);
  expect(log.open.map(({ text }) => text)).toEqual(["too late to be seen"]);
  log.acknowledge(log.entries, 9);
  expect(log.entries.map(({ acknowledged }) => acknowledged)).toEqual([5, 9]);
});

test("search finds entries with all words, in text and source, in any case", () => {
  const log = new Log();
  log.add("info", "Arm A: DISABLED → ENABLED", "robot");
  log.add("bad", "home refused: another client has the control lease", "client 1f3a");
  log.add("alarm", "Arm B: stop_requested", "robot");
  const texts = (search: string, levels: ReadonlySet<Level> = kAll): string[] =>
    log.find({ levels, search }).map(({ source }) => source);
  expect(texts("arm ROBOT").length).toBe(2);
  expect(texts(" lease  1F3A ")).toEqual(["client 1f3a"]);
  expect(texts("", new Set<Level>(["alarm"]))).toEqual(["robot"]);
  expect(texts("arm nowhere")).toEqual([]);
});

test("CSV keeps every character of the texts", () => {
  const random = seeded();
  const kCharacters = ['"', ",", "\n", "\r\n", "a", "→", "=", " "];
  const log = new Log();
  for (let k = 0; k < 200; ++k) {
    const text = Array.from({ length: 6 }, () => kCharacters[Math.floor(kCharacters.length * random())]).join("");
    log.add("info", text, `client "${k}"`, k);
  }
  // A reader by RFC 4180, of quoted fields.
  const fields = [...toCsv(log.entries).matchAll(/"((?:[^"]|"")*)"/g)].map((m) => m[1]!.replaceAll('""', '"'));
  expect(fields).toEqual(log.entries.flatMap(({ source, text }) => [source, text]));
  expect(toCsv(log.entries)).toContain('1970-01-01T00:00:00.007Z,info,"client ""7"""');
});
