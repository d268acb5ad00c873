// SPDX-License-Identifier: Apache-2.0
// Scenes of jogging: a joint moves while its button is held by one press, and anything that may hide the release ends it.
"use strict";
const assert = require("node:assert");
const { monotonic } = require("./harness.js");

const kButtons = '[aria-label^="Hold to jog"][aria-label$="of arm A up"]';

module.exports = ({ robot, me, enable }) => {
  const page = () => me().page;
  async function place() {
    await enable();
    await me().tab("operate");
    const button = page().locator(kButtons).nth(3); // the innermost tube's roll, which has no limits
    await button.scrollIntoViewIfNeeded();
    await page().waitForFunction((e) => e.getAttribute("aria-disabled") === "false", await button.elementHandle());
    const box = await button.boundingBox();
    return [box.x + box.width / 2, box.y + box.height / 2];
  }
  /** Presses until the joint moves: on a busy machine a press may end by the gap of its timer. */
  async function hold() {
    const [x, y] = await place();
    await page().mouse.move(x, y);
    for (let attempt = 0; ; ++attempt) {
      await page().mouse.down();
      try {
        await robot().moves("a jog button is held", 5000);
        return [x, y];
      } catch (error) {
        await page().mouse.up();
        if (attempt === 10) throw error;
      }
    }
  }
  /** The joint stands although nothing was released. */
  async function ends(how, cut, release = () => page().mouse.up()) {
    const [x, y] = await hold();
    const since = monotonic();
    await cut(x, y);
    const took = await robot().stands(how, since);
    console.log(`    ${how}: the joint moved ${took.toFixed(0)} ms longer, as seen every 100 ms`);
    assert.ok(took < 1500, `${how}: the joint moved for ${took} ms`);
    await release();
    await page().keyboard.press("Shift"); // a menu, if there is one, closes
  }

  return {
    async "a right click on a jog button moves nothing"() {
      const [x, y] = await place();
      const since = monotonic();
      await page().mouse.move(x, y);
      await page().mouse.down({ button: "right" });
      await robot().stands("a right click", since, 1500);
      assert.ok(robot().changed < since, "the joint moved");
      await page().mouse.up({ button: "right" });
      await page().keyboard.press("Escape");
      await robot().until("stop by Esc", (s) => s.arms.every((arm) => arm.operating_state === "FAULT"));
    },

    async "a press moves the joint although another element has the focus"() {
      const [x, y] = await place();
      await page().mouse.move(x, y);
      for (let attempt = 0; attempt < 10; ++attempt) {
        await page().focus("#tab-operate");
        await page().mouse.down();
        const moved = await robot()
          .moves("a jog button is held", 5000)
          .then(() => true)
          .catch(() => false);
        await page().mouse.up();
        if (moved) return;
        // On a busy machine a press may end by the gap of its timer, or be refused: the page says so.
        assert.match(
          await page().locator("body").innerText(),
          /Let it go, and hold it again|Jog refused/,
          "ended in silence",
        );
      }
      assert.fail("no press has moved the joint");
    },

    async "a jog ends with the press, whatever hides its release"() {
      await ends(
        "letting go",
        () => page().mouse.up(),
        () => {},
      );
      await ends("another button of the mouse", async () => {
        await page().mouse.down({ button: "right" });
        await page().mouse.up({ button: "right" });
      });
      await ends("a menu", () =>
        page().evaluate(() => document.body.dispatchEvent(new Event("contextmenu", { bubbles: true }))),
      );
      await ends("a second pointer", () =>
        page().evaluate(() =>
          document.body.dispatchEvent(
            new PointerEvent("pointerdown", { bubbles: true, pointerId: 7, pointerType: "touch" }),
          ),
        ),
      );
      await ends("a key", () => page().keyboard.press("Tab"));
      await ends("leaving the button", (x, y) => page().mouse.move(x + 300, y + 200));
      const send = (where, event) =>
        page().evaluate(
          ([to, name]) =>
            (to === "window" ? window : document.querySelector(".jog:active")).dispatchEvent(new PointerEvent(name)),
          [where, event],
        );
      await ends("a cancelled pointer", () => send("button", "pointercancel"));
      await ends("a lost capture", () => send("button", "lostpointercapture"));
      await ends("a window that loses the focus", () => send("window", "blur"));
      await ends(
        "a hidden page",
        () => me().hide(true),
        async () => {
          await page().mouse.up();
          await me().hide(false);
        },
      );
    },

    async "a jog does not outlive a page that hangs"() {
      // Less than the budget of control, which here is 500 ms: the page itself ends the motion.
      for (const hung of [200, 700]) {
        await hold();
        const since = monotonic();
        await page().evaluate((milliseconds) => {
          const end = performance.now() + milliseconds;
          while (performance.now() < end);
        }, hung);
        await robot().stands(`the page has hung for ${hung} ms, and the button is still down`, since);
        // Nothing else says why: the button is still down, and the link is as before.
        const newest = page()
          .locator(".messages li", { hasText: /of arm A up: ended, because/ })
          .first();
        assert.match(
          await newest.textContent(),
          /Hold to jog .* of arm A up: ended, because this page hung for \d+ ms, .* Let it go, and hold it again\./,
        );
        await page().mouse.up();
      }
    },
  };
};
