// SPDX-License-Identifier: Apache-2.0
// catheters.js SETTING: the page for catheters that grasp an object, called by page_test.py.
"use strict";
const assert = require("node:assert");
const path = require("node:path");
const { Operator, Robot, Server, differing } = require("./harness.js");

const setting = JSON.parse(process.argv[2]);
const server = new Server(setting);
let robot;
let browser;

async function main() {
  await server.start();
  robot = new Robot(setting);
  await robot.until("speak", () => true);
  browser = await Operator.launch(setting);
  const me = await Operator.open(browser, server.url);
  const shot = (name) => me.page.screenshot({ path: path.join(setting.artifacts, `${name}.png`) });
  try {
    await me.waitForScene(
      "both catheters, and between them what they hold",
      (s) => s.blue > 100 && s.orange > 100 && s.green > 30,
    );
    await me.text(".legend", /A catheter.*B catheter.*grasped object.*arrows at the tips: contact forces/);
    assert.doesNotMatch(await me.page.textContent(".legend"), /tube|nearest/);
    const names = await me.page.$$eval(".bar .name", (all) => all.map((name) => name.textContent));
    assert.deepStrictEqual(names, ["insertion", "roll", "bend", "insertion", "roll", "bend"]);
    assert.strictEqual(await me.page.$("#tab-teleoperate"), null, "nobody drives the tip of a catheter that holds on");
    assert.ok(
      await me.page.$eval("#clearance", (near) => near.hidden),
      "distances are computed for concentric tubes only",
    );
    const choices = await me.page.$$eval("#trajectory input", (all) => all.map((one) => one.value));
    assert.deepStrictEqual(choices, ["lift", "tip-eight"]);

    // What the arms hold weighs 2 mN: both together carry it.
    const said = await me.text(
      "#forces",
      /^contact force on tip A [\d.]+ mN, tip B [\d.]+ mN \(by the model\) · arrow/,
    );
    const [a, b] = [...said.matchAll(/tip . ([\d.]+) mN/g)].map((one) => Number(one[1]));
    assert.ok(a > 0 && b > 0 && a + b > 1.99 && a + b < 50, said);
    await me.text('[aria-label^="Chart: contact force, mN"]', /on tip A\s*[\d.]+/);

    await me.press("#take");
    await me.press("#enable");
    await robot.states("ENABLED");
    await me.choose("trajectory", "tip-eight");
    await me.press("#run-start");
    await me.said(/(Start refused|tip-eight: failed): the path requires .*not possible: /);

    await me.choose("trajectory", "lift");
    const before = await me.scene();
    await me.press("#run-start");
    await me.text("#progress", /running/);
    await robot.until("be half way up", (s) => s.trajectory.point > 25);
    await me.waitForScene("the picture changes", (s) => differing(s, before) > 20 && s.green > 30);
    await me.text("#errors", /error [\d.]+ mm/);
    await shot("console-catheters");
    await me.text("#progress", /finished/);
    await me.press("#disable");
    await robot.states("DISABLED");
    assert.deepStrictEqual(me.complaints, [], "the browser complains");
  } catch (error) {
    await shot("bad-catheters").catch(() => {});
    console.log(`      the page says: ${await me.page.textContent(".messages").catch(() => "nothing")}`);
    throw error;
  }
}

main()
  .then(() => true)
  .catch((error) => console.log(`  BAD ${error.stack}`))
  .then(async (good) => {
    robot?.close();
    await browser?.close();
    if (server.process?.exitCode === null && server.process.signalCode === null) await server.kill("SIGTERM");
    process.exit(good ? 0 : 1);
  });
