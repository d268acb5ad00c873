// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import { Services } from "../src/state/services";
import type { DiagnosticArray } from "../src/wire/messages";

const says = (name: string, level: number, message: string): DiagnosticArray =>
  ({ status: [{ name, level, message, values: [] }] }) as unknown as DiagnosticArray;
const conditions = (services: Services, now: number): Record<string, string> =>
  Object.fromEntries(services.all(now).map(({ name, condition }) => [name, condition]));

test("a service has the level of its last report, until it has reported nothing for three seconds", () => {
  const services = new Services();
  services.received(says("a", 0, "runs"), 0);
  services.received(says("b", 2, "a bus is down"), 1000);
  expect(conditions(services, 3000)).toEqual({ a: "ok", b: "error" });
  expect(conditions(services, 3001)).toEqual({ a: "silent", b: "error" });
  services.received(says("a", 1, "late"), 3500);
  expect(conditions(services, 3600)).toEqual({ a: "warning", b: "error" });
});

test("a service that says that it ends has ended, and is not silent later", () => {
  const services = new Services();
  services.received(says("a", 3, "ended: SIGINT (Ctrl-C)"), 0);
  services.received(says("b", 3, "waits for control"), 0);
  expect(conditions(services, 10)).toEqual({ a: "ended", b: "stale" });
  expect(conditions(services, 10_000)).toEqual({ a: "ended", b: "silent" });
  services.received(says("a", 0, "runs"), 20_000);
  expect(conditions(services, 20_000)).toEqual({ a: "ok", b: "silent" });
});

test("a service that was killed, and cannot say so, is named before those that ended for it", () => {
  const services = new Services();
  services.received(says("sim", 0, "runs"), 0);
  services.received(says("control", 0, "runs"), 0);
  services.received(says("sim", 3, "ended: SIGTERM"), 500);
  expect(services.gone(1000)).toEqual(["sim ended: SIGTERM"]);
  expect(services.gone(4000)).toEqual([
    "control no longer reports: its last report is 4.0 s old",
    "sim ended: SIGTERM",
  ]);
});

test("the process that died is named as `tandem up` names it, until the system runs again", () => {
  const services = new Services();
  const died = "tandem up: control (pid 4711) was killed by signal 9 (Killed)";
  services.received(says("sim", 0, "runs"), 0);
  services.stopped("operator's page: Esc", 500);
  expect(services.gone(500)).toEqual([]);
  services.stopped(died, 1000);
  services.received(says("sim", 0, "runs"), 1500);
  expect(services.gone(2000)).toEqual([died]);
  services.received(says("sim", 3, "ended: SIGTERM"), 2500);
  expect(services.gone(3000)).toEqual([died, "sim ended: SIGTERM"]);
  services.received(says("sim", 0, "runs"), 40_000);
  expect(services.gone(40_000)).toEqual([]);
});

test("each silence and each return is a change once; an end is none", () => {
  const services = new Services();
  services.received(says("a", 0, "runs"), 0);
  services.received(says("b", 3, "ended: it is done"), 0);
  expect(services.changes(3000)).toEqual([]);
  expect(services.changes(3001)).toEqual([{ name: "a", silent: true, age: "3.0 s old" }]);
  expect(services.changes(9000)).toEqual([]);
  services.received(says("a", 0, "runs"), 9500);
  expect(services.changes(9600)).toEqual([{ name: "a", silent: false, age: "100 ms old" }]);
  expect(services.changes(9700)).toEqual([]);
});
