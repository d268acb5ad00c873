// SPDX-License-Identifier: Apache-2.0
// Scenes of ends: what the page says when its server or the robot's processes end, and that nothing moves when they are back.
"use strict";
const assert = require("node:assert");
const { spawn } = require("node:child_process");
const path = require("node:path");
const { monotonic } = require("./harness.js");

module.exports = ({ robot, me, server, setting, enable, run, shot }) => {
  const page = () => me().page;

  return {
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

    async "a system that ends says which process and why; nothing moves when another has started"() {
      await run();
      process.kill(setting.pids.control, "SIGTERM"); // `tandem up` then ends all others
      await me().text("#curtain", /No messages from the robot's processes\. .*tandem-control ended: SIGTERM/);
      await me().said(/tandem-control: ended: SIGTERM/);
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
