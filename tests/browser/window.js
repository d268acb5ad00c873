// SPDX-License-Identifier: Apache-2.0
// window.js SETTING [SCENE...]: the page in a window on a desktop. All input comes from the X server, and what it does is read from the
// robot's joints: what a menu, a dialog or another window takes away from the page. Called by page_test.py Window.
"use strict";
const assert = require("node:assert");
const path = require("node:path");
const { Desktop } = require("./desktop.js");
const { Operator, Robot, Server, monotonic } = require("./harness.js");

const [setting, ...only] = [JSON.parse(process.argv[2]), ...process.argv.slice(3)];
const kMost = 3000; // ms from the event to standstill, as seen by `tandem status` on a busy machine: a jog that is not ended goes on
const kSwitch = 3000; // ms for another window to take the keyboard
const kTab = [150, 20]; // on the screen: the page's tab; right of it the tab strip is empty
const kStrip = [500, 20];
const kRoll = '[aria-label^="Hold to jog"][aria-label$="of arm A up"]';

const server = new Server(setting);
let desktop;
let robot;
let browser;
let me;

const stopped = (s) => s.arms.every((arm) => arm.operating_state === "FAULT" && /stop_requested/.test(arm.faults));
const shot = (name) => me.page.screenshot({ path: path.join(setting.artifacts, `${name}.png`) });
const click = (selector) => desktop.click(me.page, selector);
const jog = () => me.page.locator(kRoll).nth(3); // the innermost tube's roll, which has no limits

/** The page knows whether it has the keyboard, and says so. Chromium draws nothing in a window that another one covers: the page is asked. */
async function keyboard(here) {
  const says = here ? /^Esc stops/ : /^Esc does NOT stop/;
  await desktop.until(`${says} in the page`, async () =>
    says.test(await me.page.evaluate(() => document.getElementById("stop-key").textContent)),
  );
}
const focused = () => keyboard(true);
const unfocused = () => keyboard(false);
async function enable() {
  await click("#tab-operate");
  if (!/this page/.test(await me.text("#lease", /Control: (this page|free)/))) {
    await click("#take");
    await me.text("#lease", /Control: this page/);
  }
  while (!robot.last.arms.every((arm) => arm.operating_state === "ENABLED")) {
    const fault = robot.last.arms.some((arm) => arm.operating_state === "FAULT");
    await click(fault ? "#disable" : "#enable");
    // A stop that the page repeats may come after the fault was cleared: then the operator presses again.
    await robot
      .until("answer", (s) => s.arms.every((a) => a.operating_state !== (fault ? "FAULT" : "DISABLED")), 3000)
      .catch(() => {});
  }
}
async function run() {
  await enable();
  if ((await me.page.textContent("#progress").catch(() => "")).match(/running|paused/)) await click("#run-end");
  await click('#trajectory label:has(input[value="line"])');
  await click("#run-start");
  await robot.moves("a trajectory runs");
}
/** Presses, and again until a joint moves: on a busy machine a hold may end by the gap of its timer. */
async function hold(what, press, release) {
  for (let attempt = 0; ; ++attempt) {
    press();
    try {
      return await robot.moves(what, 5000);
    } catch (error) {
      release();
      if (attempt === 8) throw error;
    }
  }
}
async function jogKey() {
  await enable();
  await me.page.waitForFunction((key) => key.ariaDisabled === "false", await jog().elementHandle());
}
async function holdPointer() {
  await jogKey();
  await desktop.point(me.page, jog());
  await hold(
    "the pointer holds a jog key",
    () => desktop.do("mousedown", 1),
    () => desktop.do("mouseup", 1),
  );
}
async function holdSpace() {
  await jogKey();
  await jog().focus();
  await hold(
    "space holds a jog key",
    () => desktop.do("keydown", "space"),
    () => desktop.do("keyup", "space"),
  );
}
/** All joints stand soon after `event`, although nothing was let go. @param event  returns the time at which it happened, or nothing */
async function ends(how, event) {
  let since = monotonic();
  const happened = await event();
  if (typeof happened === "number") since = happened;
  const took = await robot.stands(how, since);
  console.log(`    ${how}: the last joint moved ${took.toFixed(0)} ms later, as seen every 100 ms`);
  assert.ok(took < kMost, `${how}: joints moved for ${took} ms`);
}
async function stopsByEsc(how) {
  await ends(how, () => desktop.do("key", "Escape"));
  await robot.until(`stop by Esc: ${how}`, stopped);
  await me.text("#stop-note", /confirmed after/);
}
/** Another window takes the keyboard by Alt+Tab. A busy window manager may miss the keys: then they are pressed again, as a person does.
 * @returns when it was pressed last */
async function altTab() {
  const before = desktop.focused;
  const elsewhere = () => !["", before].includes(desktop.focused);
  for (let attempt = 0; attempt < 10; ++attempt) {
    const pressed = monotonic();
    desktop.do("keydown", "alt", "key", "Tab", "keyup", "alt");
    while (monotonic() < pressed + kSwitch) {
      if (elsewhere()) return pressed;
      await new Promise((again) => setTimeout(again, 50));
    }
    console.log(`    Alt+Tab without effect for ${kSwitch} ms: pressed again`);
  }
  throw new Error("no window takes the keyboard by Alt+Tab");
}
/** A window of another program, in front, with the keyboard. */
async function anotherWindow() {
  const before = desktop.focused;
  const context = await browser.newContext({ viewport: null });
  await context.newPage();
  await desktop.until("window that takes the keyboard", () => !["", before].includes(desktop.focused));
  return context;
}

const scenes = {
  async "a right click while a jog key is held opens no menu and ends the motion, and Esc stops"() {
    await holdPointer();
    await ends("a right click, the key still down", () => desktop.do("click", 3));
    await stopsByEsc("Esc after the right click, the key still down");
    desktop.do("mouseup", 1);
  },

  async "Ctrl+F opens no find bar that takes Esc from the page"() {
    await run();
    desktop.do("key", "ctrl+f");
    await me.page.waitForSelector("#log-search:focus");
    await stopsByEsc("Esc after Ctrl+F");
  },

  async "a file dialog takes the keyboard: the page says so, its Esc stops nothing, the next one stops"() {
    await run();
    desktop.do("key", "ctrl+o");
    await unfocused();
    await shot("console-dialog");
    desktop.do("key", "Escape");
    await focused();
    await robot.moves("the Esc of a dialog is not the page's");
    await stopsByEsc("Esc after the dialog");
  },

  async "a menu of the browser takes the release of a jog key: the motion ends"() {
    await holdSpace();
    await ends("a menu of the browser", () => {
      desktop.do("mousemove", ...kStrip, "click", 3);
      desktop.do("keyup", "space");
    });
    desktop.do("key", "Escape");
  },

  async "a window that opens takes the keyboard from a jog key that is held"() {
    await holdSpace();
    const other = await anotherWindow();
    await ends("another window", unfocused);
    await other.close();
    await focused();
    await robot.stands("the key is still down from before", monotonic());
    desktop.do("keyup", "space");
  },

  async "Alt+Tab takes the keyboard from a key that teleoperates"() {
    const other = await anotherWindow();
    await altTab();
    await focused();
    await enable();
    await click("#tab-teleoperate");
    await click("#teleop-on");
    await me.text("#teleop-held", /^○ (ready|released)/);
    await me.text("#teleop-state", /^released/);
    await me.page.focus("#view");
    await hold(
      "a key teleoperates",
      () => desktop.do("keydown", "Up"),
      () => desktop.do("keyup", "Up"),
    );
    await ends("Alt+Tab", altTab);
    await unfocused();
    await altTab();
    await focused();
    await robot.stands("the key is still down from before", monotonic());
    desktop.do("keyup", "Up");
    await click("#teleop-on");
    await other.close();
  },

  async "closing the tab while a jog key is held ends the motion, and the lease is lost"() {
    await holdSpace();
    const closed = me.page.waitForEvent("close");
    desktop.do("mousemove", ...kTab, "click", 2);
    await closed;
    await ends("closing the tab", () => {});
    desktop.do("keyup", "space");
    await robot.until("lose its commander", () => robot.command("disable").status === 0);
  },
};

async function main() {
  await server.start();
  robot = new Robot(setting);
  await robot.until("speak", () => true);
  desktop = await Desktop.start();
  browser = await desktop.launch(setting);
  me = await Operator.open(browser, server.url, { viewport: null });
  // Playwright tells pages that they have the focus.
  const session = await me.page.context().newCDPSession(me.page);
  await session.send("Emulation.setFocusEmulationEnabled", { enabled: false });
  await desktop.locate(me.page);
  await click(".brand"); // the address line of a new window has the keyboard
  await focused();
  for (const [name, scene] of Object.entries(scenes)) {
    if (only.length > 0 && !only.some((word) => name.includes(word))) continue;
    const from = monotonic();
    try {
      await scene();
    } catch (error) {
      await shot("bad-window").catch(() => {});
      throw new Error(`${name}: ${error.stack}`);
    }
    console.log(`  ok  ${name} (${((monotonic() - from) / 1000).toFixed(1)} s)`);
  }
  return true;
}

main()
  .catch((error) => console.log(`  BAD ${error.stack}`))
  .then(async (good) => {
    robot?.close();
    await browser?.close();
    desktop?.close();
    if (server.process?.exitCode === null && server.process.signalCode === null) await server.kill("SIGTERM");
    process.exit(good ? 0 : 1);
  });
