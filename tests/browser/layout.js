// SPDX-License-Identifier: Apache-2.0
// Scenes of the page's layout: stop and the trajectory's controls can be reached at any size, above all else, and nothing moves under the
// pointer.
"use strict";
const assert = require("node:assert");
const fs = require("node:fs");
const path = require("node:path");
const { monotonic } = require("./harness.js");

const kWindows = [
  [320, 568],
  [375, 667],
  [768, 1024],
  [1024, 600],
  [1280, 720],
  [1920, 1080],
  [3840, 2160],
];
const kZooms = [0.5, 0.67, 1, 1.5, 2, 3];
/** With each layer: the smallest and the largest, and both sides of the change of the layout. */
const kExtremes = [
  [320, 568, 3],
  [320, 568, 1],
  [1279, 720, 1],
  [1280, 640, 1],
  [3840, 2160, 1],
];
/** Widths and heights of windows for scroll bars: the smallest that are used, and both sides of each change of the layout. */
const kWidths = [107, 160, 211, 240, 264, 265, 320, 442, 768, 1039, 1040, 1279, 1280, 1920, 3840];
const kHeights = [480, 600, 639, 640, 641, 720, 800, 1080, 2160];
/** Width and height from which everything is visible without scrolling. */
const kWhole = [1280, 640];
const kControls = ["stop", "run-pause", "run-resume", "run-end"];

/** Of each control: what is wrong with it; empty if a pointer reaches it everywhere. Runs in the page. */
const unreached = (ids) =>
  ids.flatMap((id) => {
    const button = document.getElementById(id);
    if (!button) return [`${id} is not there`];
    const box = button.getBoundingClientRect();
    if (box.width < 20 || box.height < 20) return [`${id} is only ${box.width} x ${box.height}`];
    if (box.left < 0 || box.top < 0 || box.right > innerWidth + 0.5 || box.bottom > innerHeight + 0.5)
      return [`${id} is outside: ${JSON.stringify(box)}`];
    const hidden = [0.1, 0.5, 0.9]
      .flatMap((x) => [0.1, 0.5, 0.9].map((y) => [box.left + x * box.width, box.top + y * box.height]))
      .map(([x, y]) => document.elementFromPoint(x, y))
      .find((hit) => !button.contains(hit));
    return hidden === undefined ? [] : [`${id} is under ${hidden?.outerHTML.slice(0, 80)}`];
  });

/** Texts of the parts that are always visible of which a part is cut off. Runs in the page. */
const clipped = () => {
  const parts = [".top", ".top *", "#stopping .note", ".run > output"].flatMap((of) => [
    ...document.querySelectorAll(of),
  ]);
  const top = document.querySelector(".top").getBoundingClientRect();
  return parts
    .filter((part) => part.getClientRects().length > 0)
    .filter((part) => {
      const box = part.getBoundingClientRect();
      const outside = (a, b) => a < b - 0.5;
      return (
        part.scrollWidth > part.clientWidth + 1 + (part.clientWidth === 0 ? part.scrollWidth : 0) ||
        part.scrollHeight > part.clientHeight + 1 + (part.clientHeight === 0 ? part.scrollHeight : 0) ||
        (part.closest(".top") &&
          (outside(box.top, top.top) || outside(top.bottom, box.bottom) || outside(box.left, 0))) ||
        outside(innerWidth, box.right)
      );
    })
    .map((part) => `${part.tagName} ${part.id || part.className}: ${part.textContent}`);
};
/** Places of all that has one. Runs in the page. */
const places = () =>
  [...document.querySelectorAll("button, input, textarea, output, .card, .chart, .arm")]
    .filter((e) => !e.closest(".found, .run output, .figures, .rate, .chart output") && e.getClientRects().length > 0)
    .map((e) => {
      const { x, y } = e.getBoundingClientRect();
      return `${e.id || e.getAttribute("aria-label") || e.dataset.arm || e.className}: ${x.toFixed(0)}, ${y.toFixed(0)}`;
    });
/** By how much the page is larger than the window: to the right, and down. Runs in the page. */
const beyond = () => {
  const { scrollWidth, scrollHeight } = document.documentElement;
  return [scrollWidth - innerWidth, scrollHeight - innerHeight];
};
/** Whether both tips are in the scene as it is seen. Runs in the page. */
const tipsSeen = () => {
  const view = document.querySelector("#view");
  const tips = view.dataset.tips.split(" ").map((tip) => tip.split(",").map(Number));
  return tips.length === 2 && tips.every(([x, y]) => x > 0 && y > 0 && x < view.clientWidth && y < view.clientHeight);
};

module.exports = ({ robot, me, server, setting, takeControl, enable, run, open }) => {
  const page = () => me().page;
  async function reached(where, width, height, zoom) {
    await me().resize(width, height, zoom);
    for (const bottom of [false, true]) {
      await page().evaluate((end) => window.scrollTo(0, end ? document.documentElement.scrollHeight : 0), bottom);
      const wrong = await page().evaluate(unreached, kControls);
      assert.deepStrictEqual(wrong, [], `${where}, ${width} x ${height} at ${100 * zoom} %, scrolled: ${bottom}`);
    }
    const cut = await page().evaluate(clipped);
    assert.deepStrictEqual(cut, [], `cut off: ${where}, ${width} x ${height} at ${100 * zoom} %`);
    await page()
      .waitForFunction(tipsSeen)
      .catch((error) =>
        assert.fail(`tips out of the scene: ${where}, ${width} x ${height} at ${100 * zoom} %: ${error}`),
      );
  }
  /** Of the window as resize() made it. */
  async function picture(name) {
    const { data } = await me().session.send("Page.captureScreenshot");
    fs.writeFileSync(path.join(setting.artifacts, `${name}.png`), data, "base64");
  }
  async function back() {
    await me().resize(1280, 720);
    await page().evaluate(() => window.scrollTo(0, 0));
  }
  /** The layers of the page, each with its opening and its closing. */
  const layers = {
    "the Method panel": [() => me().tab("method"), () => me().tab("operate")],
    "the Log panel": [() => me().tab("log"), () => me().tab("operate")],
    "the trajectory as YAML": [
      () => page().click("#trajectory-yaml > summary"),
      () => page().click("#trajectory-yaml > summary"),
    ],
    "the curtain, and a stop that is not confirmed": [
      async () => {
        process.kill(setting.pids.control, "SIGSTOP");
        await me().state("#link", "stale");
        await page().waitForSelector("#curtain:not([hidden])");
        await page().keyboard.press("Escape");
        await me().text("#stop-note", /NOT CONFIRMED/);
      },
      async () => {
        process.kill(setting.pids.control, "SIGCONT");
        await me().state("#link", "live");
        await enable();
      },
    ],
    "a stop that cannot be sent": [
      async () => {
        await server.kill();
        await me().state("#link", "lost");
        await page().keyboard.press("Escape");
        await me().text("#stop-note", /NOT SENT/);
      },
      async () => {
        await server.start();
        await me().state("#link", "live");
        await enable();
      },
    ],
    "a notice of a fault": [
      async () => {
        robot().command("stop");
        await page().waitForSelector('[data-fault="arm_a"]:not([hidden])');
      },
      () => enable(),
    ],
  };

  return {
    async "stop and the trajectory's controls are reached at any size, zoom and layer"() {
      await enable();
      for (const [width, height] of kWindows)
        for (const zoom of kZooms) {
          await reached("the page", width, height, zoom);
          if ((width === 320 && zoom !== 0.5) || (width === 3840 && zoom === 1) || (width === 1280 && zoom === 2))
            await picture(`layout-${width}-${100 * zoom}`);
        }
      await back();
      for (const [name, [show, hide]] of Object.entries(layers)) {
        await show();
        try {
          for (const [width, height, zoom] of kExtremes) await reached(name, width, height, zoom);
        } finally {
          await back();
          await hide();
        }
      }
      const native = await page().$$eval(
        'select, dialog, datalist, [list], input:is([type="file"], [type="date"], [type="color"])',
        (all) => all.map((one) => one.outerHTML.slice(0, 80)),
      );
      assert.deepStrictEqual(native, [], "the browser's own lists and dialogs receive Esc, and cover the page");
    },

    async "stop stays in sight while a pinch magnifies the page"() {
      const other = await open();
      const { page: its } = other;
      await other.resize(800, 600);
      for (const scale of [1.5, 3]) {
        await other.session.send("Emulation.setPageScaleFactor", { pageScaleFactor: scale });
        await its.waitForFunction((wanted) => Math.abs(visualViewport.scale - wanted) < 0.05, scale);
        await its.evaluate(() => window.scrollTo(0, 200));
        await its.waitForFunction(() => {
          const [box, seen] = [document.getElementById("stop").getBoundingClientRect(), visualViewport];
          const near = (a, b) => Math.abs(a - b) < 25;
          return (
            near(box.left, seen.offsetLeft) &&
            near(box.top, seen.offsetTop) &&
            box.right <= seen.offsetLeft + seen.width + 1
          );
        });
      }
      await other.page.context().close();
    },

    async "Esc stops in every field, and the page says where it does not"() {
      await takeControl();
      const places = {
        "a list": async () => {
          await me().tab("operate");
          await page().focus("#trajectory input:checked");
        },
        "the trajectory's text": async () => {
          await page().click("#trajectory-yaml > summary");
          await page().focus("#trajectory-text");
        },
        "a parameter": async () => {
          await me().tab("method");
          await page().focus("[data-parameter]");
        },
        "the find key": async () => {
          await page().keyboard.press("Control+f");
          assert.strictEqual(await page().evaluate(() => document.activeElement.id), "log-search");
        },
        "a right click": async () => {
          await me().tab("log");
          await page().click("#view", { button: "right" });
          await page().click("#log-search", { button: "right" });
        },
      };
      for (const [name, go] of Object.entries(places)) {
        await enable();
        await go();
        const from = monotonic();
        await page().keyboard.press("Escape");
        await robot().until(`stop by Esc in ${name}`, (s) => s.arms.every((arm) => /stop_requested/.test(arm.faults)));
        await me().text("#stop-note", /confirmed after/);
        console.log(`    in ${name}: ${(monotonic() - from).toFixed(0)} ms until the robot was seen stopped`);
      }
      await me().tab("operate");
      await page().click("#trajectory-yaml > summary");
      // Another window in front stands for the find bar and menus of the browser, which headless Chromium has not.
      await me().text("#stop-key", /^Esc stops/);
      const session = await page().context().newCDPSession(page());
      await session.send("Emulation.setFocusEmulationEnabled", { enabled: false });
      const other = await page().context().newPage();
      await other.bringToFront();
      await me().text("#stop-key", /Esc does NOT stop/);
      await other.close();
      await page().bringToFront();
      await me().text("#stop-key", /^Esc stops/);
      await session.send("Emulation.setFocusEmulationEnabled", { enabled: true });
      await enable();
    },

    async "nothing moves under the pointer when a run, a fault and messages come"() {
      await enable();
      /** Without the scrolling that precedes a click of Playwright. */
      const push = async (button) => {
        await page().waitForSelector(`${button}[aria-disabled="false"]`);
        await page().$eval(button, (element) => element.click());
      };
      for (const [width, height] of [
        [1280, 720],
        [800, 900],
      ]) {
        await enable();
        await me().resize(width, height);
        await me().choose("trajectory", "line");
        await page().evaluate(() => window.scrollTo(0, 0));
        const before = await page().evaluate(places);
        await push("#run-start");
        await robot().moves("a trajectory runs");
        await me().text("#progress", /running/);
        assert.deepStrictEqual(await page().evaluate(places), before, "a run has moved something");
        robot().command("stop");
        await page().waitForSelector('[data-fault="arm_a"]:not([hidden])');
        await me().said(/stop_requested/);
        assert.deepStrictEqual(await page().evaluate(places), before, "a fault has moved something");
        await push("#disable");
        await robot().states("DISABLED");
        assert.deepStrictEqual(await page().evaluate(places), before, "the end of a fault has moved something");
      }
      await back();
    },

    async "a panel at its end does not move when the next run is started"() {
      await run();
      await me().press("#run-end");
      await page().waitForSelector("#run-summary:not(.away)");
      const end = () =>
        page().$eval(".panel:not([hidden])", (panel) => {
          panel.scrollTop = panel.scrollHeight;
          return panel.scrollTop;
        });
      assert.ok((await end()) > 0, "the panel has no end to scroll to");
      const before = await page().evaluate(places);
      await page().waitForSelector('#run-start[aria-disabled="false"]');
      await page().$eval("#run-start", (button) => button.click()); // a click of Playwright would scroll to it
      await me().text("#progress", /running/);
      await page().waitForSelector("#run-summary.away", { state: "attached" }); // its space stays
      assert.deepStrictEqual(await page().evaluate(places), before, "the start has moved something");
      await me().press("#run-end");
      await page().waitForSelector("#run-summary:not(.away)");
      assert.deepStrictEqual(await page().evaluate(places), before, "the end has moved something");
      await page().$eval(".panel:not([hidden])", (panel) => (panel.scrollTop = 0));
    },

    async "no window scrolls sideways, and none at all where everything has its place"() {
      const wrong = [];
      const look = async (tab, width, height) => {
        await me().resize(width, height);
        const [right, down] = await page().evaluate(beyond);
        const window = `${tab}, ${width} x ${height}`;
        if (right > 0) wrong.push(`${window}: ${right} px to the right`);
        if (width >= kWhole[0] && height >= kWhole[1] && down > 0) wrong.push(`${window}: ${down} px down`);
      };
      for (const height of kHeights) for (const width of [320, 1280, 1920]) await look("operate", width, height);
      for (const tab of ["method", "teleoperate", "health", "log", "operate"]) {
        await me().tab(tab);
        for (const width of kWidths) await look(tab, width, 720);
        await back();
      }
      await back();
      assert.deepStrictEqual(wrong, []);
    },

    async "a hidden page says that it loses control, and loses it"() {
      await takeControl();
      await me().press("#take");
      await me().text("#lease", /Control: free/);
      await me().text("#unseen", /hidden, this page loses control after 3 s/); // said before control is taken
      await run();
      const title = await page().title();
      await me().hide(true);
      try {
        await page().waitForFunction(() => /hidden: control is lost in \d s/.test(document.title));
        const since = monotonic();
        await robot().until("lose its commander", (s) => s.arms.every((arm) => /lease_lost/.test(arm.faults)));
        console.log(`    control was lost ${(monotonic() - since).toFixed(0)} ms after the page was hidden`);
        await page().waitForFunction(() => /CONTROL LOST/.test(document.title));
        await page().waitForSelector('#take[aria-disabled="true"][title="This page is hidden."]');
        await robot().stands("without a commander", monotonic());
      } finally {
        await me().hide(false);
      }
      assert.strictEqual(await page().title(), title);
      await me().said(/The page is hidden: control is lost in 3 s/);
      await me().said(/Control lease lost/);
      await enable();
    },
  };
};
module.exports.unreached = unreached;
module.exports.places = places;
