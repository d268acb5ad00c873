// SPDX-License-Identifier: Apache-2.0
// Test equipment of page.js: the console's process, the browser, and the robot observed independently of the page.
"use strict";
const assert = require("node:assert");
const { spawn, spawnSync } = require("node:child_process");
const fs = require("node:fs");
const net = require("node:net");
const path = require("node:path");
const readline = require("node:readline");
const { chromium } = require("playwright-core");

const kStill = 1e-6; // m or rad
const kTimeout = 60000; // ms, for any event on a busy machine

const monotonic = () => Number(process.hrtime.bigint()) / 1e6; // ms, the clock of the robot's stamps

/** tandem-console, which can be started, killed, and restarted at the same port. */
class Server {
  constructor(setting) {
    this.setting = setting;
    this.url = `http://127.0.0.1:${setting.port}`;
  }
  /** @param largest  bytes that a file may have: beyond them its disk is full */
  async start(largest = 0) {
    const { bin, deployment, port, page } = this.setting;
    const words = ["--deployment", deployment, "--port", String(port), "--page", page, "--log", "warn"];
    const limit = largest > 0 ? ["prlimit", `--fsize=${largest}`] : [];
    const [program, ...rest] = [...limit, path.join(bin, "tandem-console"), ...words];
    this.process = spawn(program, rest, { stdio: ["ignore", "inherit", "inherit"] });
    this.ended = new Promise((resolve) => this.process.once("exit", resolve));
    const end = monotonic() + kTimeout;
    while (monotonic() < end) {
      assert.strictEqual(this.process.exitCode, null, "tandem-console has ended");
      const answer = await fetch(`${this.url}/healthz`).catch(() => null);
      if (answer && answer.ok) return;
      await new Promise((again) => setTimeout(again, 50));
    }
    throw new Error("tandem-console does not answer /healthz");
  }
  async kill(signal = "SIGKILL") {
    this.process.kill(signal);
    await this.ended;
  }
}

/** A second server at a port of its own, with a changed copy of the deployment file. */
async function serve(setting, name, change) {
  const deployment = path.join(path.dirname(setting.deployment), `${name}.yaml`);
  fs.writeFileSync(deployment, change(fs.readFileSync(setting.deployment, "utf8")));
  const server = new Server({ ...setting, deployment, port: setting.spare });
  await server.start();
  return server;
}

/** A proxy in front of the server that holds back what the server sends for `delay` ms, in order. */
class SlowLink {
  constructor(server) {
    this.delay = 0;
    this.listener = net.createServer((client) => {
      const upstream = net.connect(server.setting.port, "127.0.0.1");
      let last = 0;
      upstream.on("data", (chunk) => {
        last = Math.max(last, monotonic() + this.delay);
        setTimeout(() => client.write(chunk), last - monotonic());
      });
      client.on("data", (chunk) => upstream.write(chunk));
      for (const [one, other] of [
        [client, upstream],
        [upstream, client],
      ])
        for (const end of ["close", "error"]) one.on(end, () => other.destroy());
    });
  }
  async start() {
    await new Promise((ready) => this.listener.listen(0, "127.0.0.1", ready));
    return `http://127.0.0.1:${this.listener.address().port}`;
  }
  close() {
    this.listener.close();
  }
}

/** A proxy in front of the server that keeps the WebSocket frames which the server sends, and inserts others between them. */
class FrameLink extends SlowLink {
  constructor(server) {
    super(server);
    /** Frames of the server, whole, with their headers. */
    this.frames = [];
    this.clients = [];
    this.listener.removeAllListeners("connection");
    this.listener.on("connection", (client) => {
      const upstream = net.connect(server.setting.port, "127.0.0.1");
      let bytes = Buffer.alloc(0);
      let upgraded = false;
      upstream.on("data", (chunk) => {
        bytes = Buffer.concat([bytes, chunk]);
        if (!upgraded) {
          const end = bytes.indexOf("\r\n\r\n");
          upgraded = end >= 0 && bytes.toString("latin1", 0, 12) === "HTTP/1.1 101";
          const head = upgraded ? end + 4 : bytes.length;
          client.write(bytes.subarray(0, head));
          bytes = bytes.subarray(head);
          if (upgraded) this.clients.push(client);
        }
        for (let size = frameSize(bytes); upgraded && size > 0 && size <= bytes.length; size = frameSize(bytes)) {
          this.frames.push(Buffer.from(bytes.subarray(0, size)));
          client.write(bytes.subarray(0, size));
          bytes = bytes.subarray(size);
        }
      });
      client.on("data", (chunk) => upstream.write(chunk));
      for (const [one, other] of [
        [client, upstream],
        [upstream, client],
      ])
        for (const end of ["close", "error"]) one.on(end, () => other.destroy());
    });
  }
  /** Sends frames to the page of the newest connection, as if they were of its server. */
  insert(frames) {
    for (const frame of frames) this.clients.at(-1).write(frame);
  }
}
/** Bytes of the first frame of a server (RFC 6455: not masked); 0 while its header is not complete. */
function frameSize(bytes) {
  if (bytes.length < 4) return bytes.length >= 2 && bytes[1] < 126 ? 2 + bytes[1] : 0;
  if (bytes[1] < 126) return 2 + bytes[1];
  if (bytes[1] === 126) return 4 + bytes.readUInt16BE(2);
  return bytes.length < 10 ? 0 : 10 + Number(bytes.readBigUInt64BE(2));
}

/** The robot according to `tandem status --follow`, independently of the page. */
class Robot {
  constructor({ bin, deployment }) {
    this.tandem = path.join(bin, "tandem");
    this.deployment = deployment;
    this.process = spawn(this.tandem, ["status", deployment, "--json", "--follow", "--wait", "60"], {
      stdio: ["ignore", "pipe", "inherit"],
    });
    this.last = null;
    this.changed = 0; // ms: stamp of the last state with a changed joint
    this.waiting = new Set();
    readline.createInterface({ input: this.process.stdout }).on("line", (line) => this.received(JSON.parse(line)));
  }
  received(status) {
    assert.ok(status.arms, JSON.stringify(status)); // it has ended with a reason
    const joints = status.arms.flatMap((arm) => arm.joints);
    // A loop that holds a point changes its joints by rounding errors.
    if (!this.joints?.every((q, k) => Math.abs(q - joints[k]) < kStill)) {
      this.changed = status.stamps_ns.state / 1e6;
      this.joints = joints;
    }
    this.last = status;
    for (const wake of [...this.waiting]) wake();
  }
  close() {
    this.process.kill("SIGKILL");
  }
  /** The first status published after the call that meets `condition`. */
  until(what, condition, timeout = kTimeout) {
    const called = monotonic();
    return new Promise((resolve, reject) => {
      const look = () => {
        if (!this.last || this.last.stamps_ns.status / 1e6 < called || !condition(this.last)) return;
        clearTimeout(timer);
        this.waiting.delete(look);
        resolve(this.last);
      };
      const timer = setTimeout(() => {
        this.waiting.delete(look);
        reject(new Error(`the robot did not: ${what}; it says ${JSON.stringify(this.last)}`));
      }, timeout);
      this.waiting.add(look);
    });
  }
  states(state) {
    return this.until(`${state} of all arms`, (s) => s.arms.every((arm) => arm.operating_state === state));
  }
  async moves(what, timeout = kTimeout) {
    const from = (await this.until(`be there before ${what}`, () => true)).arms.map((arm) => arm.joints);
    const far = (s) => Math.max(...s.arms.flatMap((arm, k) => arm.joints.map((q, j) => Math.abs(q - from[k][j]))));
    return this.until(`move: ${what}`, (s) => far(s) > 1e-4, timeout);
  }
  /** Waits until no joint has moved for `quiet` ms. @returns ms from `since` (of monotonic()) to the last observed change. */
  async stands(what, since, quiet = 700) {
    await this.until(`stand: ${what}`, (s) => s.stamps_ns.state / 1e6 - Math.max(this.changed, since) > quiet);
    return Math.max(0, this.changed - since);
  }
  /** A command by `tandem robot`, as another client. */
  command(...words) {
    return spawnSync(this.tandem, ["robot", "--deployment", this.deployment, ...words], {
      encoding: "utf8",
      timeout: kTimeout,
    });
  }
}

const kChromium = (setting) => ({
  executablePath: setting.browser,
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"],
});

/** One page in a separate browser window. */
class Operator {
  static async launch(setting) {
    return chromium.launch(kChromium(setting));
  }
  /** @param device  of the browser's context: size of the window, touch */
  static async open(browser, url, device = { viewport: { width: 1280, height: 720 }, colorScheme: "dark" }) {
    const context = await browser.newContext(device);
    const page = await context.newPage();
    return new Operator(page, url).load();
  }
  constructor(page, url) {
    this.page = page;
    this.url = url;
    this.complaints = [];
    page.setDefaultTimeout(kTimeout);
    page.on("pageerror", (error) => this.complaints.push(`error: ${error.stack}`));
    page.on("console", (message) => {
      // Browsers log failed connections; the page is tested to handle them.
      if (
        ["error", "warning"].includes(message.type()) &&
        !/WebSocket connection|net::ERR_(CONNECTION|EMPTY_RESPONSE)|GPU stall|GL Driver/.test(message.text())
      )
        this.complaints.push(`${message.type()}: ${message.text()}`);
    });
    page.on("request", (request) => {
      if (!/^(data|blob):/.test(request.url()) && new URL(request.url()).host !== new URL(url).host)
        this.complaints.push(`asks ${request.url()}`);
    });
  }
  async load() {
    await this.page.goto(this.url);
    await this.state("#link", "live");
    return this;
  }
  async state(selector, value) {
    await this.page.waitForSelector(`${selector}[data-state="${value}"]`);
  }
  /** @param timeout ms; without it, that of the page */
  async text(selector, pattern, timeout) {
    await this.page.waitForFunction(
      ([where, source]) => new RegExp(source).test(document.querySelector(where)?.textContent ?? ""),
      [selector, pattern.source],
      { timeout },
    );
    return this.page.textContent(selector);
  }
  /** Chooses one of several values. */
  async choose(group, value) {
    await this.page.check(`#${group} input[value="${value}"]`);
  }
  /** Magnifies the page as a browser does: `zoom` pixels of a window of this size for each of the page. */
  async resize(width, height, zoom = 1) {
    this.session ??= await this.page.context().newCDPSession(this.page);
    const [w, h] = [Math.round(width / zoom), Math.round(height / zoom)];
    const metrics = { width: w, height: h, deviceScaleFactor: zoom, mobile: false };
    await this.session.send("Emulation.setDeviceMetricsOverride", metrics);
    await this.page.waitForFunction(([x, y]) => window.innerWidth === x && window.innerHeight === y, [w, h]);
  }
  /** Hides or shows the page. Headless Chromium never hides a tab: the page receives the event of a hidden one. */
  async hide(hidden) {
    await this.page.evaluate((is) => {
      Object.defineProperty(document, "visibilityState", {
        configurable: true,
        get: () => (is ? "hidden" : "visible"),
      });
      document.dispatchEvent(new Event("visibilitychange"));
    }, hidden);
  }
  /** Clicks the element while it is enabled: once more if old data had disabled it before the click came. */
  async press(selector) {
    const listen =
      'addEventListener("click", ({ target }) => (pressed = target.ariaDisabled), { capture: true, once: true })';
    do {
      await this.page.waitForSelector(`${selector}[aria-disabled="false"]`);
      await this.page.evaluate(listen);
      await this.page.click(selector);
    } while ((await this.page.evaluate("pressed").catch(() => "")) === "true"); // the click may have ended the page
  }
  /** Holds a button until `done` is met, in several attempts: on a busy machine a hold may end by the gap of its timer.
   * @param longest  of an attempt, ms */
  async hold(selector, done, longest = 3000) {
    await this.page.waitForSelector(`${selector}[aria-disabled="false"]`);
    await this.page.locator(selector).scrollIntoViewIfNeeded();
    const box = await this.page.locator(selector).boundingBox();
    await this.page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    for (let attempt = 0; attempt < 20; ++attempt) {
      await this.page.mouse.down();
      const met = await Promise.race([done, new Promise((over) => setTimeout(() => over("late"), longest))]);
      await this.page.mouse.up();
      if (met !== "late") return;
    }
    await done;
  }
  /** Holds a key as a person does: it repeats. @returns what lets it go */
  async holdKey(key) {
    let held = true;
    await this.page.keyboard.down(key);
    const repeated = (async () => {
      while (held) {
        await new Promise((again) => setTimeout(again, 100));
        if (held) await this.page.keyboard.down(key).catch(() => (held = false)); // the page is closed
      }
    })();
    return async () => {
      held = false;
      await repeated;
      await this.page.keyboard.up(key);
    };
  }
  async tab(name) {
    await this.page.click(`#tab-${name}`);
  }
  async said(pattern) {
    await this.text(".messages", pattern);
  }
  /** Numbers of pixels in the scene that are bluish (arm A), orange (arm B) and green (grasped object), and a coarse image for
   * comparison. */
  scene() {
    return this.page.evaluate(() => {
      const canvas = document.querySelector("#view canvas");
      const copy = document.createElement("canvas");
      [copy.width, copy.height] = [320, 180];
      const pen = copy.getContext("2d");
      pen.drawImage(canvas, 0, 0, 320, 180);
      const { data } = pen.getImageData(0, 0, 320, 180);
      let blue = 0;
      let orange = 0;
      let green = 0;
      const grey = [];
      for (let i = 0; i < data.length; i += 4) {
        const [r, g, b] = data.slice(i, i + 3);
        if (b > 90 && b > 1.35 * r && b > g) ++blue;
        if (r > 90 && r > 1.5 * b && r > g) ++orange;
        if (g > 60 && g > 1.15 * r && g > 1.4 * b) ++green;
        grey.push(r + g + b);
      }
      return { blue, orange, green, grey };
    });
  }
  async waitForScene(what, condition) {
    const end = monotonic() + kTimeout;
    let seen = await this.scene();
    while (!condition(seen)) {
      assert.ok(
        monotonic() < end,
        `${what}: ${seen.blue} bluish, ${seen.orange} orange and ${seen.green} green pixels`,
      );
      await new Promise((again) => setTimeout(again, 100));
      seen = await this.scene();
    }
    return seen;
  }
}

const differing = (a, b) => a.grey.reduce((count, value, k) => count + (Math.abs(value - b.grey[k]) > 60 ? 1 : 0), 0);

/** A test of its own process: starts server and browser, observes the robot, plays, ends all of them, and ends the process with the result.
 * After a failure there are pictures of all pages. @param play  gets setting, server, robot and browser */
async function operated(play) {
  const setting = JSON.parse(process.argv[2]);
  const server = new Server(setting);
  let robot;
  let browser;
  let good = false;
  try {
    await server.start();
    robot = new Robot(setting);
    browser = await Operator.launch(setting);
    await play({ setting, server, robot, browser });
    good = true;
  } catch (error) {
    console.log(`  BAD ${error.stack}`);
    const pages = browser?.contexts().flatMap((context) => context.pages()) ?? [];
    for (const [k, page] of pages.entries()) {
      console.log(`      page ${k + 1} says: ${await page.textContent(".messages").catch(() => "nothing")}`);
      await page.screenshot({ path: path.join(setting.artifacts, `bad-${k + 1}.png`) }).catch(() => {});
    }
  } finally {
    await browser?.close();
    robot?.close();
    if (server.process?.exitCode === null && server.process.signalCode === null) await server.kill("SIGTERM");
  }
  process.exit(good ? 0 : 1);
}

module.exports = {
  FrameLink,
  Operator,
  Robot,
  Server,
  SlowLink,
  differing,
  kChromium,
  kTimeout,
  monotonic,
  operated,
  serve,
};
