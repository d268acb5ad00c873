// SPDX-License-Identifier: Apache-2.0
// Equipment of scenes of teleoperation: an operator who holds keys, the pointer or a gamepad, on a busy machine several times.
"use strict";
const assert = require("node:assert");
const { monotonic } = require("./harness.js");

const kReaction = 20000; // ms for a text to follow a device
const kTaken = 3000; // ms for the page to take a hold, before the next attempt
const kAttempts = 20;
const kMost = 1500; // ms from release to standstill, as seen through `tandem status` on a busy machine

function operator({ robot, me, enable }) {
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
  /** Where the page hangs or its data get old, a hold ends: on a busy machine the operator lets go and holds again.
   * @param press  begins to hold @param holder  what the page calls it @param done  is met while it is held */
  async function holdingOn(press, holder, done, release) {
    for (let left = kAttempts; ; --left) {
      await press();
      try {
        await me().text("#teleop-held", new RegExp(`held: ${holder}`), left > 0 ? kTaken : kReaction);
        const ended = me().text("#teleop-held", /^[^●]/, 0);
        const met = done().then(() => "");
        for (const promise of [ended, met]) promise.catch(() => {}); // the one that comes second
        const why = await Promise.race([met, ended]);
        if (why === "") return;
        throw new Error(why);
      } catch (error) {
        if (left === 0 || /held:/.test(await page().textContent("#teleop-held"))) throw error;
        console.log(`    the hold ended: ${error.message}`);
      }
      await release();
      await ready();
    }
  }
  async function hold(key, done = () => robot().moves(`${key} is held`)) {
    await ready();
    const press = async () => (letGo = await me().holdKey(key));
    await holdingOn(press, key, done, () => letGo());
  }
  async function cut(how, since, words) {
    await me().text("#teleop-held", words);
    const took = await robot().stands(how, since);
    console.log(`    ${how}: the last joint moved ${took.toFixed(0)} ms later, as seen every 100 ms`);
    assert.ok(took < kMost, `${how}: joints moved for ${took} ms`);
  }
  /** After a cut-off, motion does not resume when the cause is removed while the key is still down. */
  async function staysReleased(release = () => letGo()) {
    await page().focus("#view");
    await robot().stands("while the key is down from before", monotonic());
    assert.doesNotMatch(await page().textContent("#teleop-held"), /held:/);
    await release();
  }
  /** Neither Chromium nor this kernel may have a gamepad: the page receives the event that browsers send.
   * @returns sets its axes and the buttons that are down, or pulls it out (no axes) */
  async function gamepad() {
    await page().evaluate(() => {
      const buttons = Array.from({ length: 17 }, () => ({ pressed: false, touched: false, value: 0 }));
      window.pad = { index: 0, id: "test", connected: true, mapping: "standard", axes: [0, 0, 0, 0], buttons };
      navigator.getGamepads = () => [window.pad];
      window.dispatchEvent(Object.assign(new Event("gamepadconnected"), { gamepad: window.pad }));
    });
    return {
      set: (axes, ...down) =>
        page().evaluate(
          ([a, pressed]) => {
            window.pad.axes = a;
            window.pad.buttons.forEach((button, k) =>
              Object.assign(button, { pressed: pressed.includes(k), value: +pressed.includes(k) }),
            );
          },
          [axes, down],
        ),
      pullOut: () =>
        page().evaluate(() => {
          const gone = window.pad;
          gone.connected = false;
          navigator.getGamepads = () => [null];
          window.dispatchEvent(Object.assign(new Event("gamepaddisconnected"), { gamepad: gone }));
        }),
      forget: () => page().evaluate(() => delete navigator.getGamepads),
    };
  }
  return { ready, holdingOn, hold, cut, staysReleased, gamepad, letGo: () => letGo() };
}

module.exports = { kMost, kReaction, operator };
