// SPDX-License-Identifier: Apache-2.0
// Scenes of teleoperation: the page's keys and pointer move the robot while they are held, and no longer.
"use strict";
const assert = require("node:assert");
const { monotonic } = require("./harness.js");
const { kMost, kReaction, operator } = require("./holding.js");

module.exports = (tools) => {
  const { robot, me, shot } = tools;
  const page = () => me().page;
  const { ready, holdingOn, hold, cut, staysReleased, gamepad, letGo } = operator(tools);

  return {
    async "a held key moves the tip, letting go stops it"() {
      await hold("ArrowUp", async () => {
        await robot().moves("ArrowUp is held");
        await me().text("#teleop-state", /following/);
        await shot("console-teleoperation");
      });
      const since = monotonic();
      await letGo();
      await cut("letting go", since, /ready|released/);
    },

    async "the pointer drags the tip"() {
      await ready();
      await page().waitForSelector("#handle");
      // The view at the start is that of the first camera, as long as the arms have hardly moved.
      for (const camera of [2, 1]) {
        const frames = await page().evaluate(() => {
          const handle = document.querySelector("#handle");
          window.places = [];
          new MutationObserver(() => window.places.push(handle.getAttribute("style").match(/-?\d+/g))).observe(handle, {
            attributes: true,
            attributeFilter: ["style"],
          });
          return document.querySelector("#fps").dataset.frames;
        });
        await page().click(`[data-camera="${camera}"]`);
        await page().waitForFunction(
          (old) => window.places.length > 0 && document.querySelector("#fps").dataset.frames !== old,
          frames,
        );
        const places = await page().evaluate(() => window.places);
        const far = places.filter(([x, y]) => Math.hypot(x - places.at(-1)[0], y - places.at(-1)[1]) > 5);
        assert.deepStrictEqual(far, [], `the handle was elsewhere on its way to ${places.at(-1)}`);
      }
      const drag = async () => {
        const box = await page().locator("#handle").boundingBox();
        const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
        await page().mouse.move(x, y);
        await page().mouse.down();
        await page().mouse.move(x + 25, y + 15, { steps: 5 });
      };
      await holdingOn(
        drag,
        "pointer",
        () => robot().moves("the pointer drags"),
        () => page().mouse.up(),
      );
      const since = monotonic();
      await page().mouse.up();
      await cut("letting the pointer go", since, /ready|released/);
    },

    async "a gamepad moves the tip, and stops it when it is pulled out"() {
      await ready();
      const pad = await gamepad();
      await pad.set([0, -1, 0, 0]);
      const before = monotonic();
      await robot().stands("while the trigger is not held", before);
      const drive = async () => {
        await robot().moves("stick and trigger of the gamepad");
        await pad.set([0, -1, 0, 0], 7, 4);
        await me().text("#teleop-state", /clutched/, kReaction);
        await pad.set([0, -1, 0, 0], 7);
        await me().text("#teleop-state", /following/, kReaction);
      };
      const press = () => pad.set([0, -1, 0, 0], 7);
      await holdingOn(press, "gamepad", drive, () => pad.set([0, 0, 0, 0]));
      const since = monotonic();
      await pad.pullOut();
      await cut("pulling the gamepad out", since, /disconnected/);
      await pad.forget();
    },

    async "where turning is ignored, the page offers nothing that turns, and says why"() {
      await ready();
      const why =
        /Turning: The deployment ignores orientations \(teleoperation\.orientation: ignored\); its arms could/;
      await page().waitForFunction(
        (source) => [...document.querySelectorAll(".reasons")].some((e) => new RegExp(source).test(e.textContent)),
        why.source,
      );
      assert.ok(await page().locator("#handle").isVisible());
      assert.ok(!(await page().locator("#ring").isVisible()), "a ring is offered");
      const [start] = (await robot().until("show its tip", (s) => s.arms[0].tip_orientation)).arms;
      for (const key of ["KeyU", "KeyI", "KeyL"]) {
        const before = monotonic();
        const release = await me().holdKey(key);
        await robot().stands(`${key} is held`, before);
        assert.doesNotMatch(await page().textContent("#teleop-held"), /held:/);
        await release();
      }
      const pad = await gamepad();
      const press = () => pad.set([1, -1, 0, -1], 7, 5);
      const following = () => me().text("#teleop-state", /following/, kReaction);
      await holdingOn(press, "gamepad", following, () => pad.set([0, 0, 0, 0]));
      await robot().stands("sticks that turn", monotonic());
      await pad.pullOut();
      await pad.forget();
      const { arms } = await robot().until("show its tip", () => true);
      start.tip_orientation.forEach((x, k) => assert.ok(Math.abs(x - arms[0].tip_orientation[k]) < 1e-3));
    },

    async "a hidden tab stops teleoperation"() {
      await hold("ArrowUp");
      const since = monotonic();
      await me().hide(true);
      await cut("hiding the tab", since, /the tab is hidden/);
      await me().hide(false);
      await staysReleased();
    },

    async "losing the focus stops teleoperation"() {
      const session = await page().context().newCDPSession(page());
      await session.send("Emulation.setFocusEmulationEnabled", { enabled: false });
      await page().bringToFront();
      await hold("ArrowUp");
      const other = await page().context().newPage();
      const since = monotonic();
      await other.bringToFront();
      await cut("another window in front", since, /lost the focus|ready/);
      await other.close();
      await page().bringToFront();
      await session.send("Emulation.setFocusEmulationEnabled", { enabled: true });
      await letGo();
    },

    async "a page that hangs stops teleoperation"() {
      await hold("ArrowUp");
      const since = monotonic();
      // The page executes nothing for 2 s: control receives no input, and must stop without a message.
      const hang = page().evaluate(() => {
        const end = performance.now() + 2000;
        while (performance.now() < end);
      });
      const took = await robot().stands("while the page hangs", since);
      assert.ok(took < kMost, `joints moved for ${took} ms`);
      console.log(`    the page hangs: the last joint moved ${took.toFixed(0)} ms later, as seen every 100 ms`);
      await hang;
      await letGo();
      await me().press("#teleop-on");
    },
  };
};
