// SPDX-License-Identifier: Apache-2.0
// Scenes of teleoperation: the page's keys and pointer move the robot while they are held, and no longer.
"use strict";
const assert = require("node:assert");
const { monotonic } = require("./harness.js");

const kReaction = 20000; // ms for a text to follow a device
const kMost = 1500; // ms from release to standstill, as seen through `tandem status` on a busy machine

module.exports = ({ robot, me, enable, shot }) => {
  const page = () => me().page;
  let letGo; // of the key that is held
  async function ready() {
    await enable();
    await me().tab("teleoperate");
    if ((await page().getAttribute("#teleop-on", "aria-pressed")) !== "true") await me().press("#teleop-on");
    await me().text("#teleop-held", /^○ (ready|released)/);
    await me().text("#teleop-state", /^released/); // control must first receive the released switch
    await page().focus("#view");
  }
  /** Where the data on the page get old, a hold ends: on a busy machine the operator lets go and holds again. */
  async function holdingOn(drive, release) {
    for (let left = 5; ; --left) {
      try {
        return await drive();
      } catch (error) {
        if (left === 0 || /held:/.test(await page().textContent("#teleop-held"))) throw error;
        console.log(`    the hold ended: ${error.message}`);
        await release();
        await ready();
      }
    }
  }
  async function hold(key) {
    await ready();
    const drive = async () => {
      letGo = await me().holdKey(key);
      await me().text("#teleop-held", /held:/, kReaction);
      await robot().moves(`${key} is held`);
    };
    await holdingOn(drive, () => letGo());
  }
  async function cut(how, since, words) {
    await me().text("#teleop-held", words);
    const took = await robot().stands(how, since);
    console.log(`    ${how}: the last joint moved ${took.toFixed(0)} ms later, as seen every 100 ms`);
    assert.ok(took < kMost, `${how}: joints moved for ${took} ms`);
  }
  /** After a cut-off, motion does not resume when the cause is removed while the key is still down. */
  async function staysReleased() {
    await page().focus("#view");
    await robot().stands("while the key is down from before", monotonic());
    assert.doesNotMatch(await page().textContent("#teleop-held"), /held:/);
    await letGo();
  }

  return {
    async "a held key moves the tip, letting go stops it"() {
      await hold("ArrowUp");
      await me().text("#teleop-state", /following/);
      await shot("console-teleoperation");
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
        await me().text("#teleop-held", /held: pointer/, kReaction);
        await robot().moves("the pointer drags");
      };
      await holdingOn(drag, () => page().mouse.up());
      const since = monotonic();
      await page().mouse.up();
      await cut("letting the pointer go", since, /ready|released/);
    },

    async "a gamepad moves the tip, and stops it when it is pulled out"() {
      await ready();
      // Neither Chromium nor this kernel may have a gamepad: the page receives the event that browsers send.
      await page().evaluate(() => {
        const buttons = Array.from({ length: 17 }, () => ({ pressed: false, touched: false, value: 0 }));
        window.pad = { index: 0, id: "test", connected: true, mapping: "standard", axes: [0, 0, 0, 0], buttons };
        navigator.getGamepads = () => [window.pad];
        window.dispatchEvent(Object.assign(new Event("gamepadconnected"), { gamepad: window.pad }));
      });
      const set = (axes, held, clutch) =>
        page().evaluate(
          ([a, h, c]) => {
            window.pad.axes = a;
            for (const [button, down] of [
              [7, h],
              [4, c],
            ])
              Object.assign(window.pad.buttons[button], { pressed: down, value: +down });
          },
          [axes, held, clutch],
        );
      await set([0, -1, 0, 0], false, false);
      const before = monotonic();
      await robot().stands("while the trigger is not held", before);
      const drive = async () => {
        await set([0, -1, 0, 0], true, false);
        await me().text("#teleop-held", /held: gamepad/, kReaction);
        await robot().moves("stick and trigger of the gamepad");
        await set([0, -1, 0, 0], true, true);
        await me().text("#teleop-state", /clutched/, kReaction);
        await set([0, -1, 0, 0], true, false);
        await me().text("#teleop-state", /following/, kReaction);
      };
      await holdingOn(drive, () => set([0, 0, 0, 0], false, false));
      const since = monotonic();
      await page().evaluate(() => {
        const gamepad = window.pad;
        gamepad.connected = false;
        navigator.getGamepads = () => [null];
        window.dispatchEvent(Object.assign(new Event("gamepaddisconnected"), { gamepad }));
      });
      await cut("pulling the gamepad out", since, /disconnected/);
      await page().evaluate(() => delete navigator.getGamepads);
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
