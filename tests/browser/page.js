// SPDX-License-Identifier: Apache-2.0
// page.js SETTING [SCENE...]: scenes of an operator at the page; SETTING is JSON, passed by page_test.py.
"use strict";
const assert = require("node:assert");
const fs = require("node:fs");
const path = require("node:path");
const { Operator, Robot, Server, SlowLink, differing, monotonic } = require("./harness.js");

const setting = JSON.parse(process.argv[2]);
const only = process.argv.slice(3);
/** Files of scenes that are played when they are named: by tests of their own. */
const kOwnTests = ["situations", "preview", "replay", "accessibility", "devices", "charts", "orientation"];
const server = new Server(setting);
let robot;
let browser;
/** The operator, and a second one at another page. */
let me;

const shot = (name, whose = me) => whose.page.screenshot({ path: path.join(setting.artifacts, `${name}.png`) });

async function takeControl() {
  await me.tab("operate");
  // While the data is old, nobody knows who has control; the button may release it.
  if (/this page/.test(await me.text("#lease", /Control: (this page|another client|free|CRTK)/))) return;
  await me.press("#take");
  await me.text("#lease", /Control: this page/);
}
/** Ends faults. A stop that the page repeats may reach control after the status that the page has shown: then control
 * refuses, the page says so, and the operator presses again. */
async function clearFaults() {
  const cleared = robot.states("DISABLED").then(() => true);
  do await me.press("#disable");
  while (!(await Promise.race([cleared, new Promise((again) => setTimeout(() => again(false), 3000))])));
}
async function enable() {
  await takeControl();
  if (!robot.last.arms.every((arm) => arm.operating_state === "ENABLED")) {
    if (robot.last.arms.some((arm) => arm.operating_state === "FAULT")) await clearFaults();
    await me.press("#enable");
  }
  await robot.states("ENABLED");
}
async function run() {
  await enable();
  await me.tab("operate");
  await me.choose("trajectory", "line");
  await me.press("#run-start");
  await me.text("#progress", /running/);
  await robot.moves("a trajectory runs");
}
const stoppedByRequest = (s) =>
  s.arms.every((arm) => arm.operating_state === "FAULT" && /stop_requested/.test(arm.faults));

async function afterStop(how, since) {
  await robot.until(`stop after ${how}`, stoppedByRequest);
  const standing = await robot.stands(`after ${how}`, since);
  const note = await me.text("#stop-note", /confirmed after \d+ ms/);
  await me.text(
    '[data-fault="arm_a"]',
    /stop_requested: a client requested a stop, or the emergency stop was pressed\. When it is safe/,
  );
  console.log(
    `    ${how}: ${note.trim()}; the last joint moved ${standing.toFixed(0)} ms after the press, as seen every 100 ms`,
  );
  assert.ok(standing < 2000, `${how}: joints moved for ${standing} ms`);
}

const scenes = {
  async "the arms are drawn"() {
    const seen = await me.waitForScene("both arms drawn", (s) => s.blue > 150 && s.orange > 150);
    assert.ok(seen.blue < 30000 && seen.orange < 30000, "the scene is all of one colour");
    await me.text("#clearance", /arm A and arm B overlap by 0\.1\d* mm/); // at home, by the paper's placement
    await me.said(/arm_a and arm_b overlap by 0\.\d+ mm: tube \d of arm_a, tube \d of arm_b/);
    await me.text("#relative", /tip A from tip B/);
    await me.choose("thickness", "1");
    await me.waitForScene("true tubes are thinner", (s) => s.blue < 0.8 * seen.blue);
    await me.choose("thickness", "2");
    for (const camera of ["2", "3", "4", "5", "6", "1"]) {
      const before = await me.scene();
      await me.page.click(`[data-camera="${camera}"]`);
      await me.waitForScene(
        `camera ${camera} shows something else`,
        (s) => differing(s, before) > 100 && s.blue + s.orange > 50,
      );
    }
  },

  async "nothing can be ordered without control, and one commands at a time"() {
    assert.strictEqual(await me.page.getAttribute("#enable", "aria-disabled"), "true");
    await me.page.waitForSelector('#enable[title="Take control first."]');
    await takeControl();
    const other = await Operator.open(browser, server.url);
    await other.text("#lease", /another client/);
    await other.page.waitForSelector('#take[aria-disabled="true"][title="Another client has the control lease."]');
    assert.strictEqual(await other.page.getAttribute("#enable", "aria-disabled"), "true");
    await shot("second-client", other);
    await other.page.context().close();
    const cli = robot.command("enable");
    assert.notStrictEqual(cli.status, 0);
    assert.match(cli.stderr, /another client has the control lease/);
  },

  async "the arms move in an experiment, and a pause holds them"() {
    await run();
    const before = await me.scene();
    const bar = () => me.page.$$eval(".bar .value", (bars) => bars.map((b) => b.style.left).join());
    const bars = await bar();
    await robot.moves("further");
    await me.waitForScene("the picture changes", (s) => differing(s, before) > 20);
    assert.notStrictEqual(await bar(), bars, "the bars of the actuators stand still");
    await me.page.waitForFunction(() =>
      [...document.querySelectorAll(".bar .free")].some((f) => f.style.width !== "100.00%" && f.style.width !== ""),
    );
    await me.text("#errors", /error [\d.]+ \/ [\d.]+ mm/);
    await shot("console-experiment");
    await me.press("#run-pause");
    await me.text("#progress", /paused/);
    await robot.stands("a pause", monotonic());
    const paused = monotonic();
    await me.press("#run-resume"); // a click is not enough
    assert.match(
      await me.page.getAttribute("#run-resume", "title"),
      /continues (line|the trajectory) from point \d+ of 100/,
    );
    await robot.stands("a click on resume", paused);
    await me.hold("#run-resume", me.text("#progress", /running/));
    await robot.moves("after the pause");
    await me.press("#pause");
    await robot.states("PAUSED");
    await me.text("#progress", /waits for PAUSED arms/);
    await robot.stands("paused arms", monotonic());
    assert.match(
      await me.page.getAttribute("#resume", "title"),
      /ENABLED; continues (line|the trajectory) from point \d+ of 100/,
    );
    await me.hold("#resume", robot.states("ENABLED"));
    await robot.moves("after the pause of the arms");
  },

  async "a method is chosen and tuned while none is followed"() {
    await me.tab("method");
    assert.strictEqual(await me.page.getAttribute('[data-method="snsqp"]', "aria-disabled"), "true");
    await me.tab("operate");
    await me.press("#run-end");
    await me.text("#run-summary", /line: ended by a client; \d+ of 100 points reached/);
    await me.text("#run-summary", /bodies overlapped by up to 0\.\d+ mm[\s\S]*relative position of A and B: RMS/);
    await shot("run-summary");
    await me.tab("method");
    await me.press('[data-method="snsqp"]');
    await robot.until("use snsqp", (s) => s.method === "snsqp");
    await me.page.waitForSelector('[data-method="snsqp"][aria-checked="true"]');
    await me.page.fill('[data-parameter="snsqp_zeta"]', "0.05");
    await me.press("#apply");
    await me.said(/snsqp_zeta = 0.05: done/);
    await me.page.fill('[data-parameter="tip_gain"]', "-1");
    await me.press("#apply");
    await me.said(/tip_gain = -1 refused: .*expected a finite number above zero/);
    await me.page.fill('[data-parameter="tip_gain"]', "5 µ中");
    await me.press("#apply");
    await me.said(/tip_gain = 5 µ中 refused: .*found '5 µ中', expected a finite number above zero/);
    await me.page.fill('[data-parameter="tip_gain"]', "3");
    await shot("console-method");
    await me.press('[data-method="nspqp"]');
    await robot.until("use nspqp", (s) => s.method === "nspqp");
  },

  async "the stop button stops a run"() {
    await run();
    const box = await me.page.locator("#stop").boundingBox();
    await me.page.mouse.move(box.x + 20, box.y + 10);
    const since = monotonic();
    await me.page.mouse.down();
    await afterStop("stop button", since);
    await me.page.mouse.up();
    await shot("console-stopped");
  },

  async "Esc stops a run, wherever one types"() {
    await run();
    await me.page.click("#trajectory-yaml > summary");
    await me.page.focus("#trajectory-text");
    const since = monotonic();
    await me.page.keyboard.press("Escape");
    await afterStop("Esc", since);
    await me.page.click("#trajectory-yaml > summary");
  },

  async "the keyboard alone reaches everything, in order, with names"() {
    await me.page.focus("#take");
    const order = ["take"];
    for (let k = 0; k < 100; ++k) {
      await me.page.keyboard.press("Tab");
      const at = await me.page.evaluate(() => {
        const e = document.activeElement;
        if (e === document.body) return null; // the focus would leave the page for the browser's own controls
        const style = getComputedStyle(e);
        const name = e.getAttribute("aria-label") || e.textContent?.trim() || e.labels?.[0]?.textContent || "";
        return {
          id: e.id || e.name || name,
          name,
          visible: style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2,
          inside: style.boxShadow === "none" && parseFloat(style.outlineOffset) + parseFloat(style.outlineWidth) <= 0,
        };
      });
      if (at === null || at.id === order[0]) break;
      assert.notStrictEqual(at.name, "", `${at.id} has no name`);
      assert.ok(at.visible, `one does not see that ${at.id} has the focus`);
      if (at.id === "stop") assert.ok(at.inside, "the frame of the focus covers the result of a stop");
      order.push(at.id);
    }
    const wanted = ["take", "stop", "view", "tab-operate", "enable", "disable", "trajectory", "run-start"];
    const places = wanted.map((id) => order.indexOf(id));
    assert.ok(
      places.every((p) => p >= 0),
      `not reached by Tab: ${wanted.filter((_, k) => places[k] < 0)}`,
    );
    assert.deepStrictEqual(
      places,
      [...places].sort((a, b) => a - b),
      "the order of the focus",
    );
    await me.page.focus("#tab-operate");
    await me.page.keyboard.press("ArrowRight");
    assert.strictEqual(await me.page.evaluate(() => document.activeElement.id), "tab-method");
    await me.tab("operate");
  },

  async "the robot's silence is reported, and commands end"() {
    process.kill(setting.pids.control, "SIGSTOP");
    try {
      await me.state("#link", "stale");
      await me.text("#link", /NO DATA FROM CONTROL/);
      await me.text("#curtain", /Last data: .* old\. Commands are disabled/);
      assert.strictEqual(await me.page.getAttribute("#disable", "aria-disabled"), "true");
    } finally {
      process.kill(setting.pids.control, "SIGCONT");
    }
    await me.state("#link", "live");
    process.kill(setting.pids.sim, "SIGSTOP");
    try {
      await me.text("#link", /NO DATA FROM DRIVES/);
      await me.text("#curtain", /^No messages from the robot's processes/);
    } finally {
      process.kill(setting.pids.sim, "SIGCONT");
    }
    await me.state("#link", "live");
  },

  async "data that a link holds back is old, commands are locked, and stop still stops"() {
    await run();
    const link = new SlowLink(server);
    const other = await Operator.open(browser, await link.start());
    await other.state("#link", "live");
    link.delay = 3000;
    try {
      await other.state("#link", "stale");
      await other.text("#link", /OLD DATA · ([2-9]|\d\d)\.\d s old/);
      await other.text("#curtain", /The link holds messages back.*Commands are disabled/);
      await other.page.waitForSelector('#disable[aria-disabled="true"]');
      await other.text("#lease", /Control: unknown/);
      await shot("console-old-data", other);
      await other.page.keyboard.press("Escape");
      await robot.until("stop", stoppedByRequest);
      link.delay = 0;
      await other.state("#link", "live");
    } finally {
      await other.page.context().close();
      link.close();
    }
  },

  async "the server is killed during a run and comes back: nothing moves"() {
    await run();
    const since = monotonic();
    await server.kill();
    await me.state("#link", "lost");
    await me.text("#curtain", /No connection to the server/);
    assert.strictEqual(await me.page.getAttribute("#enable", "aria-disabled"), "true");
    await shot("console-no-link");
    await robot.until("fall into FAULT for want of a commander", (s) =>
      s.arms.every((arm) => /lease_lost/.test(arm.faults)),
    );
    console.log(
      `    the arms stood ${(await robot.stands("without a server", since)).toFixed(0)} ms after the server was killed`,
    );
    const back = monotonic();
    await server.start();
    await me.state("#link", "live");
    await me.text('[data-fault="arm_a"]', /lease_lost: the control lease expired while an arm moved/);
    await me.text("#lease", /Control: free/);
    await robot.stands("after the server is back", monotonic());
    assert.ok(robot.changed < back, "a joint moved after the link was back");
    await enable(); // the operator continues from there
  },

  async "another robot at the same address empties the page and asks"() {
    await run();
    await server.kill();
    await me.state("#link", "lost");
    const other = path.join(path.dirname(setting.deployment), "other.yaml");
    const text = fs.readFileSync(setting.deployment, "utf8").replace(/^robot: .*$/m, `robot: ${setting.other}`);
    fs.writeFileSync(other, text.replace(/^prefix: .*$/m, "prefix: other"));
    const exchanged = new Server({ ...setting, deployment: other });
    await exchanged.start();
    try {
      await me.text("#exchanged", /Another system answers here now: ark2024-as-printed · laptop/);
      assert.strictEqual(await me.page.$("#stop"), null);
      await me.page.keyboard.press("Escape");
      await shot("console-exchanged");
      await me.page.click("#reload");
      await me.text(".brand", /ark2024-as-printed/);
    } finally {
      await exchanged.kill("SIGTERM");
      await server.start();
    }
    await me.text("#exchanged", /Another system answers here now: ark2024 · laptop/);
    await me.page.click("#reload");
    await me.state("#link", "live");
    await robot.stands("after two exchanges", monotonic());
    await enable();
  },
};

async function main() {
  await server.start();
  robot = new Robot(setting);
  await robot.until("speak", () => true);
  browser = await Operator.launch(setting);
  me = await Operator.open(browser, server.url);
  const open = (url = server.url, device = undefined) => Operator.open(browser, url, device);
  const tools = { robot: () => robot, me: () => me, server, setting, takeControl, enable, run, shot, open };
  let failed = 0;
  const rates = [];
  for (const [name, scene] of Object.entries({
    ...scenes,
    ...require("./jog.js")({ robot: () => robot, me: () => me, enable }),
    ...require("./hands.js")({ robot: () => robot, me: () => me, enable, shot, setting }),
    ...require("./layout.js")(tools),
    ...require("./reasons.js")(tools),
    ...require("./access.js")(tools),
    ...require("./log.js")(tools),
    ...Object.assign({}, ...kOwnTests.map((name) => (only.length > 0 ? require(`./${name}.js`)(tools) : {}))),
    ...require("./ends.js")(tools),
  })) {
    if (only.length > 0 && !only.some((word) => name.includes(word))) continue;
    const from = monotonic();
    try {
      await scene();
      assert.deepStrictEqual(me.complaints, [], "the browser complains");
      rates.push(await me.page.$eval("#fps", (rate) => Number(rate.dataset.frames)));
      console.log(`  ok  ${name} (${((monotonic() - from) / 1000).toFixed(1)} s)`);
    } catch (error) {
      failed += 1;
      console.log(`  BAD ${name}: ${error.stack}`);
      for (const [k, page] of browser
        .contexts()
        .flatMap((context) => context.pages())
        .entries()) {
        console.log(`      page ${k + 1} says: ${await page.textContent(".messages").catch(() => "nothing")}`);
        await page.screenshot({ path: path.join(setting.artifacts, `bad-${k + 1}.png`) }).catch(() => {});
      }
      break; // later scenes depend on this one
    }
  }
  const [least, median, most] = [0, 0.5, 1].map(
    (share) => rates.sort((a, b) => a - b)[Math.floor(share * (rates.length - 1))],
  );
  console.log(
    `  frames per second after each scene: least ${least}, median ${median}, most ${most}; ` +
      (await me.page.textContent("#fps")),
  );
  return failed === 0;
}

main()
  .catch((error) => console.log(`  BAD ${error.stack}`))
  .then(async (good) => {
    robot?.close();
    await browser?.close();
    if (server.process?.exitCode === null && server.process.signalCode === null) await server.kill("SIGTERM");
    process.exit(good ? 0 : 1);
  });
