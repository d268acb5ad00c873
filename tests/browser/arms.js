// SPDX-License-Identifier: Apache-2.0
// arms.js SETTING: the page of a robot with four arms: all of them are in the picture with their letters, all bars on the page, and nothing
// moves when arms change their state.
"use strict";
const assert = require("node:assert");
const fs = require("node:fs");
const path = require("node:path");
const { places } = require("./layout.js");
const { Operator, monotonic, operated } = require("./harness.js");

const kArms = ["A", "B", "C", "D"];
const kWindows = [
  [1280, 720],
  [1280, 640],
  [1920, 1080],
  [800, 900],
];
/** Cameras that show the arms whole: home, front, side, top. */
const kWhole = ["1", "2", "3", "4"];
const kRoom = 25; // px beside a tip, at least, for its next motion
const kHalfLetter = 5; // px, at least: half of a letter's height

/** Letters and tips that are not in the picture, or under an overlay; letters whose colour is not where they should be. Runs in the page. */
function unseen([colours, half, room]) {
  const view = document.getElementById("view");
  const { left, top } = view.getBoundingClientRect();
  const covers = [...document.querySelectorAll(".cameras > *, .figure:not([hidden]), .rate")];
  const points = (list) => list.split(" ").map((point) => point.split(",").map(Number));
  const wrong = [];
  const look = (what, [x, y], margin) => {
    if (x < margin || y < margin || x > view.clientWidth - margin || y > view.clientHeight - margin)
      wrong.push(`${what} at ${x}, ${y} of ${view.clientWidth} x ${view.clientHeight} is cut off`);
    const over = covers.find((element) => {
      const box = element.getBoundingClientRect();
      return left + x > box.left && left + x < box.right && top + y > box.top && top + y < box.bottom;
    });
    if (over) wrong.push(`${what} at ${x}, ${y} is under ${over.id || over.textContent}`);
  };
  const letters = points(view.dataset.letters);
  const tips = points(view.dataset.tips);
  if (letters.length !== colours.length) wrong.push(`${letters.length} letters`);
  if (tips.length !== colours.length) wrong.push(`${tips.length} tips`);
  letters.forEach((at, k) => look(`letter ${"ABCD"[k]}`, at, half));
  tips.forEach((at, k) => look(`tip ${"ABCD"[k]}`, at, room));
  const canvas = view.querySelector("canvas");
  const copy = document.createElement("canvas");
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const pen = copy.getContext("2d", { willReadFrequently: true });
  pen.drawImage(canvas, 0, 0);
  const scale = canvas.width / view.clientWidth;
  letters.forEach(([x, y], k) => {
    const wanted = [1, 3, 5].map((from) => parseInt(colours[k].slice(from, from + 2), 16));
    const size = Math.ceil(4 * half * scale);
    const { data } = pen.getImageData(x * scale - size / 2, y * scale - size / 2, size, size);
    let same = 0;
    for (let i = 0; i < data.length; i += 4)
      if (wanted.every((value, c) => Math.abs(value - data[i + c]) < 60)) same += 1;
    if (same < 3) wrong.push(`there is no ${colours[k]} where letter ${"ABCD"[k]} should be`);
  });
  return wrong;
}

/** Bars and charts that lie beside the footer, or on each other. Runs in the page. */
function misplaced() {
  const boxes = [...document.querySelectorAll(".actuators")].map((element) => element.getBoundingClientRect());
  const charts = document.querySelector("footer > .charts").getBoundingClientRect();
  const wrong = [];
  if (boxes.length !== 4) wrong.push(`${boxes.length} groups of bars`);
  boxes.forEach((box, k) => {
    if (box.left < 0 || box.right > innerWidth) wrong.push(`bars of arm ${k} from ${box.left} to ${box.right}`);
    if (box.bottom > charts.top + 1)
      wrong.push(`bars of arm ${k} end at ${box.bottom}, the charts begin at ${charts.top}`);
  });
  if (charts.left > 1 || charts.right < innerWidth - 16) wrong.push(`charts from ${charts.left} to ${charts.right}`);
  return wrong;
}

/** Only what differs is reported. */
function same(now, before, what) {
  const moved = now.filter((place, k) => place !== before[k]).slice(0, 8);
  assert.ok(now.length === before.length && moved.length === 0, `${what}: ${moved.join("; ")}`);
}

void operated(async ({ setting, server, robot, browser }) => {
  const me = await Operator.open(browser, server.url);
  /** Of the window as resize() made it. */
  async function shot(name) {
    const { data } = await me.session.send("Page.captureScreenshot");
    fs.writeFileSync(path.join(setting.artifacts, `${name}.png`), data, "base64");
  }
  const { arms } = await (await fetch(`${server.url}/api/robot`)).json();
  const colours = arms.map(({ color }) => color);
  await me.page.waitForFunction((n) => document.getElementById("view").dataset.tips?.split(" ").length === n, 4);
  const seen = async (where) => {
    const end = monotonic() + 20000; // a slow machine draws seldom
    for (;;) {
      const wrong = await me.page.evaluate(unseen, [colours, kHalfLetter, kRoom]);
      if (wrong.length === 0) return;
      assert.ok(monotonic() < end, `${where}: ${wrong.join("; ")}`);
      await new Promise((again) => setTimeout(again, 200));
    }
  };

  for (const [width, height] of kWindows) {
    await me.resize(width, height);
    await seen(`as the page opens, ${width} x ${height}`);
    await shot(`arms-${width}-${height}`);
    for (const camera of kWhole) {
      await me.page.click(`[data-camera="${camera}"]`);
      await seen(`camera ${camera}, ${width} x ${height}`);
      if (width === 1280 && height === 720) await shot(`arms-camera-${camera}`);
    }
    await me.page.click('[data-camera="1"]');
    assert.deepStrictEqual(await me.page.evaluate(misplaced), [], `${width} x ${height}`);
    const beyond = await me.page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    assert.ok(beyond <= 0, `${width} x ${height}: the page scrolls sideways by ${beyond} px`);
  }

  const rest = (s, state) => s.arms.every((arm) => arm.operating_state === state);
  for (const [width, height] of kWindows) {
    await me.resize(width, height);
    await me.page.evaluate(() => window.scrollTo(0, 0));
    const before = await me.page.evaluate(places);
    const push = async (button) => {
      await me.page.waitForSelector(`${button}[aria-disabled="false"]`);
      await me.page.$eval(button, (element) => element.click()); // without scrolling to it
    };
    /** Waits until the page shows the state, and all is where it was. */
    const shows = async (state, change) => {
      await change();
      await robot.until(`be ${state}`, (s) => rest(s, state));
      await me.page.waitForFunction(
        ([all, wanted]) => [...document.querySelectorAll(all)].every((arm) => arm.dataset.state === wanted),
        [".arm", state],
      );
      same(await me.page.evaluate(places), before, `${state} has moved something, ${width} x ${height}`);
    };
    if (!/this page/.test(await me.page.textContent("#lease"))) {
      await push("#take");
      await me.text("#lease", /Control: this page/);
    }
    await shows("ENABLED", () => push("#enable"));
    await push("#home");
    await me.said(/Move home/);
    same(await me.page.evaluate(places), before, `moving home has moved something, ${width} x ${height}`);
    await shows("PAUSED", () => push("#pause"));
    await shows("FAULT", () => robot.command("stop"));
    if (width === 1280) await shot(`arms-fault-${height}`);
    await shows("DISABLED", () => push("#disable"));
  }
  const names = await me.page.$$eval(".actuators h2", (all) => all.map((name) => name.textContent));
  assert.deepStrictEqual(
    names,
    kArms.map((name) => `Arm ${name}`),
  );
  assert.deepStrictEqual(me.complaints, []);
});
