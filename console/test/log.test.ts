// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import type { Level } from "../src/state/log";
import { clockTime, keepAcknowledged, Log, toCsv } from "../src/state/log";
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

/** The storage of a browser's tab. */
function tab() {
  const kept = new Map<string, string>();
  return {
    getItem: (key: string) => kept.get(key) ?? null,
    setItem: (key: string, value: string) => void kept.set(key, value),
  };
}

test("after a reload those alarms are acknowledged that were before, and no other, whenever it came", () => {
  const random = seeded();
  for (let run = 0; run < 100; ++run) {
    const storage = tab();
    const times = Array.from({ length: 20 }, (_, k) => 1e12 + 2000 * k + 900 * random());
    const texts = times.map(() => (random() < 0.5 ? "Arm A: stop_requested" : "Arm B: stop_requested"));
    let seen = new Set<number>();
    for (let load = 0; load < 4; ++load) {
      const log = new Log();
      keepAcknowledged(log, "f", storage);
      // The clocks are compared again: the times differ a little.
      const offset = 200 * random() - 100;
      log.past = true;
      times.forEach((time, k) => log.add("alarm", texts[k]!, "robot", time + offset));
      log.past = false;
      expect(log.entries.map(({ acknowledged }) => acknowledged !== 0)).toEqual(times.map((_, k) => seen.has(k)));
      // The operator sees some of them, not always the oldest ones.
      const open = log.open.filter(() => random() < 0.3);
      seen = new Set([...seen, ...open.map((entry) => log.entries.indexOf(entry))]);
      log.acknowledge(open, 5000 + load);
    }
  }
});

test("a kept acknowledgement is that of one alarm, with its time, and of the same robot", () => {
  const storage = tab();
  const load = (fingerprint: string): Log => {
    const log = new Log();
    keepAcknowledged(log, fingerprint, storage);
    log.past = true;
    log.add("alarm", "fault", "robot", 1000);
    log.add("alarm", "fault", "robot", 1100);
    log.past = false;
    return log;
  };
  const first = load("f");
  first.acknowledge([first.entries[1]!], 7);
  first.acknowledge([first.entries[1]!], 8); // it is acknowledged already
  expect(load("f").entries.map(({ acknowledged }) => acknowledged)).toEqual([0, 7]);
  expect(load("another").open.length).toBe(2);
});

test("an alarm with another text, source or time than the acknowledged one is open after a reload", () => {
  const storage = tab();
  const first = new Log();
  keepAcknowledged(first, "f", storage);
  first.add("alarm", "fault", "robot", 10_000);
  first.acknowledge(first.entries);
  for (const [text, source, time, open] of [
    ["fault", "robot", 10_400, 0],
    ["another", "robot", 10_000, 1],
    ["fault", "client 1f3a", 10_000, 1],
    ["fault", "robot", 10_600, 1],
    ["fault", "robot", 2000, 1], // earlier than the acknowledged one, and seen by nobody
  ] as const) {
    const log = new Log();
    keepAcknowledged(log, "f", storage);
    log.past = true;
    log.add("alarm", text, source, time);
    log.past = false;
    expect(log.open.length).toBe(open);
  }
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

test("events of another day have its date", () => {
  const at = new Date(2026, 10, 27, 14, 3, 22, 7).getTime();
  expect(clockTime(at, at + 1000)).toBe("14:03:22.007");
  expect(clockTime(at, at + 86_400_000)).toBe("27 Nov 14:03:22.007");
});

test("a text that a spreadsheet would compute is a text in the CSV", () => {
  const log = new Log();
  const kTexts = ['=HYPERLINK("http://a")', "+1", "-1", "@SUM(A1)", "\t=1", "\r=1"];
  for (const text of kTexts) log.add("info", text, text, 0);
  log.add("info", "Arm A: a = 1", "robot", 0);
  const cells = [...toCsv(log.entries).matchAll(/"((?:[^"]|"")*)"/g)].map((m) => m[1]!.replaceAll('""', '"'));
  expect(cells).toEqual([...kTexts.flatMap((text) => [`'${text}`, `'${text}`]), "robot", "Arm A: a = 1"]);
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
  const safe = (text: string): string => (/^[=+@\t\r-]/.test(text) ? `'${text}` : text);
  expect(fields).toEqual(log.entries.flatMap(({ source, text }) => [safe(source), safe(text)]));
  expect(toCsv(log.entries)).toContain('1970-01-01T00:00:00.007Z,info,"client ""7"""');
});
