// SPDX-License-Identifier: Apache-2.0
// Scenes of the log: what it contains, its search, filter and export, and alarms.
"use strict";
const assert = require("node:assert");
const fs = require("node:fs");
const { FrameLink } = require("./harness.js");

const kFlood = 20000; // lines: more than the page keeps

module.exports = ({ robot, me, server, takeControl, enable, run, shot, open }) => {
  const page = () => me().page;
  /** Waits for an entry of the log. */
  const logged = (pattern) => me().text("#log", pattern);

  return {
    async "the log has stops with their sender, faults, ends of runs and what others do"() {
      await run();
      await me().tab("log");
      await me().press("#run-end");
      await logged(/tandem-planning: line: ended by a client; \d+ of 100 points reached/);
      robot().command("stop");
      await logged(/Stop: tandem robot stop, by tandem-cli \(pid \d+ on [^)]+\)/);
      await logged(/robot: Arm A: stop_requested: a client requested a stop/);
      await logged(/robot: Arm B: ENABLED → FAULT/);
      const other = await open();
      await other.page.keyboard.press("Escape");
      await logged(/client [0-9a-f]{4}: Stop: operator's page at 127\.0\.0\.1: Esc/);
      await me().press("#take");
      await me().text("#lease", /Control: free/);
      await other.press("#take");
      await logged(/client [0-9a-f]{4} has control/);
      await other.press("#disable");
      await logged(/client [0-9a-f]{4}: disable/);
      await other.press("#enable");
      await robot().states("ENABLED");
      await logged(/client [0-9a-f]{4}: enable/);
      // Any client may take power away. Each has just started and ends at once: the console's reader may not have discovered it.
      const disabled = () =>
        page().$$eval(
          "#log li",
          (all) =>
            all.filter((li) => /(tandem-cli \(pid \d+ on [^)]+\)|client [0-9a-f]{4}): disable$/.test(li.textContent))
              .length,
        );
      const before = await disabled();
      for (let times = 1; times <= 4; ++times) assert.strictEqual(robot().command("disable").status, 0);
      await logged(/robot: Arm A: ENABLED → DISABLED/);
      await page().waitForFunction(
        (wanted) =>
          [...document.querySelectorAll("#log li")].filter((li) =>
            /(tandem-cli \(pid \d+ on [^)]+\)|client [0-9a-f]{4}): disable$/.test(li.textContent),
          ).length >= wanted,
        before + 4,
      );
      assert.strictEqual(await disabled(), before + 4, "a request is missing, or logged twice");
      await other.press("#take");
      await other.page.context().close();
      const times = await page().$$eval("#log time", (all) => all.map((time) => time.dateTime));
      assert.ok(
        times.every((time) => Math.abs(Date.now() - Date.parse(time)) < 600e3),
        "a time is wrong",
      );
      await shot("console-log");
    },

    async "the log survives a reload and the server: nothing is missing, twice, or an alarm again that was acknowledged"() {
      await me().tab("log");
      robot().command("stop");
      await logged(/Arm A: stop_requested[^]*Arm B: stop_requested|Arm B: stop_requested[^]*Arm A: stop_requested/);
      await me().press("#acknowledge");
      await page().waitForFunction(() => document.querySelector("#alarms").childElementCount === 0);
      // What the robot has done, and stops of others. Requests of this page have the name of a client after the reload.
      const lines = async () => {
        const all = await page().$$eval("#log li", (items) =>
          items
            .map((li) => ({
              time: Date.parse(li.querySelector("time").dateTime),
              source: li.querySelector("b")?.textContent ?? "",
              text: li.querySelector("span:last-of-type").textContent,
            }))
            .reverse(),
        );
        const events = all
          .filter(
            ({ source, text }) =>
              (source === "robot: " && !/has control|Control is free/.test(text)) || /^Stop: tandem/.test(text),
          )
          .map(({ time, text }) => [time, text]);
        return { oldest: all[0].time, events };
      };
      const known = await lines();
      console.log(`  ${known.events.length} events of the robot and stops`);
      for (const round of ["a reload", "another reload", "a restart of the server"]) {
        const operator = me();
        if (round === "a restart of the server") {
          const complaints = [...operator.complaints]; // browsers log that no server answers
          await server.kill("SIGTERM");
          await server.start();
          await me().load();
          operator.complaints = complaints;
        } else await me().load();
        await me().tab("log");
        await page().waitForFunction((n) => document.querySelectorAll("#log li").length >= n, known.events.length);
        const read = await lines();
        // The panel ends at a number of lines, which need not be the same event after a reload: from the first pause that both have.
        const oldest = Math.max(known.oldest, read.oldest) + 1000;
        const first = known.events.findIndex(
          ([time], k) => time > oldest && (k === 0 || time - known.events[k - 1][0] > 1000),
        );
        assert.ok(first >= 0, `no pause among ${known.events.length} events`);
        const before = known.events.slice(first);
        assert.ok(before.length >= 5, `only ${before.length} events to compare`);
        const after = read.events.filter(([time]) => time >= before[0][0] - 500 && time <= before.at(-1)[0] + 2000);
        const count = (all) => all.map(([, text]) => text).sort();
        assert.deepStrictEqual(count(after), count(before), `after ${round}`);
        const drift = Math.max(...after.map(([time], k) => Math.abs(time - before[k][0])));
        assert.ok(drift < 500, `a time has changed by ${drift} ms`);
        assert.deepStrictEqual(
          after.map(([time]) => time),
          after.map(([time]) => time).sort((a, b) => a - b),
          "the order of the times",
        );
        const alarms = await page().textContent("#alarms");
        assert.ok(!/stop_requested/.test(alarms), `after ${round} these alarms are open: ${alarms}`);
      }
      const other = await open(); // of somebody who has acknowledged nothing
      await other.page.waitForFunction(() => document.querySelector("#alarms").childElementCount >= 2);
      await other.tab("log");
      await other.text("#log", /Arm A: stop_requested/);
      await other.page.context().close();
      await enable();
    },

    async "a flood of lines is drawn as far as it is seen, alarms stay, and stop is confirmed"() {
      await enable();
      const link = new FrameLink(server);
      const other = await open(await link.start());
      robot().command("stop");
      await other.page.waitForFunction(() => document.querySelector("#alarms").childElementCount >= 2);
      const alarms = await other.page.$eval("#alarms", (list) => list.childElementCount);
      await enable();
      const text = "request: enable";
      const isLine = (one) => (one[0] & 15) === 2 && one.includes(text);
      await other.text(".messages", /client [0-9a-f]{4}: enable/);
      const line = link.frames.filter(isLine).at(-1);
      const [time, words] = [(line[1] < 126 ? 2 : 4) + 5, line.indexOf(text)]; // after header, opcode and subscription
      const flood = Array.from({ length: kFlood }, (_, k) => {
        const one = Buffer.from(line);
        one.writeBigUInt64LE(one.readBigUInt64LE(time) + BigInt(1000 * (k + 1)), time);
        one.write(String(k).padStart(text.length, "x"), words);
        return one;
      });
      await other.page.evaluate(() => {
        window.drawn = 0;
        const count = (changes) => changes.forEach(({ addedNodes }) => (window.drawn += addedNodes.length));
        new MutationObserver(count).observe(document.querySelector(".messages"), { childList: true });
      });
      link.insert([Buffer.concat(flood)]);
      await other.page.keyboard.press("Escape");
      await other.text("#stop-note", /confirmed after \d+ ms/);
      await other.text(".messages", new RegExp(`x${kFlood - 1}\\b`));
      const drawn = await other.page.evaluate("drawn");
      assert.ok(drawn < kFlood / 2, `${drawn} rows were drawn for ${kFlood} lines`);
      const after = await other.page.$eval("#alarms", (list) => list.childElementCount);
      assert.ok(after >= alarms + 2, `${alarms} alarms before, ${after} after the flood and another stop`);
      await other.page.context().close();
      link.close();
      await enable();
    },

    async "a full disk is reported, nothing is lost in silence, and stop stops"() {
      await enable();
      const operator = me();
      const again = async (largest) => {
        const complaints = [...operator.complaints]; // browsers log that no server answers
        await server.kill("SIGTERM");
        await server.start(largest);
        await operator.load();
        operator.complaints = complaints;
      };
      await again(8000);
      await operator.tab("log");
      robot().command("stop");
      await logged(/tandem-console: the events cannot be written for the next start; .*File too large/);
      await logged(/Arm A: stop_requested/);
      await enable();
      await operator.press("#record");
      await operator.text("#recording", /^✕ It ended early: .*File too large/);
      await operator.said(/Recording: ✕ It ended early: .*File too large/);
      await run();
      await page().keyboard.press("Escape");
      await robot().until("stop", (s) => s.arms.every((arm) => /stop_requested/.test(arm.faults)));
      await operator.text("#stop-note", /confirmed after \d+ ms/);
      await shot("console-full-disk");
      await again(0);
      await enable();
      await operator.tab("log");
    },

    async "the log is searched, filtered and exported"() {
      await enable();
      await me().tab("log");
      robot().command("stop");
      await logged(/Arm A: stop_requested[^]*Arm B: stop_requested|Arm B: stop_requested[^]*Arm A: stop_requested/);
      const count = () => page().$$eval("#log li", (all) => all.length);
      const all = await count();
      await page().fill("#log-search", "ROBOT stop_requested");
      await page().waitForFunction(() =>
        [...document.querySelectorAll("#log li")].every((li) => /Arm .*stop_requested/.test(li.textContent)),
      );
      const found = await count();
      assert.ok(found > 0 && found < all, `${found} of ${all}`);
      const [download] = await Promise.all([page().waitForEvent("download"), page().click("#log-export")]);
      const rows = fs
        .readFileSync(await download.path(), "utf8")
        .trim()
        .split("\r\n");
      assert.strictEqual(rows[0], "time,level,source,text,acknowledged");
      assert.strictEqual(rows.length, found + 1);
      assert.match(rows[1], /^\d{4}-\d\d-\d\dT[\d:.]+Z,alarm,"robot","Arm [AB]: stop_requested: /);
      await page().uncheck('[data-level="alarm"]');
      await me().text("#log-summary", /^0 of \d+ events/);
      await page().check('[data-level="alarm"]');
      await page().fill("#log-search", "");
      await enable();
    },

    async "each alarm stays until it is acknowledged, and sounds"() {
      await takeControl();
      await page().evaluate(() => {
        window.tones = [];
        const Plain = window.OscillatorNode;
        window.OscillatorNode = class extends Plain {
          constructor(context, options) {
            super(context, options);
            window.tones.push(options.frequency);
          }
        };
      });
      if (!(await page().$eval("#alarms", (list) => list.childElementCount === 0))) await me().press("#acknowledge");
      await page().waitForFunction(() => document.querySelector("#alarms").childElementCount === 0);
      await page().waitForSelector('#sound[aria-pressed="true"]'); // after the first click of a page
      for (let times = 1; times <= 2; ++times) {
        await enable();
        robot().command("stop");
        // Two arms have the fault: two alarms each time, although the texts are the same.
        await page().waitForFunction((n) => document.querySelector("#alarms").childElementCount === 2 * n, times);
      }
      const alarm = await page().evaluate(() => window.tones.filter((pitch) => pitch > 600).length);
      assert.ok(alarm >= 3, `${alarm} tones`);
      await page().waitForFunction((n) => window.tones.filter((pitch) => pitch > 600).length > n, alarm); // repeated
      await shot("console-alarms");
      await me().press("#acknowledge");
      await page().waitForFunction(() => document.querySelector("#alarms").childElementCount === 0);
      await me().tab("log");
      await logged(/Arm B: stop_requested.*\(acknowledged \d\d:\d\d:\d\d\.\d{3}\)/);
      await page().click("#sound");
      await page().waitForSelector('#sound[aria-pressed="false"]');
      await page().click("#sound");
      await me().tab("operate");
      await enable();
    },
  };
};
