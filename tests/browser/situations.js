// SPDX-License-Identifier: Apache-2.0
// Situations of an operator, each with a stop in it: what the robot did (by `tandem status`), what the page said, and when. The table
// goes into docs/console.md with TANDEM_WRITE_DOCS=1. Run by page_test.py Situations.
"use strict";
const assert = require("node:assert");
const fs = require("node:fs");
const path = require("node:path");
const { Server, SlowLink, monotonic } = require("./harness.js");

const kVerdict = 500; // ms after the press: the stop is confirmed, or the page says that it is not
const kBegin = "<!-- situations: written by browser_situations -->\n";
const kEnd = "<!-- end of situations -->";

/** Records in the page when each text about a stop appears, ms after the press, and whether there is a verdict when a timer of the
 * page ends: a busy host delays that timer as it delays the page. Runs in the page. */
function watch(within) {
  window.verdicts = [];
  window.inTime = null;
  window.verdict = () =>
    window.verdicts
      .filter(([, text]) => /confirmed after|NOT CONFIRMED|NOT SENT/.test(text))
      .map(([at, text]) => [at - window.pressed, text])[0];
  if (window.watched) return;
  window.watched = true;
  const press = (event) => {
    if (event.type === "keydown" ? event.key !== "Escape" : !event.target.closest?.("#stop")) return;
    window.pressed = event.timeStamp;
    setTimeout(() => (window.inTime = window.verdict() !== undefined), within);
  };
  for (const name of ["keydown", "pointerdown"]) window.addEventListener(name, press, { capture: true });
  const note = document.getElementById("stop-note");
  const look = () => window.verdicts.push([performance.now(), note.textContent]);
  new MutationObserver(look).observe(note, { childList: true, characterData: true, subtree: true });
}

module.exports = ({ robot, me, server, setting, takeControl, enable, run, open }) => {
  const page = () => me().page;
  const esc = (whose = page()) => whose.keyboard.press("Escape");
  const rows = [];

  /** A page through a link that holds back what the server sends. */
  async function slowly(delay, act) {
    const link = new SlowLink(server);
    const other = await open(await link.start());
    link.delay = delay;
    try {
      if (delay > 400) await other.state("#link", "stale");
      await act(other);
    } finally {
      await other.page.context().close();
      link.close();
    }
  }
  async function frozen(pid, act, link = "stale") {
    process.kill(pid, "SIGSTOP");
    try {
      await me().state("#link", link);
      await act();
    } finally {
      process.kill(pid, "SIGCONT");
    }
  }
  async function without(signal, act) {
    await server.kill(signal);
    await me().state("#link", "lost");
    try {
      await act();
    } finally {
      await server.start();
      await me().state("#link", "live");
    }
  }

  /** Presses. @returns the first verdict of the page, and when it came */
  async function stops(press, whose = me()) {
    await whose.page.evaluate(watch, kVerdict);
    await press();
    const seen = await (await whose.page.waitForFunction(() => window.inTime !== null && window.verdict())).jsonValue();
    assert.ok(await whose.page.evaluate(() => window.inTime), `no verdict within ${kVerdict} ms, then: ${seen}`);
    const [took, text] = seen;
    return /confirmed/.test(text) ? text.trim() : `${text.trim()} (after ${took.toFixed(0)} ms)`;
  }

  /** Name, what is done before the stop and the stop; `stopped`: what the robot's faults are afterwards. */
  const situations = {
    "a run": async () => stops(esc),
    "a run, the stop button": async () => stops(() => page().click("#stop")),
    "a link that lags 0.2 s": async (said) =>
      slowly(200, async (other) => said(await stops(() => esc(other.page), other))),
    "a link that lags 2 s": async (said) =>
      slowly(2000, async (other) => said(await stops(() => esc(other.page), other))),
    "a link that lags 20 s": async (said) =>
      slowly(20000, async (other) => said(await stops(() => esc(other.page), other))),
    "the server is killed": async (said) => without("SIGKILL", async () => said(await stops(esc))),
    "the server ends": async (said) => without("SIGTERM", async () => said(await stops(esc))),
    "control hangs": async (said) => frozen(setting.pids.control, async () => said(await stops(esc))),
    "the drives' process hangs": async (said) => frozen(setting.pids.sim, async () => said(await stops(esc))),
    "planning's process hangs": async (said) =>
      frozen(
        setting.pids.planning,
        async () => {
          await me().text("#progress", /not known for .* then running/);
          await me().text("#link", /NO DATA FROM PLANNING/);
          assert.match((await page().getAttribute("#run-pause", "title")) ?? "", /Planning does not answer/);
          said(await stops(esc));
          await me().text("#services", /silent · \d\.\d s old · tandem-planning: /);
          await me().said(/tandem-planning no longer reports/);
        },
        "partly",
      ),
    "another page without the lease": async (said) => {
      const other = await open();
      said(await stops(() => esc(other.page), other));
      await other.page.context().close();
    },
    "a hidden page": async (said) => {
      await me().hide(true);
      said(await stops(esc));
      await me().hide(false);
    },
    "magnified to 300 %": async (said) => {
      await me().resize(1280, 720, 3);
      said(await stops(() => page().locator("#stop").dispatchEvent("pointerdown", { bubbles: true })));
      await me().resize(1280, 720);
    },
    "a window of 320 x 568": async (said) => {
      await me().resize(320, 568);
      said(await stops(() => page().click("#stop")));
      await me().resize(1280, 720);
    },
    "after a right click": async (said) => {
      await page().click("#view", { button: "right" });
      said(await stops(esc));
    },
    "by touch": async (said) => {
      const box = await page().locator("#stop").boundingBox();
      const session = await page().context().newCDPSession(page());
      const touchPoints = [{ x: box.x + 20, y: box.y + 10 }];
      said(
        await stops(async () => {
          await session.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints });
          await session.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
        }),
      );
    },
    "after the find key": async (said) => {
      await page().keyboard.press("Control+f");
      said(await stops(esc));
    },
    "typing a trajectory": async (said) => {
      await page().click("#trajectory-yaml > summary");
      await page().focus("#trajectory-text");
      said(await stops(esc));
      await page().click("#trajectory-yaml > summary");
    },
    "paused arms": async (said) => {
      await me().press("#pause");
      await robot().states("PAUSED");
      said(await stops(esc));
    },
    "paused arms, and a fault in the pause": async (said) => {
      await me().press("#pause");
      await robot().states("PAUSED");
      robot().command("stop");
      await page().waitForSelector('[data-fault="arm_a"]:not([hidden])');
      said(await stops(esc));
    },
    "a page that has hung for 1 s": async (said) => {
      await page().evaluate(() => {
        const end = performance.now() + 1000;
        while (performance.now() < end);
      });
      said(await stops(esc));
    },
  };

  async function play(name, situation) {
    await me().page.bringToFront();
    await me().tab("operate");
    await run();
    let stop = "";
    stop = (await situation((text) => (stop = text))) ?? stop;
    const since = monotonic();
    await robot().until(`stand in FAULT after: ${name}`, (s) =>
      s.arms.every(
        (arm) => arm.operating_state === "FAULT" && /stop_requested|lease_lost|state|command/.test(arm.faults),
      ),
    );
    await robot().stands(name, since);
    const { faults } = robot().last.arms[0];
    if (!/NOT SENT/.test(stop)) assert.match(faults, /stop_requested/, `${name}: the stop did not arrive`);
    if (/control hangs|drives' process hangs/.test(name))
      assert.match(stop, /^NOT CONFIRMED/, `${name}: who did not answer cannot have confirmed`);
    await takeControl();
    await enable(); // and all can continue
    console.log(`    ${name}: ${faults}; ${stop}`);
    rows.push(`| ${name} | stands, FAULT ${faults} | ${stop} |`);
  }
  /** The system behind the address is another one: the page is empty, and the robot stops without its commander. */
  async function exchanged() {
    await run();
    await server.kill();
    const file = path.join(path.dirname(setting.deployment), "exchanged.yaml");
    const text = fs.readFileSync(setting.deployment, "utf8").replace(/^robot: .*$/m, `robot: ${setting.other}`);
    fs.writeFileSync(file, text.replace(/^prefix: .*$/m, "prefix: exchanged"));
    const other = new Server({ ...setting, deployment: file });
    await other.start();
    await me().text("#exchanged", /Another system answers here now/);
    await robot().until("stop without a commander", (s) => s.arms.every((arm) => /lease_lost/.test(arm.faults)));
    await other.kill("SIGTERM");
    await server.start();
    await page().click("#reload");
    await me().state("#link", "live");
    await enable();
    rows.push(
      "| another system answers at the address | stands, FAULT lease_lost | no stop: the page is emptied and says so |",
    );
  }

  return {
    async "situations: what the robot did, what the page said"() {
      for (const [name, situation] of Object.entries(situations)) await play(name, situation);
      await exchanged();
      const table = [
        "| situation, during a run | the robot, by `tandem status` | the page about its stop, and how long after the press |",
        "|---|---|---|",
        ...rows,
        "",
      ].join("\n");
      fs.writeFileSync(path.join(setting.artifacts, "situations.md"), table);
      if (process.env.TANDEM_WRITE_DOCS !== "1") return;
      const docs = path.join(__dirname, "../../docs/console.md");
      const [before, rest] = fs.readFileSync(docs, "utf8").split(kBegin);
      fs.writeFileSync(docs, `${before}${kBegin}${table}${kEnd}${rest.split(kEnd)[1]}`);
    },
  };
};
