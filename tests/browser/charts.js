// SPDX-License-Identifier: Apache-2.0
// Scenes of charts, units and angles. Run by page_test.py Access.
"use strict";
const assert = require("node:assert");
const { monotonic } = require("./harness.js");

/** Records texts on canvases that are not completely on them. Runs in the page before its scripts. */
function watchTexts() {
  window.drawnTexts = 0;
  window.clippedTexts = [];
  const draw = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (text, x, y, ...rest) {
    if (this.canvas.closest(".chart")) {
      const at = this.getTransform().transformPoint({ x, y });
      const m = this.measureText(text);
      const box = [at.x - m.actualBoundingBoxLeft, at.y - m.actualBoundingBoxAscent];
      const end = [at.x + m.actualBoundingBoxRight, at.y + m.actualBoundingBoxDescent];
      window.drawnTexts += 1;
      const { width, height } = this.canvas;
      if (Math.min(...box) < -0.5 || end[0] > width + 0.5 || end[1] > height + 0.5)
        window.clippedTexts.push(`${text}: ${box} to ${end} of ${width} x ${height}`);
    }
    return draw.call(this, text, x, y, ...rest);
  };
}

module.exports = ({ robot, me, setting, enable, run, shot }) => {
  const page = () => me().page;
  const chart = (title) => page().locator(`.chart[aria-label^="Chart: ${title}"]`);
  const key = (title) => `.chart[aria-label^="Chart: ${title}"] .key`;

  return {
    async "charts: lines are named with their arms, no tick is cut off, and silence is no line"() {
      await page().addInitScript(watchTexts);
      await me().load();
      await enable();
      await me().press("#home");
      await me().said(/Move home: done after/);
      await me().text(key("least distance, mm"), /distance \(−: overlap\)overlap of 0\.\d+/); // at home, by the paper's placement
      await run();
      await me().text(key("task error, mm"), /A from B[\d.]+tip [AB][\d.]+/);
      const colours = await page().$$eval(`${key("task error, mm")} > span:not([hidden])`, (all) =>
        all.map((row) => [row.textContent, getComputedStyle(row.firstChild).borderTopColor]),
      );
      const arms = { A: "rgb(86, 180, 233)", B: "rgb(230, 159, 0)" };
      for (const [name, colour] of colours) {
        const arm = /^tip (.)/.exec(name)?.[1];
        if (arm) assert.strictEqual(colour, arms[arm], name);
        else assert.ok(!Object.values(arms).includes(colour), `${name} has the colour of an arm`);
      }
      for (const tab of ["health", "operate"]) {
        await me().tab(tab);
        for (const [width, height] of [
          [1280, 720],
          [800, 900],
          [1920, 1080],
        ]) {
          await me().resize(width, height);
          const from = await page().evaluate(() => window.drawnTexts);
          await page().waitForFunction((before) => window.drawnTexts > before + 100, from);
        }
      }
      await me().resize(1280, 720);
      await shot("console-charts");
      assert.deepStrictEqual(await page().evaluate(() => [...new Set(window.clippedTexts)]), [], "ticks are cut off");
      process.kill(setting.pids.control, "SIGSTOP");
      try {
        await me().text(key("time of a cycle, ms"), /^solve–cycle–$/);
      } finally {
        process.kill(setting.pids.control, "SIGCONT");
      }
      await me().text(key("time of a cycle, ms"), /^solve[\d.]+cycle[\d.]+$/);
      await enable();
    },

    async "charts: a cursor shows the values of its time in all charts, by pointer and by keys"() {
      const box = await chart("task error, mm").locator(".u-over").boundingBox();
      await page().mouse.move(box.x + 0.9 * box.width, box.y + 20);
      for (const title of ["task error, mm", "least distance, mm", "time of a cycle, ms"]) {
        await page().waitForSelector(`.chart[aria-label^="Chart: ${title}"][data-cursor="yes"]`);
        await me().text(`.chart[aria-label^="Chart: ${title}"] .when`, /^-(2|3)\.\d s$/);
      }
      await shot("console-cursor");
      await page().mouse.move(box.x, 10);
      await page().waitForSelector('.chart[data-cursor="yes"]', { state: "detached" });
      await chart("least distance, mm").focus();
      await page().keyboard.press("ArrowLeft");
      await page().keyboard.press("ArrowLeft");
      await me().text('.chart[aria-label^="Chart: least distance"] .when', /^-1\.\d s$/);
      await me().text("#said-events", /-1\.\d s: distance \(−: overlap\) /);
      await page().keyboard.press("Tab");
      await page().waitForSelector('.chart[data-cursor="yes"]', { state: "detached" });
    },

    async "charts: parameters have units, and angles are numbered as they are drawn"() {
      await enable();
      await me().tab("method");
      const unit = (name) => page().textContent(`.parameter:has([data-parameter="${name}"]) .unit`);
      assert.strictEqual(await unit("tip_gain"), "1/s");
      assert.strictEqual(await unit("rotation_velocity"), "rad/s");
      assert.strictEqual(await unit("translation_step"), "m");
      assert.match(await page().getAttribute('.parameter:has([data-parameter="tip_gain"])', "title"), /gain/);
      await shot("console-units");
      await me().tab("operate");
      await robot().stands("before its angles are read", monotonic());
      const angles = robot().last.arms.flatMap((arm) => arm.joints.slice(3).map((angle) => (angle * 180) / Math.PI));
      // Number, number with its turns, and angle at which it is drawn; all of one moment, once the page has the robot's angles.
      const drawn = await page().waitForFunction((expected) => {
        const shown = [...document.querySelectorAll(".bar")]
          .filter((bar) => bar.querySelector(".name").textContent.startsWith("α"))
          .map((bar) => {
            const text = bar.querySelector(".number").textContent;
            const [, angle, sign, turns] = /^(-?[\d.]+)°(?: ([−+])(\d+)×360°)?$/.exec(text);
            const whole = Number(angle) + 360 * Number(turns ?? 0) * (sign === "−" ? -1 : 1);
            return {
              text,
              angle: Number(angle),
              whole,
              at: 3.6 * parseFloat(bar.querySelector(".value").style.left) - 180,
            };
          });
        return shown.every(({ whole }, k) => Math.abs(whole - expected[k]) < 0.2) && shown;
      }, angles);
      const shown = await drawn.jsonValue();
      assert.strictEqual(shown.length, angles.length);
      assert.ok(
        shown.some(({ text }) => /×360°/.test(text)),
        "no angle is beyond a turn here",
      );
      for (const { text, angle, at } of shown) assert.ok(Math.abs(angle - at) < 0.2, `${text} is drawn at ${at}°`);
    },
  };
};
