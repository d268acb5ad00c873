// SPDX-License-Identifier: Apache-2.0
// Scenes of what the operator sees before a run: the scene with its legend, and the check and preview of a trajectory. Run by page_test.py
// Preview.
"use strict";
const assert = require("node:assert");

/** Overlays of the scene that cover a tip, and whether the legend lies outside the scene. Runs in the page. */
const covered = () => {
  const view = document.getElementById("view");
  const scene = view.getBoundingClientRect();
  const tips = view.dataset.tips.split(" ").map((tip) => tip.split(",").map(Number));
  const boxes = [...document.querySelectorAll(".cameras > *, .figure, .rate, #legend")].map((element) => ({
    name: element.id || element.textContent.slice(0, 20),
    box: element.getBoundingClientRect(),
  }));
  return tips.flatMap(([x, y]) =>
    boxes
      .filter(({ box }) => {
        const [left, top] = [scene.left + x, scene.top + y];
        return left > box.left && left < box.right && top > box.top && top < box.bottom;
      })
      .map(({ name }) => `${name} covers the tip at ${x}, ${y}`),
  );
};

module.exports = ({ me, robot, run, shot }) => {
  const page = () => me().page;
  return {
    async "preview: the legend covers no tip, with any camera and size"() {
      await me().text("#legend", /A tube 1.*B tube 3.*frames of the tips.*forbidden to targets: vessel, wall/);
      await page().waitForSelector('#view[data-tips*=" "]');
      for (const [width, height] of [
        [1280, 720],
        [800, 900],
        [1920, 1080],
      ]) {
        await me().resize(width, height);
        for (const camera of ["1", "2", "3", "4", "5", "6"]) {
          await page().click(`[data-camera="${camera}"]`);
          const before = await page().getAttribute("#fps", "data-frames");
          await page().waitForFunction((was) => document.getElementById("fps").dataset.frames !== was, before);
          const tips = await page().getAttribute("#view", "data-tips");
          assert.deepStrictEqual(await page().evaluate(covered), [], `camera ${camera}, ${width} x ${height}: ${tips}`);
          if (width === 1280) await shot(`preview-camera-${camera}`);
        }
      }
      await me().resize(1280, 720);
    },
  };
};
