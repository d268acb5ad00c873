// SPDX-License-Identifier: Apache-2.0
// Scenes of tablets, phones, large letters and both themes. Run by page_test.py Access.
"use strict";
const assert = require("node:assert");
const fs = require("node:fs");
const path = require("node:path");
const { chromium } = require("playwright-core");
const { Operator, kChromium } = require("./harness.js");
const { unreached } = require("./layout.js");

const kTablets = [
  [768, 1024],
  [1280, 800],
];
const kPhones = [
  [375, 667],
  [667, 375],
  [320, 568],
];
const kTabs = ["operate", "method", "teleoperate", "health", "log"];
const kFinger = 44; // px
/** What a phone offers: to stop, to look, to read. */
const kWatching =
  /^(stop|tab-health|tab-log|sound|acknowledge|log-(search|export)|camera|thickness|clear trail|theme|level)/;

/** What can be pressed: of radios and check boxes, their labels. Runs in the page. */
function targets() {
  const all = [...document.querySelectorAll("button, summary, textarea, input")].map((e) =>
    e.matches('[type="radio"], [type="checkbox"]') ? e.closest("label") : e,
  );
  return all
    .filter((e) => e.getClientRects().length > 0)
    .map((e) => {
      const { width, height } = e.getBoundingClientRect();
      const inside = e.querySelector("input") ?? e;
      const name = inside.dataset.camera ? "camera" : inside.dataset.level ? "level" : "";
      return {
        name: name || e.id || inside.name || e.textContent.trim() || e.getAttribute("aria-label"),
        width,
        height,
      };
    });
}

/** Texts that are cut off: neither visible nor reached by scrolling. Runs in the page. */
function cutOff() {
  const found = [];
  const texts = document.createTreeWalker(document.getElementById("app"), NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const node = texts.currentNode;
    const range = document.createRange();
    range.selectNodeContents(node);
    const box = range.getBoundingClientRect();
    if (node.textContent.trim() === "" || box.width === 0) continue;
    const open = { x: true, y: true };
    for (let at = node.parentElement; at; at = at.parentElement) {
      const { overflowX, overflowY } = getComputedStyle(at);
      const seen = at.getBoundingClientRect();
      const beyond = {
        x: box.left < seen.left - 1 || box.right > seen.right + 1,
        y: box.top < seen.top - 2 || box.bottom > seen.bottom + 2,
      };
      for (const [axis, overflow] of [
        ["x", overflowX],
        ["y", overflowY],
      ]) {
        if (overflow === "auto" || overflow === "scroll") open[axis] = false;
        if (open[axis] && (overflow === "hidden" || overflow === "clip") && beyond[axis])
          found.push(`${axis}: "${node.textContent.slice(0, 60)}" in ${at.className || at.id || at.tagName}`);
      }
    }
  }
  const { scrollWidth } = document.documentElement;
  return scrollWidth > innerWidth + 1 ? [...found, `the page is ${scrollWidth} wide, the window ${innerWidth}`] : found;
}

/** Parts of the scene's overlay that cover each other. Runs in the page. */
function covered() {
  const parts = [...document.querySelectorAll(".cameras > *, .notices, .legend, .figures > *, .rate")]
    .filter((e) => e.getClientRects().length > 0)
    .map((e) => [e.id || e.textContent.trim().slice(0, 30), e.getBoundingClientRect()]);
  return parts.flatMap(([name, a], k) =>
    parts
      .slice(k + 1)
      .filter(([, b]) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom)
      .map(([other]) => `${name} and ${other}`),
  );
}

/** Names of what is offered and headings, without values. Runs in the page. */
const offered = () =>
  [...document.querySelectorAll("button, summary, label, h2, .name, .progress")]
    .filter((e) => e.getClientRects().length > 0)
    .map((e) => e.id || e.textContent.trim());

module.exports = ({ robot, me, server, setting, enable, run, open }) => {
  const page = () => me().page;
  const save = (whose, name) => whose.page.screenshot({ path: path.join(setting.artifacts, `${name}.png`) });
  const device = ([width, height]) =>
    open(undefined, { viewport: { width, height }, screen: { width, height }, hasTouch: true, isMobile: true });

  /** A browser whose letters have twice their size. */
  async function withLargeLetters(act) {
    const folder = fs.mkdtempSync(path.join(path.dirname(setting.deployment), "profile-"));
    fs.mkdirSync(path.join(folder, "Default"));
    const preferences = { webkit: { webprefs: { default_font_size: 32, default_fixed_font_size: 26 } } };
    fs.writeFileSync(path.join(folder, "Default", "Preferences"), JSON.stringify(preferences));
    const context = await chromium.launchPersistentContext(folder, {
      ...kChromium(setting),
      viewport: { width: 1280, height: 720 },
    });
    try {
      const other = await new Operator(context.pages()[0], server.url).load();
      const size = await other.page.evaluate(() => parseFloat(getComputedStyle(document.documentElement).fontSize));
      assert.strictEqual(size, 26, "letters of the page do not follow those of the browser");
      await act(other);
    } finally {
      await context.close();
    }
  }

  return {
    async "devices: on a tablet, what a finger presses is at least 44 px"() {
      for (const size of kTablets) {
        const tablet = await device(size);
        for (const tab of kTabs) {
          await tablet.page.tap(`#tab-${tab}`);
          const small = (await tablet.page.evaluate(targets)).filter(
            ({ width, height }) => Math.min(width, height) < kFinger - 0.5,
          );
          assert.deepStrictEqual(small, [], `${tab}, ${size}`);
          assert.deepStrictEqual(await tablet.page.evaluate(cutOff), [], `${tab}, ${size}`);
          assert.deepStrictEqual(await tablet.page.evaluate(covered), [], `${tab}, ${size}`);
          const controls = ["stop", "run-pause", "run-resume", "run-end"];
          assert.deepStrictEqual(await tablet.page.evaluate(unreached, controls), [], `${tab}, ${size}`);
        }
        await tablet.page.locator(".jog").last().scrollIntoViewIfNeeded();
        await save(tablet, `console-tablet-${size[0]}`);
        await tablet.page.context().close();
      }
    },

    async "devices: on a phone one watches and stops, and commands nothing"() {
      for (const size of kPhones) {
        const phone = await device(size);
        await phone.text("#on-phone", /On a phone: watch and STOP only/);
        assert.ok(await phone.page.locator("#on-phone").isVisible());
        for (const tab of ["health", "log"]) {
          await phone.page.tap(`#tab-${tab}`);
          const commands = (await phone.page.evaluate(targets)).filter(({ name }) => !kWatching.test(name));
          assert.deepStrictEqual(commands, [], `a phone of ${size} offers commands`);
          assert.deepStrictEqual(await phone.page.evaluate(cutOff), [], `${tab}, ${size}`);
          assert.deepStrictEqual(await phone.page.evaluate(covered), [], `${tab}, ${size}`);
        }
        await phone.page.evaluate(() => window.scrollTo(0, 0));
        await save(phone, `console-phone-${size[0]}`);
        for (const end of [0, 1e5]) {
          await phone.page.evaluate((y) => window.scrollTo(0, y), end);
          assert.deepStrictEqual(await phone.page.evaluate(unreached, ["stop"]), [], `${size}`);
        }
        if (size === kPhones[0]) {
          await me().page.bringToFront();
          await run();
          await phone.page.bringToFront();
          await phone.page.tap("#stop");
          await robot().until("stop for a phone", (s) => s.arms.every((arm) => /stop_requested/.test(arm.faults)));
          await phone.text("#stop-note", /confirmed after/);
        }
        await phone.page.context().close();
      }
      await page().bringToFront();
    },

    async "devices: letters of twice the size, or a page of twice the size, lose nothing"() {
      await enable();
      const everything = {};
      for (const tab of kTabs) {
        await me().tab(tab);
        everything[tab] = await page().evaluate(offered);
        assert.deepStrictEqual(await page().evaluate(cutOff), [], `${tab}, at its size`);
      }
      const compare = async (other, how) => {
        for (const tab of kTabs) {
          await other.tab(tab);
          await other.page.waitForFunction(
            (id) => document.getElementById(id).getAttribute("aria-selected") === "true",
            `tab-${tab}`,
          );
          assert.deepStrictEqual(await other.page.evaluate(offered), everything[tab], `${tab}, ${how}`);
          assert.deepStrictEqual(await other.page.evaluate(cutOff), [], `${tab}, ${how}`);
          assert.deepStrictEqual(await other.page.evaluate(covered), [], `${tab}, ${how}`);
          assert.deepStrictEqual(await other.page.evaluate(unreached, ["stop"]), [], `${tab}, ${how}`);
        }
      };
      await me().resize(1280, 720, 2);
      await compare(me(), "200 % of the page");
      await me().resize(1280, 720);
      await withLargeLetters(async (other) => {
        await compare(other, "200 % of the letters");
        await other.tab("operate");
        await save(other, "console-letters");
      });
      await me().tab("operate");
    },

    async "devices: dark and light, as the system asks or as chosen, which is kept"() {
      const other = await open();
      const ground = () => other.page.evaluate(() => getComputedStyle(document.body).backgroundColor);
      const [dark, light] = ["rgb(11, 15, 20)", "rgb(238, 242, 246)"];
      for (const [scheme, colour] of [
        ["dark", dark],
        ["light", light],
      ]) {
        await other.page.emulateMedia({ colorScheme: scheme });
        assert.strictEqual(await ground(), colour);
      }
      await other.tab("health");
      await other.choose("theme", "dark");
      assert.strictEqual(await ground(), dark);
      await other.load();
      assert.strictEqual(await ground(), dark, "the choice is not kept");
      await other.tab("health");
      await other.choose("theme", "system");
      assert.strictEqual(await ground(), light);
      await other.page.context().close();
    },
  };
};
