// SPDX-License-Identifier: Apache-2.0
// positions.js SETTING: positions after power on that nobody has confirmed: what the page shows, and what its button needs.
"use strict";
const assert = require("node:assert");
const { spawnSync } = require("node:child_process");
const path = require("node:path");
const { Operator, operated } = require("./harness.js");

const kHold = 10000; // ms: the HAL asks for 3 s

void operated(async ({ setting, server, robot, browser }) => {
  const me = await Operator.open(browser, server.url);
  // Homing requests of others are in the log: who, which joints, and the result.
  const home = spawnSync(path.join(setting.bin, "tandem"), ["home", "-d", setting.deployment], { encoding: "utf8" });
  assert.notStrictEqual(home.status, 0, home.stdout);
  await me.said(/tandem-cli[^]*refused: home the drives of arm \(beta_1, beta_2, alpha_1, alpha_2\): arm: .*--confirm/);
  await me.text("#lease", /Control: free/);
  await me.press("#take");
  await me.text("#lease", /Control: this page/);
  // The first start: every joint, with what is measured and why there is nothing to compare it with.
  const notice = await me.text("#unconfirmed", /Position not confirmed/);
  for (const words of [/beta_1 of arm [A-Z]+: -150\.0\d mm measured/, /beta_2 of/, /alpha_1 of/, /alpha_2 of/])
    assert.match(notice, words);
  assert.match(notice, /nothing to compare it with: no last position is stored/);
  const before = await robot.until("say it, too", (s) => s.unconfirmed.length === 4);
  assert.match(before.unconfirmed[0].text, /arm beta_1: position not confirmed: -150\.0\d\d mm measured/);
  await me.page.waitForSelector('#enable[aria-disabled="true"]');
  // A press is no confirmation.
  const button = "#confirm-positions";
  await me.press(button);
  await me.page.waitForTimeout(1500);
  await robot.until("ask still", (s) => s.unconfirmed.length === 4);
  const confirmed = robot.until("know the positions", (s) => s.unconfirmed.length === 0);
  await me.hold(button, confirmed, kHold);
  await me.said(/Confirmed: beta_1 of arm/);
  await me.page.waitForSelector("#unconfirmed", { state: "hidden" });
  await me.page.waitForSelector(button, { state: "hidden" });
  await me.press("#enable");
  await robot.states("ENABLED");
  assert.deepStrictEqual(me.complaints, []);
});
