// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import { Currency } from "../src/panels/currency";
import type { LinkState } from "../src/wire/link";

type Arguments = ConstructorParameters<typeof Currency>;

/** The robot's data as the test says. */
function current() {
  const data = { live: true, control: true, heldBack: false, silent: "", link: "open" as LinkState };
  const [status, hal] = [{}, {}];
  const world = {
    status,
    hal,
    live: () => data.live,
    planningSilent: () => data.silent,
    heldBack: () => data.heldBack,
    stale: (slot: object) => slot === status && !data.control,
    age: () => 1000,
  };
  const said: string[] = [];
  const link = {
    get state() {
      return data.link;
    },
    receivedAt: 0,
  };
  const found = new Currency({ lock_step: false }, world as unknown as Arguments[1], link, {
    add: (level, text) => said.push(`${level}: ${text}`),
  });
  return { data, found, said };
}

test("each change of the data is said once, in the words of the status", () => {
  const { data, found, said } = current();
  const step = (change: Partial<typeof data>): string[] => {
    Object.assign(data, change);
    said.length = 0;
    for (const now of [1000, 1050]) found.update(now);
    return [found.state, ...said];
  };
  expect(step({})).toEqual(["live", "info: The data is current"]);
  expect(step({ silent: "2 s old" })).toEqual([
    "partly",
    "bad: Planning no longer publishes: its last data is 2 s old",
  ]);
  expect(step({ silent: "" })).toEqual(["live", "info: Planning publishes again"]);
  expect(step({ live: false, control: false })[0]).toBe("stale");
  expect(said).toEqual(["bad: The data is out of date: NO DATA FROM CONTROL · 1.0 s old"]);
  expect(step({ live: true, control: true })).toEqual(["live", "info: The data is current"]);
  expect(step({ live: false })).toEqual(["stale", "bad: The data is out of date: NO DATA FROM DRIVES · 1.0 s old"]);
  expect(step({ link: "closed" })).toEqual(["lost"]); // an event of its own
});
