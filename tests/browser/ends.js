// SPDX-License-Identifier: Apache-2.0
// Scenes of ends: what the page says when its server or the robot's processes end, and that nothing moves when they are back.
"use strict";
const assert = require("node:assert");
const { spawn } = require("node:child_process");
const path = require("node:path");
const { FrameLink, monotonic } = require("./harness.js");

module.exports = ({ robot, me, server, setting, enable, run, shot, open, takeControl }) => {
  const page = () => me().page;

  return {
    async "a message of another system is not used, wherever it is inserted"() {
      // What another system would send: the same robot, in another state, on a connection of its own.
      const theirs = new FrameLink(server);
      const link = new FrameLink(server);
      const [there, here] = [await open(await theirs.start()), await open(await link.start())];
      try {
        await enable();
        await there.page.waitForSelector('.arm[data-state="ENABLED"]');
        theirs.frames.length = 0;
        const seen = monotonic();
        await robot().until("publish further states", (s) => s.stamps_ns.status / 1e6 > seen + 1000);
        const enabled = theirs.frames.filter((frame) => frame[0] === 0x82);
        assert.ok(enabled.length > 20, `${enabled.length} messages of the other system`);
        const text = JSON.stringify({ op: "status", level: 2, message: "another system speaks" });
        const status = Buffer.from([0x81, text.length, ...Buffer.from(text)]);
        await takeControl();
        await me().press("#disable");
        await robot().states("DISABLED");
        await here.page.waitForSelector('.arm[data-state="DISABLED"]');
        await here.page.evaluate(() => {
          window.states = new Set();
          const look = () => document.querySelectorAll(".arm").forEach((arm) => window.states.add(arm.dataset.state));
          new MutationObserver(look).observe(document.querySelector(".arms"), { subtree: true, attributes: true });
        });
        for (const inserted of [enabled, [status]]) {
          const connections = link.clients.length;
          link.insert(inserted);
          await here.text(".messages", /The link is down: a message of another system came/);
          const back = monotonic() + 60_000;
          while (link.clients.length === connections && monotonic() < back)
            await new Promise((again) => setTimeout(again, 50));
          await here.state("#link", "live");
        }
        const states = await here.page.evaluate(() => [...window.states]);
        assert.ok(!states.includes("ENABLED"), `the page has shown ${states}`);
        assert.doesNotMatch(await here.page.textContent(".messages"), /another system speaks/);
        await here.text(".messages", /The link is down[^]*The link is down/); // for both
      } finally {
        for (const one of [there, here]) await one.page.context().close();
        for (const one of [theirs, link]) one.close();
      }
    },

    async "a page that hangs whenever it connects, as on a busy machine, is connected by the first attempt"() {
      const context = await me().page.context().browser().newContext();
      const busy = await context.newPage();
      await busy.addInitScript(() => {
        const Real = WebSocket;
        window.attempts = 0;
        window.WebSocket = class extends Real {
          constructor(...all) {
            super(...all);
            window.attempts += 1;
            const end = performance.now() + 4500;
            setTimeout(() => {
              while (performance.now() < end);
            });
          }
        };
      });
      try {
        await busy.goto(server.url);
        await busy.waitForSelector('#link[data-state="live"]');
        assert.strictEqual(await busy.evaluate(() => window.attempts), 1);
      } finally {
        await context.close();
      }
    },

    async "a server that ends says so last, and why; nothing moves when it is back"() {
      await run();
      const ended = /tandem-console ended: SIGTERM \(another process asked for it/;
      server.process.kill("SIGTERM");
      await server.ended;
      await me().state("#link", "lost");
      await me().text("#curtain", ended);
      await me().said(ended);
      await robot().until("stop without a commander", (s) => s.arms.every((arm) => /lease_lost/.test(arm.faults)));
      await robot().stands("without a server", monotonic());
      const back = monotonic();
      await server.start();
      await me().state("#link", "live");
      await me().text("#lease", /Control: free/);
      await robot().stands("after the server is back", back);
      assert.ok(robot().changed < back, "a joint moved after the server was back");
      await enable();
    },

    async "a stop that was not confirmed does not stop, over a new connection, what another client has enabled since"() {
      await run();
      process.kill(setting.pids.control, "SIGSTOP");
      const pressed = await page().evaluate(() => performance.now());
      try {
        await me().state("#link", "stale");
        await page().keyboard.press("Escape");
        await me().text("#stop-note", /NOT CONFIRMED/);
        await server.kill();
        await me().state("#link", "lost");
      } finally {
        process.kill(setting.pids.control, "SIGCONT");
      }
      await robot().until("stop", (s) => s.arms.every((arm) => /stop_requested/.test(arm.faults)));
      await page().waitForFunction((since) => performance.now() > since + 4000, pressed); // the lease of 3 s is over
      assert.strictEqual(robot().command("disable").status, 0);
      assert.strictEqual(robot().command("enable").status, 0);
      const back = monotonic();
      await server.start();
      await me().state("#link", "live");
      const enabled = ({ operating_state: state }) => state === "ENABLED";
      await robot().until("be watched for a second", (s) => s.stamps_ns.status / 1e6 > back + 1000);
      assert.ok(robot().last.arms.every(enabled), JSON.stringify(robot().last.arms));
    },

    async "a system that ends says which process and why; nothing moves when another has started"() {
      await run();
      process.kill(setting.pids.control, "SIGTERM"); // `tandem up` then ends all others
      await me().text(
        "#curtain",
        /No messages from the robot's processes\. tandem up: control \(pid \d+\) ended with exit code 0\. .*tandem-\w+ ended: SIGTERM/,
      );
      await me().said(/tandem-control: ended: SIGTERM/);
      await me().text("#services", /ended · [^·]* old · tandem-control: ended: SIGTERM/);
      await shot("console-system-ended");
      const up = spawn(path.join(setting.bin, "tandem"), ["up", setting.deployment, "--log", "warn"], {
        stdio: ["ignore", "ignore", "inherit"],
      });
      try {
        await me().state("#link", "live");
        await me().text("#lease", /Control: free/);
        await page().waitForSelector('.arm[data-state="DISABLED"]');
        await robot().until("be back", () => true);
        const back = monotonic();
        await robot().stands("after the system is back", back, 2000);
        assert.ok(robot().changed < back, "a joint moved");
      } finally {
        up.kill("SIGINT");
        await new Promise((resolve) => up.once("exit", resolve));
      }
    },
  };
};
