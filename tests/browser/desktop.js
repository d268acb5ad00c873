// SPDX-License-Identifier: Apache-2.0
// A desktop for tests: an X server without a screen, a window manager, and input that comes from the X server (xdotool).
"use strict";
const assert = require("node:assert");
const { spawn, spawnSync } = require("node:child_process");
const { chromium } = require("playwright-core");
const { kChromium, kTimeout, monotonic } = require("./harness.js");

const kScreen = "900x760x24";
/** Playwright keeps pages busy that nobody sees; an operator's browser does not. */
const kOnlyInTests = [
  "--disable-background-timer-throttling",
  "--disable-backgrounding-occluded-windows",
  "--disable-renderer-backgrounding",
];

class Desktop {
  static async start() {
    const desktop = new Desktop();
    desktop.server = spawn("Xvfb", ["-displayfd", "3", "-screen", "0", kScreen, "-nolisten", "tcp"], {
      stdio: ["ignore", "ignore", "ignore", "pipe"],
    });
    const number = await new Promise((resolve, reject) => {
      desktop.server.stdio[3].once("data", (text) => resolve(String(text).trim()));
      desktop.server.once("exit", (code) => reject(new Error(`Xvfb has ended with ${code}`)));
      desktop.server.once("error", reject);
    });
    desktop.environment = { ...process.env, DISPLAY: `:${number}` };
    delete desktop.environment.WAYLAND_DISPLAY;
    desktop.manager = spawn("openbox", [], { stdio: "ignore", env: desktop.environment });
    await desktop.until("window manager", () => desktop.ask("get_desktop").status === 0);
    return desktop;
  }
  async launch(setting) {
    const { executablePath, args } = kChromium(setting);
    return chromium.launch({
      executablePath,
      headless: false,
      env: this.environment,
      ignoreDefaultArgs: kOnlyInTests,
      args: [...args, "--ozone-platform=x11", "--window-position=0,0", "--window-size=820,700"],
    });
  }
  close() {
    this.manager?.kill("SIGKILL");
    this.server.kill("SIGTERM");
  }

  ask(...words) {
    return spawnSync("xdotool", words.map(String), { encoding: "utf8", env: this.environment, timeout: kTimeout });
  }
  /** xdotool WORDS... @returns what it prints */
  do(...words) {
    const { status, stdout, stderr } = this.ask(...words);
    assert.strictEqual(status, 0, `xdotool ${words.join(" ")}: ${stderr}`);
    return stdout.trim();
  }
  async until(what, condition) {
    const end = monotonic() + kTimeout;
    while (!(await condition())) {
      assert.ok(monotonic() < end, `there is no ${what}`);
      await new Promise((again) => setTimeout(again, 50));
    }
  }
  /** The window that has the keyboard; empty: none. */
  get focused() {
    return this.ask("getwindowfocus").stdout.trim();
  }

  /** Finds out where the page is on the screen: by a motion of the pointer that the page sees. */
  async locate(page) {
    const seen = page.evaluate(
      () =>
        new Promise((found) =>
          window.addEventListener("mousemove", (e) => found([e.screenX - e.clientX, e.screenY - e.clientY]), {
            once: true,
          }),
        ),
    );
    let offset = null;
    void seen.then((found) => (offset = found));
    let x = 300;
    await this.until("motion of the pointer in the page", () => {
      this.do("mousemove", (x += 5), 400);
      return offset !== null;
    });
    this.offset = offset;
  }
  /** Moves the pointer to the middle of an element, which is scrolled into sight. */
  async point(page, locator) {
    await locator.scrollIntoViewIfNeeded();
    const box = await locator.boundingBox();
    this.do(
      "mousemove",
      Math.round(this.offset[0] + box.x + box.width / 2),
      Math.round(this.offset[1] + box.y + box.height / 2),
    );
  }
  async click(page, selector) {
    await page.waitForSelector(`${selector}:not([aria-disabled="true"])`);
    await this.point(page, page.locator(selector));
    this.do("click", 1);
  }
}

module.exports = { Desktop };
