// SPDX-License-Identifier: Apache-2.0
// Scenes of teleoperation with orientation: keys, the ring and a gamepad turn the tip, by its orientation in `tandem status`, while they are
// held. Run by page_test.py Orientation.
"use strict";
const assert = require("node:assert");
const { monotonic } = require("./harness.js");
const { operator } = require("./holding.js");

const kTurned = 0.03; // rad
const kLittle = 2e-3; // rad
const kStuck = /The arm cannot turn further in this direction: ([\d.]+)° are left\./;
/** Cameras that look against and along the base frame's z axis, about which the arms at home turn their tips fastest. */
const kFront = 2;
const kEndoscope = 6;
const kTips = 5;
const kSide = 3;
const kRing = 60; // px

/** Rotation vector from one orientation (x y z w) to another, axes of the base frame, rad. */
function rotation([x, y, z, w], [X, Y, Z, W]) {
  const v = [-W * x + X * w - Y * z + Z * y, -W * y + X * z + Y * w - Z * x, -W * z - X * y + Y * x + Z * w];
  const real = W * w + X * x + Y * y + Z * z;
  const sine = Math.hypot(...v);
  const angle = 2 * Math.atan2(sine, Math.abs(real));
  return v.map((value) => (sine > 0 ? (Math.sign(real) * angle * value) / sine : 0));
}

module.exports = (tools) => {
  const { robot, me, shot } = tools;
  const page = () => me().page;
  const { ready, holdingOn, cut, staysReleased, gamepad } = operator(tools);
  const orientation = (status) => status.arms[0].tip_orientation;
  const now = () => robot().until("show its tips", (s) => orientation(s) !== null);

  /** Needs teleoperation to be on: the ring shows that the page has drawn what the camera sees. */
  async function look(camera) {
    await ready();
    for (const one of [kSide, camera]) {
      const before = await page().getAttribute("#ring", "style");
      await page().click(`[data-camera="${one}"]`);
      await page().waitForFunction((old) => document.querySelector("#ring").getAttribute("style") !== old, before);
    }
    await page().focus("#view");
  }
  /** Turns tip A while it is driven. @returns its rotation vector */
  async function turns(what, press, holder, release, least = kTurned) {
    let turned;
    await ready();
    const start = orientation(await now());
    const done = () =>
      robot().until(`turn: ${what}`, (s) => Math.hypot(...(turned = rotation(start, orientation(s)))) > least);
    await holdingOn(press, holder, done, release);
    console.log(`    ${what}: turned by ${turned.map((x) => x.toFixed(3)).join(", ")} rad`);
    return turned;
  }
  async function keyTurns(key) {
    let release;
    const press = async () => (release = await me().holdKey(key));
    return { turned: await turns(key, press, key, () => release()), release: () => release() };
  }
  /** Mostly about the base frame's z axis, by this sign. */
  function aboutZ(turned, sign) {
    assert.ok(sign * turned[2] > 0.8 * Math.hypot(...turned), `turned by ${turned} rad`);
  }
  /** Along the ring, counterclockwise. */
  async function dragRing() {
    const box = await page().locator("#ring").boundingBox();
    const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
    await page().mouse.move(x + kRing, y);
    await page().mouse.down();
    for (let angle = 0.1; angle < 0.9; angle += 0.1)
      await page().mouse.move(x + kRing * Math.cos(angle), y - kRing * Math.sin(angle));
  }
  const ringTurns = (what) => turns(what, dragRing, "ring", () => page().mouse.up());
  /** Ends a turn by an event in the scene. */
  async function endedBy(how, words, turn, event, release) {
    for (let left = 10; ; --left) {
      await turn();
      const since = monotonic();
      await page().$eval("#view", event);
      const lamp = await me().text("#teleop-held", /^[^●]/);
      if (left === 0 || !/hung|out of date/.test(lamp)) return cut(how, since, words);
      await release();
    }
  }

  return {
    async "orientation: held keys turn the tip about the axes of the view that is shown, letting go stops it"() {
      await ready();
      await me().text("#teleop-orientation", /^Turns the whole tip, behind all positions/);
      for (const [camera, key, sign] of [
        [kFront, "KeyU", 1],
        [kFront, "KeyO", -1],
        [kEndoscope, "KeyU", -1],
      ]) {
        await look(camera);
        const { turned, release } = await keyTurns(key);
        aboutZ(turned, sign);
        const since = monotonic();
        await release();
        await cut(`letting ${key} go`, since, /ready|released/);
        const there = orientation(await now());
        await robot().stands("nothing is held", monotonic());
        assert.ok(Math.hypot(...rotation(there, orientation(await now()))) < kLittle, "the tip turns on");
      }
    },

    async "orientation: the pointer turns the tip by its ring, and stops it when it lets go"() {
      for (const [camera, sign] of [
        [kFront, 1],
        [kEndoscope, -1],
      ]) {
        await look(camera);
        aboutZ(await ringTurns("the ring is dragged"), sign);
        const since = monotonic();
        await page().mouse.up();
        await cut("letting the ring go", since, /ready|released/);
      }
      await look(kTips);
      const seen = async () => {
        for (const figure of ["#teleop-turn", "#turn"])
          await me().text(figure, /^tip A [\d.]+° from its commanded orientation/);
        await me().text("#errors", /^error [\d.]+ mm \/ [\d.]+ mm \/ [\d.]+°/);
        await shot("console-turn");
      };
      await holdingOn(dragRing, "ring", seen, () => page().mouse.up());
      await page().mouse.up();
    },

    async "orientation: a second pointer, a menu and a lost capture end a turn"() {
      await look(kFront);
      for (const [how, words, event] of [
        [
          "a second pointer",
          /a second pointer was pressed/,
          (e) => e.dispatchEvent(new PointerEvent("pointerdown", { pointerId: 77, bubbles: true })),
        ],
        ["a menu", /a menu was asked for/, (e) => e.dispatchEvent(new MouseEvent("contextmenu", { bubbles: true }))],
        [
          "another button",
          /a second button was pressed/,
          (e) => e.dispatchEvent(new MouseEvent("mousedown", { button: 2, bubbles: true })),
        ],
        ["a lost capture", /ready|released/, (e) => e.releasePointerCapture(1)],
      ]) {
        const letGo = () => page().mouse.up();
        await endedBy(how, words, () => ringTurns(`before ${how}`), event, letGo);
        await page().mouse.move(5, 5, { steps: 3 }); // still down
        await robot().stands(`after ${how}`, monotonic());
        assert.doesNotMatch(await page().textContent("#teleop-held"), /held:/);
        await letGo();
      }
      let key;
      const turn = async () => (key = await keyTurns("KeyU"));
      const menu = (e) => e.dispatchEvent(new MouseEvent("contextmenu", { bubbles: true }));
      await endedBy("a menu while a key is held", /a menu was asked for/, turn, menu, () => key.release());
      await staysReleased(key.release);
    },

    async "orientation: sticks turn the tip while RB is held with the trigger"() {
      const pad = await gamepad();
      await look(kFront);
      const press = () => pad.set([0, 0, 0, 1], 7, 5);
      aboutZ(await turns("RT and RB of the gamepad", press, "gamepad", () => pad.set([0, 0, 0, 0])), 1);
      const since = monotonic();
      await pad.set([0, 0, 0, 1], 5); // RB alone holds nothing
      await cut("letting the trigger go", since, /ready|released/);
      await pad.pullOut();
      await pad.forget();
    },

    async "orientation: where the arm cannot turn further, the panel says so with the angle that is left"() {
      await look(kFront);
      assert.ok(await page().locator("#teleop-stuck").isHidden(), "it is said before anything turns");
      for (let said = false, left = 20; !said; --left) {
        assert.ok(left > 0, "the arm has been turned for long, and nothing is said");
        const release = await me().holdKey("KeyI");
        // On a busy machine the page or control ends a hold: the operator lets go and holds again.
        const found = await page().waitForFunction(() => {
          const text = (id) => document.getElementById(id).textContent;
          if (/cannot turn/.test(text("teleop-stuck"))) return text("teleop-stuck");
          const ended = /^○ released/.test(text("teleop-held")) || /^stopped/.test(text("teleop-state"));
          return ended ? "ended" : "";
        });
        const text = await found.jsonValue();
        said = text !== "ended";
        if (said) {
          assert.match(text, kStuck);
          assert.ok(Number(kStuck.exec(text)[1]) > 0.2, text);
          assert.ok(await page().locator("#teleop-stuck").isVisible());
          console.log(`    ${text}`);
        }
        await release();
        if (!said) await ready();
      }
      await page().waitForSelector("#teleop-stuck", { state: "hidden" });
    },

    async "tip axis: keys turn it where the deployment says axis, and the panel says what is free"() {
      await ready();
      await me().text(
        "#teleop-orientation",
        /^Turns the tip axis \(blue\), behind all positions; about it the tip is free\./,
      );
      const axis = ([x, y, z, w]) => [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)];
      const between = (a, b) => Math.acos(Math.min(1, a[0] * b[0] + a[1] * b[1] + a[2] * b[2]));
      for (const key of ["KeyJ", "KeyL"]) {
        await look(kFront);
        const start = axis(orientation(await now()));
        let release;
        const press = async () => (release = await me().holdKey(key));
        const done = async () => {
          await robot().until(`turn its axis by ${key}`, (s) => between(start, axis(orientation(s))) > kLittle);
          await me().text("#teleop-turn", /^tip A [\d.]+° from its commanded orientation/);
        };
        await holdingOn(press, key, done, () => release());
        const since = monotonic();
        await release();
        await cut(`letting ${key} go`, since, /ready|released/);
        await robot().stands("nothing is held", monotonic());
      }
    },

    async "orientation: a hidden page ends a turn"() {
      const { release } = await keyTurns("KeyO");
      const since = monotonic();
      await me().hide(true);
      await cut("hiding the tab", since, /the tab is hidden/);
      await me().hide(false);
      await release();
    },
  };
};
