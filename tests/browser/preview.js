// SPDX-License-Identifier: Apache-2.0
// Scenes of what the operator sees before a run: the scene with its legend, and the check and preview of a trajectory. Run by page_test.py
// Preview.
"use strict";
const assert = require("node:assert");
const { spawnSync } = require("node:child_process");
const { differing, monotonic } = require("./harness.js");

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

/** m or rad between a ghost and the way of the joints that were seen in the run. */
const kGhost = 0.02;
/** Ghosts to compare. */
const kGhosts = 9;

/** Largest distance of a joint from its place on the straight way between two positions, where that distance is least: a busy machine sees
 * the joints seldom, and what lies between two positions was passed, too. */
function fromWay(joints, [from, to]) {
  const way = to.map((q, j) => q - from[j]);
  const square = way.reduce((sum, d) => sum + d * d, 0);
  const along = square === 0 ? 0 : joints.reduce((sum, q, j) => sum + (q - from[j]) * way[j], 0) / square;
  const share = Math.min(1, Math.max(0, along));
  return Math.max(...joints.map((q, j) => Math.abs(q - from[j] - share * way[j])));
}

module.exports = ({ me, robot, server, enable, run, shot, open }) => {
  const page = () => me().page;
  /** Text of the trajectory, as an operator types it. */
  async function type(yaml) {
    await page().$eval("#trajectory-text", (element) => (element.closest("details").open = true));
    await page().fill("#trajectory-text", yaml);
  }
  const line = (length, points = 20) =>
    [
      "tandem: trajectory/1 # 5 µm",
      "name: typed",
      "tasks: [{relative: [a, b]}, {tip: a}]",
      `shape: {line: {displacement_mm: [0, ${length}, 0]}}`,
      `points: ${points}`,
      "following: timed",
    ].join("\n");
  const scene = () => me().scene();
  /** Waits until all that is known is drawn. */
  async function drawn(seconds = 2) {
    for (let k = 0; k < seconds; ++k) {
      const before = await page().getAttribute("#fps", "data-frames");
      await page().waitForFunction((was) => document.getElementById("fps").dataset.frames !== was, before);
    }
  }

  return {
    async "preview: a trajectory is checked before its start, and shown"() {
      await me().tab("operate");
      await me().text("#run-check", /Not checked: take control, or choose a trajectory/);
      const before = await scene();
      await me().choose("trajectory", "lissajous");
      await me().text("#run-check", /^✓ All 100 points can be reached\. nspqp needs \d+ control periods/);
      await me().waitForScene("the checked path is drawn", (s) => differing(s, before) > 10);
      assert.strictEqual(await page().getAttribute("#run-start", "aria-describedby"), "run-check");
      await shot("console-check");

      await type(line(60, 6)); // few: planning searches long for each point that cannot be reached
      await me().text("#run-check", /^✕ \d+ of 6 points cannot be reached\. Point \d+: arm a: .* mm/);
      await page().waitForSelector('#run-check[data-level="bad"]');
      await shot("console-check-missed");
      await type(line(10, "many"));
      await me().text("#run-check", /^✕ .*points/);
      await type(line(10).replace("points:", "pionts:"));
      await me().text("#run-check", /^✕ .*pionts.*did you mean .*points/);
    },

    async "preview: a check rehearses with the gains that are set, and anew when one is set"() {
      const periods = async (changedFrom) => {
        await me().text("#run-check", /^✓ All 20 points can be reached\. nspqp needs \d+ control periods/);
        if (changedFrom !== undefined)
          await page().waitForFunction(
            (was) => {
              const found = /needs (\d+) control/.exec(document.getElementById("run-check").textContent);
              return found && Number(found[1]) !== was;
            },
            changedFrom,
            { timeout: 30e3 },
          );
        return Number(/needs (\d+) control/.exec(await page().textContent("#run-check"))[1]);
      };
      const set = async (gain) => {
        await me().tab("method");
        await page().fill('[data-parameter="tip_gain"]', gain);
        await me().press("#apply");
        await me().said(new RegExp(`tip_gain = ${gain}: done`));
        await me().tab("operate");
      };
      await me().press("#take");
      await me().text("#lease", /this page/);
      await type(line(10).replace("following: timed", "")); // a point waits for the gains, time does not
      const before = await periods();
      await set("0.5");
      const slow = await periods(before);
      assert.ok(slow > 1.5 * before, `${slow} periods with a sixth of the gain, ${before} before`);
      await set("3");
      assert.strictEqual(await periods(slow), before);
      await me().press("#take");
      await me().text("#lease", /free/);
    },

    async "preview: none of the list is chosen once the trajectory is edited, and a choice replaces the edit"() {
      const chosen = () => page().$$eval("#trajectory input:checked", (all) => all.map(({ value }) => value));
      const yaml = () => page().inputValue("#trajectory-text");
      await me().choose("trajectory", "circle");
      const served = await yaml();
      assert.deepStrictEqual(await chosen(), ["circle"]);
      await type(served.replace("points: 100", "points: 50"));
      assert.deepStrictEqual(await chosen(), [], "Start follows the edited text");
      await me().choose("trajectory", "circle");
      assert.strictEqual(await yaml(), served);
      await page().$eval("#trajectory-form", (element) => (element.open = true));
      await page().fill('[data-key="points"]', "50");
      assert.deepStrictEqual(await chosen(), [], "Start follows the form");
      assert.match(await yaml(), /name: circle-edited\n/);
      await page().$eval("#trajectory-form", (element) => (element.open = false));
      await me().choose("trajectory", "line");
    },

    async "preview: a trajectory with tasks that the form does not show is edited as YAML alone"() {
      await page().$eval("#trajectory-form", (element) => (element.open = true));
      await me().choose("trajectory", "remote-centre");
      await me().text(
        "#form-note",
        /Not editable as a form: it has tasks for which there is no field: remote_centre\./,
      );
      const editable = "#trajectory-form input:not(:disabled)";
      assert.strictEqual(await page().locator(editable).count(), 0);
      const yaml = await page().inputValue("#trajectory-text");
      assert.match(yaml, /remote_centre/);
      await page().locator("#trajectory-form").scrollIntoViewIfNeeded();
      await shot("console-form-refused");
      await type(yaml.replace("points: 50", "points: 40"));
      await me().text("#run-check", /^(✓ All 40|✕ \d+ of 40) points/);
      await me().choose("trajectory", "circle");
      await me().text("#form-note", /^$/);
      assert.notStrictEqual(await page().locator(editable).count(), 0);
      await page().$eval("#trajectory-form", (element) => (element.open = false));
      await me().choose("trajectory", "line");
    },

    async "preview: ghosts pass the joints that the robot then passes, which stands meanwhile"() {
      const since = monotonic();
      await type(line(15));
      await me().text("#run-check", /^✓ All 20 points/);
      await drawn();
      const before = await scene();
      await page().evaluate(() => {
        const note = document.getElementById("preview-note");
        window.ghosts = [];
        new MutationObserver(() =>
          window.ghosts.push({ joints: note.dataset.joints.split(" ").map(Number), said: note.textContent }),
        ).observe(note, { attributeFilter: ["data-joints"] });
      });
      // A busy machine draws few poses while the preview plays; those that came too late are drawn when it plays again.
      let seen = false;
      let ghosts = [];
      const said = /^PREVIEW, not the robot: point 1\d of 20, \d+\.\d s after the start$/;
      for (let play = 0; play < 8; ++play) {
        await me().press("#run-preview");
        await me().text("#run-preview", /^End preview$/);
        while (!seen && (await page().textContent("#run-preview")) === "End preview") {
          if (differing(await scene(), before) <= 20) continue;
          seen = true; // the notice is no part of the scene: only ghosts change it
          await shot("console-preview");
        }
        await me().text("#run-preview", /^Preview$/);
        ghosts = await page().evaluate(() => window.ghosts);
        if (seen && ghosts.length >= kGhosts && ghosts.some((ghost) => said.test(ghost.said))) break;
      }
      assert.ok(seen, "no ghosts are drawn");
      assert.ok(ghosts.length >= kGhosts, `only ${ghosts.length} ghosts were seen`);
      assert.ok(
        ghosts.some((ghost) => said.test(ghost.said)),
        `the notices are ${ghosts.map((ghost) => ghost.said).join("; ")}`,
      );
      await page().waitForSelector("#preview-note[hidden]", { state: "attached" });
      await me().waitForScene("ghosts are gone", (s) => differing(s, before) < 5);
      await robot().until("be observed", () => true);
      assert.ok(robot().changed < since, "a joint moved in the preview");

      const passed = [];
      const watch = () => passed.push(robot().joints);
      robot().waiting.add(watch);
      await enable();
      await me().press("#run-start");
      await me().text("#progress", /finished/);
      await robot().stands("the end of the run", monotonic());
      robot().waiting.delete(watch);
      const ways = passed.slice(1).map((joints, k) => [passed[k], joints]);
      const worst = Math.max(...ghosts.map(({ joints }) => Math.min(...ways.map((way) => fromWay(joints, way)))));
      console.log(
        `    ${ghosts.length} ghosts, ${worst.toExponential(1)} m or rad from the way of the joints in the run`,
      );
      assert.ok(worst < kGhost, "the robot went elsewhere");
    },

    async "preview: a trajectory is made with a form, and the server's parser names the wrong field"() {
      await page().$eval("#trajectory-form", (element) => (element.open = true));
      const yaml = () => page().inputValue("#trajectory-text");
      await me().choose("trajectory", "line");
      await me().choose("trajectory", "lissajous");
      assert.strictEqual(await page().inputValue('[data-key="amplitude_mm"] >> nth=1'), "10");
      for (const shape of ["line", "rectangle", "circle"]) {
        await me().choose("form-shape", shape);
        await me().text("#form-caption", /mm; ○ start/);
        assert.match(await yaml(), new RegExp(`  ${shape}:\n`));
        await me().text("#run-check", /^(✓ All|✕ \d+ of) 100 points/);
      }
      await page().fill('[data-key="points"]', "40");
      await page().fill('[data-key="center_offset_mm"] >> nth=1', "6");
      assert.match(await yaml(), /center_offset_mm: \[0, 6, 0\]/);
      await me().text("#run-check", /^✓ All 40 points/);
      await page().locator("#trajectory-form").scrollIntoViewIfNeeded();
      await shot("console-form");
      await page().fill('[data-key="speed_mm_per_s"]', "fast");
      await page().waitForSelector('[data-key="speed_mm_per_s"][aria-invalid="true"]');
      assert.match(await me().text("#run-check", /✕/), /speed_mm_per_s: found the text "fast", expected a speed/);
      assert.strictEqual(await page().getAttribute('[data-key="points"]', "aria-invalid"), "false");
      await page().fill('[data-key="speed_mm_per_s"]', "3");
      await page().waitForSelector('[data-key="speed_mm_per_s"][aria-invalid="false"]');
      for (const [key, typed, reason] of [
        ["speed_mm_per_s", "1,5", /speed_mm_per_s: found the text "1,5", expected a speed/],
        ["speed_mm_per_s", "", /speed_mm_per_s: found the text "", expected a speed/],
        ["center_offset_mm", "1,5", /center_offset_mm.*: found the text "1,5", expected a/],
        ["center_offset_mm", "", /center_offset_mm.*: found the text "", expected a/],
      ]) {
        const field = page().locator(`[data-key="${key}"]`).last();
        const before = await field.inputValue();
        await field.fill(typed);
        assert.match(await me().text("#run-check", reason), /^✕/);
        await page().waitForSelector(`[data-key="${key}"][aria-invalid="true"]`);
        await field.fill(before);
      }
      // The tip of the arm that kept its relative position: the two change places, and none is relative to itself.
      assert.match(await yaml(), /relative: \[arm_a, arm_b\]\n {2}- tip: arm_a\n/);
      await page().waitForSelector('#form-other label[title*="follows the shape"] input[value="arm_a"]:disabled');
      await me().choose("form-arm", "arm_b");
      assert.match(await yaml(), /relative: \[arm_b, arm_a\]\n {2}- tip: arm_b\n/);
      await page().waitForSelector('#form-other input[value="arm_b"]:disabled');
      await page().waitForSelector('#form-other input[value="arm_a"]:checked:not(:disabled)');
      await page().fill("#trajectory-text", `${await yaml()}\n`);
      await me().text("#form-note", /not that of this form/);
      await page().$eval("#trajectory-form", (element) => (element.open = false));
    },

    async "preview: after a run the arms stand elsewhere, and the check is repeated"() {
      await run();
      await me().text("#run-check", /Not checked: a trajectory runs|The arms have moved/);
      await me().press("#run-end");
      await me().text("#run-check", /^(✓ All|✕) .*points/);
    },

    async "preview: the range that a joint has now is said, and drawn as the line that its tip follows"() {
      await enable();
      const row = page().locator('.bar:has([aria-label="Hold to jog translation of tube 2 of arm A up"])');
      const before = await scene();
      await row.hover();
      const text = await me().text("#span", /^.* of arm A: now -?[\d.]+ to -?[\d.]+ mm; green: where the tip gets$/);
      const [lower, upper] = text.match(/-?[\d.]+(?= (to|mm))/g).map(Number);
      const lengths = robot()
        .last.arms[0].joints.slice(0, 3)
        .map((beta) => 1000 * beta);
      // Tube 2 moves between tubes 1 and 3, whose places bound it more than the robot file does (equation 1).
      assert.ok(lower >= lengths[0] - 1 && upper <= lengths[2] + 1, `${text}; tubes at ${lengths}`);
      assert.ok(lower <= lengths[1] + 0.01 && upper >= lengths[1] - 0.01, `${text}; tubes at ${lengths}`);
      await me().waitForScene("the line is drawn", (s) => differing(s, before) > 3);
      await shot("console-span");
      await page().locator('.bar:has([aria-label$="of arm A up"])').nth(3).hover();
      await me().text("#span", /of arm A: turns freely; green/);
      await page().mouse.move(5, 5);
      await page().waitForSelector("#span[hidden]", { state: "attached" });
      await me().waitForScene("the line is gone", (s) => differing(s, before) < 3);
    },

    async "preview: all topics are recorded, with marks, from the page"() {
      await me().text("#recording", /Nothing was recorded yet/);
      await page().waitForSelector('#record-mark[aria-disabled="true"][title="Nothing is recorded."]');
      await me().press("#record");
      await me().text("#recording", /● RECORDING \d+ s, [1-9]\d* messages/);
      await page().fill("#record-mark-text", "the tips touch: 100 % & more");
      await me().press("#record-mark");
      await me().text("#recording", /1 mark \(last: the tips touch: 100 % & more, at/);
      await page().locator("#recording").scrollIntoViewIfNeeded();
      await shot("console-recording");
      const other = await open();
      await other.text("#recording", /● RECORDING/);
      await other.press("#record");
      await other.page.context().close();
      await me().text("#recording", /^Recorded \d+ s, \d+ messages/);
      await me().said(/Recording: Recorded/);
      const file = await page().getAttribute("#recording", "title");
      const info = spawnSync(robot().tandem, ["info", file, "--json"], { encoding: "utf8" });
      const found = JSON.parse(info.stdout);
      assert.strictEqual(found.metadata["mark 1"].text, "the tips touch: 100 % & more");
      const topics = JSON.stringify(found);
      for (const topic of ["actuation/state", "control/status", "hal/status"]) assert.ok(topics.includes(topic), topic);
      const refused = await fetch(`${server.url}/api/recording/stop`, { method: "POST" });
      assert.strictEqual(refused.status, 400);
      assert.match(await refused.text(), /no recording runs/);
    },

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
          await drawn(1);
          const tips = await page().getAttribute("#view", "data-tips");
          assert.deepStrictEqual(await page().evaluate(covered), [], `camera ${camera}, ${width} x ${height}: ${tips}`);
          if (width === 1280) await shot(`preview-camera-${camera}`);
        }
      }
      await me().resize(1280, 720);
    },
  };
};
