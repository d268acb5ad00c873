// SPDX-License-Identifier: Apache-2.0
// rates.js SETTING: what the page costs while control runs at 1 kHz: bytes, and processor time of the page's main thread.
"use strict";
const assert = require("node:assert");
const { Operator, monotonic, operated } = require("./harness.js");

const kSeconds = 10;
const kMostBytes = 300e3; // a second
const kMostShare = 0.2; // of the main thread

void operated(async ({ server, robot, browser }) => {
  // A small window: without graphics hardware, drawing takes the processor time of all others.
  const context = await browser.newContext({ viewport: { width: 480, height: 320 } });
  const me = new Operator(await context.newPage(), server.url);
  await me.page.goto(server.url);
  await me.said(/Connected to the server/);
  const session = await me.page.context().newCDPSession(me.page);
  await session.send("Performance.enable", { timeDomain: "threadTicks" });
  const busy = async () =>
    (await session.send("Performance.getMetrics")).metrics.find(({ name }) => name === "TaskDuration").value;
  const look = async () => {
    const stats = await (await fetch(`${server.url}/api/stats`)).json();
    assert.strictEqual(stats.clients.length, 1);
    return {
      at: monotonic(),
      bytes: stats.clients[0].bytes,
      received: stats.received,
      busy: await busy(),
      dropped: stats.clients[0].dropped,
    };
  };
  const before = await look();
  await me.page.waitForTimeout(1000 * kSeconds);
  const after = await look();
  const rate = (key) => (1000 * (after[key] - before[key])) / (after.at - before.at);
  console.log(
    `    of ${rate("received").toFixed(0)} samples/s the page receives ${(rate("bytes") / 1000).toFixed(0)} kB/s; ` +
      `its main thread takes ${(100 * rate("busy")).toFixed(0)} % of a core; ${await me.page.textContent("#fps")}`,
  );
  assert.ok(rate("received") > 1000, "control does not run at 1 kHz");
  assert.ok(rate("bytes") < kMostBytes, "the page receives too much");
  assert.ok(rate("busy") < kMostShare, "the page's main thread is too busy");
  assert.strictEqual(after.dropped, 0);
  // What happens is not decimated.
  await me.page.keyboard.press("Escape");
  await robot.until("stop", (s) => s.arms.every((arm) => /stop_requested/.test(arm.faults)));
  await me.said(/Arm A: stop_requested/);
  await me.text("#stop-note", /confirmed after/);
  assert.deepStrictEqual(me.complaints, []);
});
