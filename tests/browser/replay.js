// SPDX-License-Identifier: Apache-2.0
// Scenes of a replay: what it shows is what was recorded, it is never taken for the robot, and the robot comes first.
"use strict";
const assert = require("node:assert");
const { spawnSync } = require("node:child_process");
const fs = require("node:fs");
const path = require("node:path");

const kLocked = /A recording is shown, not the robot: return to live first\./;

module.exports = ({ robot, me, server, setting, enable, run, shot, takeControl, open: newPage }) => {
  const page = () => me().page;
  let file = ""; // of the recording
  const list = async () => {
    await me().tab("operate");
    await page().$eval("#replay-list", (details) => (details.open = false));
    await page().click("#replay-list > summary");
    await page().waitForSelector(`[data-file="${path.basename(file)}"]`);
  };
  const release = async () => {
    if (/this page/.test(await page().textContent("#lease"))) await me().press("#take");
    await me().text("#lease", /Control: free/);
  };
  const open = async () => {
    await release();
    await list();
    await me().press(`[data-file="${path.basename(file)}"]`);
    await me().state("#link", "replay");
  };
  const seek = (seconds) =>
    page().$eval(
      "#replay-scrub",
      (input, value) => {
        input.value = String(value);
        input.dispatchEvent(new Event("input"));
      },
      seconds,
    );
  /** The shown time, s from the beginning of the recording, once it is in a range and its samples are there. */
  const shownTime = async (least, most = Infinity) => {
    const found = await page().waitForFunction(
      ([from, to]) => {
        const text = document.querySelector("#replay-time").textContent;
        const [, minutes, seconds] = /^(\d+):([\d.]+) of/.exec(text) ?? [];
        const time = 60 * Number(minutes) + Number(seconds);
        return !/loading/.test(text) && time >= from && (to === null || time <= to) ? { time } : null;
      },
      [least, Number.isFinite(most) ? most : null],
    );
    return (await found.jsonValue()).time;
  };
  /** What was recorded of a topic, by `tandem export`: [s from the first message, value of each column whose name fits]. */
  const recorded = (topic, column, of = file) => {
    const folder = path.join(
      path.dirname(setting.deployment),
      `export-${path.basename(of)}-${topic.replace("/", "-")}`,
    );
    const words = ["export", of, "--csv", folder, "-t", topic];
    const done = spawnSync(path.join(setting.bin, "tandem"), words, { encoding: "utf8" });
    assert.strictEqual(done.status, 0, done.stderr);
    const [table] = fs.readdirSync(folder).filter((name) => name.includes(path.basename(topic)));
    const [head, ...rows] = fs.readFileSync(path.join(folder, table), "utf8").trim().split(/\r?\n/);
    const columns = head.split(",");
    const wanted = columns.flatMap((name, k) => (column.test(name) ? [k] : []));
    return rows.map((row) => {
      const cells = row.split(",");
      return [Number(cells[columns.indexOf("time_s")]), ...wanted.map((k) => Number(cells[k]))];
    });
  };

  return {
    async "replay: a recording is made, and who commands cannot look at the past"() {
      await takeControl();
      await me().press("#record");
      await me().text("#recording", /● RECORDING \d+ s, [1-9]/);
      await run();
      await page().fill("#record-mark-text", "it runs");
      await me().press("#record-mark");
      await me().text("#progress", /point [3-9]\d/);
      robot().command("stop");
      await robot().states("FAULT");
      await me().text("#recording", /[1-9]\d s|[6-9] s/);
      await me().press("#record");
      await me().text("#recording", /^Recorded/);
      file = await page().getAttribute("#recording", "title");
      await list();
      const refused = `[data-file="${path.basename(file)}"][aria-disabled="true"][title="This page has control: release it first."]`;
      let found = null; // a busy machine loses the lease
      for (let attempt = 0; attempt < 10 && !found; ++attempt) {
        await takeControl();
        found = await page()
          .waitForSelector(refused, { timeout: 3000 })
          .catch(() => null);
      }
      assert.ok(found, "a page that has control can start a replay");
    },

    async "replay: it is said to be one, and all commands are locked"() {
      await open();
      assert.strictEqual(await page().textContent("#link"), "⟲ REPLAY · not live");
      assert.strictEqual(await page().textContent("#replay-file"), path.basename(file));
      await me().text("#replay-when", /recorded \w+day,? \d+ \w+ 20\d\d.* \d\d:\d\d:\d\d/);
      const frame = await page().evaluate(
        () => getComputedStyle(document.querySelector("#app"), "::after").borderTopWidth,
      );
      assert.strictEqual(frame, "5px");
      for (const command of ["#take", "#enable", "#disable", "#pause", "#home", "#run-start", "#run-end", ".jog"])
        await page().waitForFunction(
          ([of, why]) => {
            const one = document.querySelector(of);
            return one.getAttribute("aria-disabled") === "true" && new RegExp(why).test(one.title);
          },
          [command, kLocked.source],
        );
      assert.ok(!/LIVE/.test(await page().evaluate(() => document.body.innerText)), "something says LIVE");
      assert.ok(await page().locator("#stop").isVisible());
    },

    async "replay: what is shown is what was recorded, at any time"() {
      const rows = recorded("arm_a/measured_js", /^position.*beta/).map(([at, ...q]) => [
        at,
        ...q.map((m) => 1000 * m),
      ]);
      assert.strictEqual(rows[0].length, 4);
      const length = rows.at(-1)[0];
      let largest = 0;
      for (const share of [0.95, 0.2, 0.6, 0.85, 0.4]) {
        await seek(share * length);
        const time = await shownTime(share * length - 0.02, share * length + 0.02);
        const near = rows.filter(([at]) => Math.abs(at - time) < 0.12);
        await page().waitForFunction(
          ([all]) => {
            const shown = [...document.querySelectorAll(".actuators:first-child .bar .number")].map((one) =>
              parseFloat(one.textContent),
            );
            return all.some((row) => [1, 2, 3].every((k) => Math.abs(row[k] - shown[k - 1]) < 0.006));
          },
          [near],
        );
        largest = Math.max(largest, ...rows[0].slice(1).map((q, k) => Math.abs(near[0][k + 1] - q)));
      }
      assert.ok(largest > 0.1, `the recorded arm moved by ${largest} mm only: this compares nothing`);
      await me().waitForScene("both arms drawn", (s) => s.blue > 100 && s.orange > 100);
    },

    async "replay: it runs at a speed, stands, and steps"() {
      await seek(1);
      await shownTime(0.9, 1.1);
      await me().choose("replay-speed", "2");
      const began = Date.now();
      await page().click("#replay-play");
      const reached = await shownTime(4);
      const took = (Date.now() - began) / 1000;
      assert.ok(reached - 1 < 2.2 * took + 0.6, `${reached - 1} s of the recording in ${took} s`);
      await seek(2);
      await shownTime(2);
      await page().click("#replay-back"); // whether it runs or has come to its end: now it stands
      await me().text("#replay-play", /Play/);
      const times = recorded("control/status", /none/).map(([at]) => at);
      const apart = (j) => times[j + 1] - times[j] > 0.06; // the page gets one of all samples of 50 ms
      const k = times.findIndex((at, j) => at > 2 && apart(j - 1) && apart(j));
      assert.ok(k > 0, "the recording has no two samples of control's status that a step can lead to");
      const middle = (times[k] + times[k + 1]) / 2;
      await seek(middle);
      await shownTime(middle - 0.006, middle + 0.006);
      await page().click("#replay-step");
      await shownTime(times[k + 1] - 0.001, times[k + 1] + 0.001);
      await page().click("#replay-back");
      await shownTime(times[k] - 0.001, times[k] + 0.001);
      await me().choose("replay-speed", "10");
      await page().click("#replay-play");
      await page().waitForFunction(() => document.querySelector("#replay-play").textContent === "Play"); // at the end
      await me().text("footer .chart:last-child .key", /cycle *0\.\d/); // the newest value, and it stays
    },

    async "replay: marks, runs, stops and faults are found, and lead to their time"() {
      await me().text("#replay-events", /⚑ \d+:\d\d\.\d\d it runs/);
      await me().text("#replay-events", /▶ [^▶]*A trajectory runs[^]*■ [^■]*Stop: tandem robot stop/);
      await page().locator('#replay-events [data-kind="mark"] button').click();
      await me().text("#progress", /running · point \d+ of 100/);
      await me().text("#replay-events", /✕ \d+:\d\d\.\d\d Arm A: stop_requested/);
      const button = page().locator('#replay-events [data-kind="fault"] button').first();
      const [, minutes, seconds] = /(\d+):([\d.]+)/.exec(await button.textContent());
      await page().click("#replay-back"); // stands, should it still run
      await me().text("#replay-play", /Play/);
      await button.click();
      const at = 60 * Number(minutes) + Number(seconds);
      await shownTime(at - 0.02, at + 0.02);
      await page().waitForSelector('.arm[data-arm="arm_a"][data-state="FAULT"]');
      await shot("console-replay");
      await page().click("#replay-end");
      await me().state("#link", "live");
      assert.strictEqual(await page().locator("#replay").isVisible(), false);
    },

    async "replay: a stop of the robot ends it and is said, and so does an own stop, which stops"() {
      await enable();
      await open();
      robot().command("stop");
      await me().state("#link", "live");
      await me().said(/Replay of .* has ended: .*stop/i);
      await page().waitForSelector('[data-fault="arm_a"]:not([hidden])');
      await enable();
      await open();
      await page().keyboard.press("Escape");
      await robot().until("stop", (s) => s.arms.every((arm) => /stop_requested/.test(arm.faults)));
      await me().text("#stop-note", /confirmed after \d+ ms/);
      await me().state("#link", "live");
      await takeControl();
    },

    async "replay: while another page moves the robot nothing says live, and what happens to the robot comes through"() {
      await enable();
      await release();
      const other = await newPage();
      await other.press("#take");
      await other.text("#lease", /Control: this page/);
      await list();
      let answer; // the server describes a large recording for seconds
      const asked = new Promise((come) => page().route("**/api/recordings/about*", (route) => come((answer = route))));
      await me().press(`[data-file="${path.basename(file)}"]`);
      await asked;
      robot().command("stop");
      await me().said(/Replay of .* has not begun: .*stop/i);
      const described = page().waitForResponse(/about/);
      await answer.continue();
      await described;
      await page().unroute("**/api/recordings/about*");
      await other.press("#disable");
      await robot().states("DISABLED");
      await other.press("#enable");
      await robot().states("ENABLED");
      await me().state("#link", "live");
      await list();
      await me().press(`[data-file="${path.basename(file)}"]`);
      await me().state("#link", "replay");
      await other.choose("trajectory", "line");
      await other.press("#run-start");
      await robot().moves("while another page replays");
      const text = await page().evaluate(() => document.querySelector("#app").innerText);
      assert.ok(!/LIVE/.test(text), `something says LIVE: ${text}`);
      const outdated = (than) =>
        [...document.querySelectorAll(".messages li")].filter((li) => /out of date/.test(li.textContent)).length > than;
      let before = 0;
      while (await page().evaluate(outdated, before)) ++before;
      process.kill(setting.pids.control, "SIGSTOP");
      try {
        await page().waitForFunction(outdated, before);
        assert.match(await page().textContent("#link"), /REPLAY · not live/);
      } finally {
        process.kill(setting.pids.control, "SIGCONT");
      }
      robot().command("stop");
      await me().said(/Replay of .* has ended: .*(stop|Arm)/i);
      await me().state("#link", "live");
      await other.page.context().close();
      await takeControl();
    },

    async "replay: another robot is shown as the recording describes it, and is named"() {
      const copy = path.join(path.dirname(file), "catheters.mcap");
      fs.copyFileSync(setting.catheters, copy);
      const names = () => page().$$eval(".bar .name", (all) => all.map((one) => one.textContent));
      const own = await names();
      await release();
      await list();
      await me().press('[data-file="catheters.mcap"]');
      await me().state("#link", "replay");
      await me().text("#replay-other", /^another robot or deployment: ablation-pair · ablation-pair, as the recording/);
      await me().text(".brand", /ablation-pair · ablation-pair/);
      await me().text("#legend", /grasped object/);
      await seek(1); // its first samples come one after the other
      await shownTime(0.99, 1.01);
      const answer = await fetch(`${server.url}/api/recordings/about?file=catheters.mcap`);
      const { description } = await answer.json();
      const joints = description.arms.flatMap((arm) => arm.joints.map((joint) => ({ arm: arm.name, ...joint })));
      assert.deepStrictEqual(
        await names(),
        joints.map(({ symbol }) => symbol),
      );
      assert.notDeepStrictEqual(await names(), own);
      const expected = description.arms.flatMap(({ name }) =>
        recorded(`${name}/measured_js`, /^position/, setting.catheters)[0].slice(1),
      );
      assert.strictEqual(expected.length, joints.length);
      await page().waitForFunction(
        (all) => {
          const shown = [...document.querySelectorAll(".bar .number")].map((one) => one.textContent);
          return all.every(
            ([value, unit], k) => shown[k].endsWith(unit) && Math.abs(parseFloat(shown[k]) - value) < 0.2,
          );
        },
        joints.map(({ translation }, k) =>
          translation ? [1000 * expected[k], " mm"] : [(180 / Math.PI) * expected[k], "°"],
        ),
      );
      await me().waitForScene("both catheters drawn", (s) => s.blue > 100 && s.orange > 100);
      for (const command of ["#take", "#enable", "#run-start", ".jog"])
        assert.match(await page().getAttribute(command, "title"), kLocked, command);
      await page().hover(".bar");
      await me().text("#span", /now|turns freely/);
      await shot("console-replay-other");
      await page().click("#replay-end");
      await me().state("#link", "live");
      assert.deepStrictEqual(await names(), own);
      await me().text(".brand", /ark2024 · laptop/);
      await me().waitForScene("both arms drawn", (s) => s.blue > 100 && s.orange > 100);
      fs.rmSync(copy);
    },

    async "replay: of other tubes, the range is computed for them, and teleoperation says why it is locked"() {
      const copy = path.join(path.dirname(file), "one-arm.mcap");
      fs.copyFileSync(setting.one_arm_recording, copy);
      await release();
      await list();
      await me().press('[data-file="one-arm.mcap"]');
      await me().state("#link", "replay");
      await seek(1);
      await shownTime(0.99, 1.01);
      await page().hover(".bar");
      await me().text("#span", /of arm \w+: (now|turns freely).*; green: where the tip gets/);
      await me().tab("teleoperate");
      await page().waitForFunction(
        (why) => new RegExp(why).test(document.querySelector("#teleop-on").title),
        kLocked.source,
      );
      const choices = await page().$$eval("#teleop-arm input, #teleop-mode input, #teleop-scale", (all) =>
        all.map((one) => one.disabled),
      );
      assert.ok(choices.length > 3 && choices.every((disabled) => disabled), "choices of another robot can be made");
      await shot("console-replay-teleoperate");
      await me().tab("operate");
      assert.strictEqual(await page().locator("#trajectory-yaml").isVisible(), false);
      await page().click("#replay-end");
      await me().state("#link", "live");
      fs.rmSync(copy);
      const about = await fetch(`${server.url}/api/recordings/span?file=${path.basename(file)}&joints=1,2&joint=0`);
      assert.strictEqual(about.status, 400);
      assert.match(await about.text(), /joints: found 2 numbers, expected 12/);
    },

    async "replay: files that cannot be shown are refused with the reason"() {
      const folder = path.dirname(file);
      const bytes = fs.readFileSync(file);
      const archive = path.join(__dirname, "../archive/5e7986a/recordings/lock-step.mcap");
      fs.writeFileSync(path.join(folder, "garbage.mcap"), "no recording");
      fs.writeFileSync(path.join(folder, "cut.mcap"), bytes.subarray(0, bytes.length / 2));
      fs.copyFileSync(archive, path.join(folder, "old.mcap"));
      const { fingerprint } = await (await fetch(`${server.url}/api/robot`)).json();
      const of = (text) => Buffer.from(text, "latin1");
      fs.writeFileSync(
        path.join(folder, "other.mcap"),
        of(bytes.toString("latin1").replace(fingerprint, "0123456789abcdef")),
      );
      fs.symlinkSync("/etc/passwd", path.join(folder, "passwd.mcap"));
      const ask = async (what) => {
        const answer = await fetch(`${server.url}/api/recordings/${what}`);
        return [answer.status, await answer.text()];
      };
      for (const [query, reason] of [
        ["about?file=garbage.mcap", /no MCAP file/],
        [
          "about?file=other.mcap",
          /another robot or deployment, ark2024 · laptop, recorded 20.*the configuration in it has other values/,
        ],
        ["about?file=old.mcap", /found no fingerprint of the robot, expected a recording that Tandem has made/],
        ["about?file=passwd.mcap", /no such file in the folder/],
        ["about?file=none.mcap", /no such file in the folder/],
        ["about?file=..%2f..%2fetc%2fpasswd.mcap", /expected the name of a recording/],
        ["about?file=/etc/passwd", /expected the name of a recording/],
        ["about", /expected the name of a recording/],
        [`samples?file=${path.basename(file)}&from=0&to=x&rate=20&topics=1`, /to: found 'x'/],
        [
          `samples?file=${path.basename(file)}&from=0&to=1&rate=20&topics=99999`,
          /topics: found .99999., expected numbers of channels/,
        ],
        [`samples?file=${path.basename(file)}&from=0&to=1&rate=0&topics=1`, /rate: found '0'/],
      ]) {
        const [status, text] = await ask(query);
        assert.strictEqual(status, 400, `${query}: ${status} ${text.slice(0, 200)}`);
        assert.match(text, reason, query);
      }
      const [status, text] = await ask("about?file=cut.mcap");
      assert.strictEqual(status, 200, text);
      assert.match(JSON.parse(text).damage[0], /incomplete/);
      await release();
      await list();
      await me().press('[data-file="other.mcap"]');
      await me().said(/Replay of other\.mcap refused: .*another robot or deployment/);
      await me().state("#link", "live");
      const operator = me(); // browsers log the refusal, which the page shows
      operator.complaints = operator.complaints.filter((text) => !/status of 400/.test(text));
      for (const name of ["garbage", "cut", "other", "old", "passwd"]) fs.rmSync(path.join(folder, `${name}.mcap`));
    },
  };
};
