// SPDX-License-Identifier: Apache-2.0
// Scenes of what cannot be done, with the reason, and of what is said to be done.
"use strict";
const assert = require("node:assert");
const { monotonic, serve } = require("./harness.js");

module.exports = ({ robot, me, setting, takeControl, enable, run, shot, open }) => {
  const page = () => me().page;
  /** Waits until a control is disabled, and its reason can be read on the page, not only in a tooltip. */
  async function refused(selector, reason, where) {
    await page().waitForFunction(
      ([of, why]) => {
        const control = document.querySelector(of);
        return control.getAttribute("aria-disabled") === "true" && new RegExp(why).test(control.title);
      },
      [selector, reason.source],
    );
    if (where) await me().text(where, reason);
  }

  return {
    async "what paused arms or a paused trajectory do not allow is shown with the reason"() {
      await run();
      await me().press("#run-pause");
      await me().text("#progress", /paused/);
      await me().tab("method");
      const followed = /a trajectory is being followed; stop it first/;
      await refused('[data-method="snsqp"]', followed, "#panel-1 .reasons");
      await refused('[data-parameter="tip_gain"]', followed);
      assert.ok(await page().$eval('[data-parameter="tip_gain"]', (input) => input.readOnly), "it can be typed into");
      assert.ok(await page().$eval('#bounds input[value="frozen"]', (input) => input.disabled), "bounds can be chosen");
      await shot("console-refused");
      await me().tab("operate");
      await refused("#home", followed, "#panel-0 .reasons");
      await refused("#run-start", followed);
      await refused("#resume", /^Arm A is ENABLED: only a PAUSED arm can be resumed\.$/);
      await me().press("#pause");
      await robot().states("PAUSED");
      await me().press("#run-end");
      await me().text("#progress", /idle/);
      await refused("#home", /the arm is not ENABLED/, "#panel-0 .reasons");
      await refused(".jog", /the arm is not ENABLED/);
      await refused("#run-pause", /^No trajectory runs\.$/);
      await refused("#enable", /^Arm A is PAUSED: it is resumed, not enabled\.$/);
      await me().press("#disable");
      await robot().states("DISABLED");
    },

    async "trajectories and modes that need two arms cannot be chosen where there is one"() {
      const server = await serve(setting, "one-arm", (text) =>
        text.replace(/^robot: .*$/m, `robot: ${setting.one_arm}`).replace(/^prefix: .*$/m, "prefix: alone"),
      );
      const context = await me()
        .page.context()
        .browser()
        .newContext({ viewport: { width: 1280, height: 720 } });
      try {
        const other = await context.newPage();
        await other.goto(server.url);
        await other.waitForSelector("#trajectory input:disabled");
        const shown = await other.$$eval("#trajectory label", (all) =>
          all.map((label) => [label.querySelector("input").disabled, label.querySelector("small")?.textContent ?? ""]),
        );
        assert.ok(shown.some(([disabled]) => !disabled) && shown.some(([disabled]) => disabled));
        for (const [disabled, why] of shown)
          assert.strictEqual(disabled, why !== "", "disabled, and the reason is shown");
        await other.click("#tab-teleoperate");
        for (const mode of ["2", "3"]) {
          await other.waitForSelector(`#teleop-mode input[value="${mode}"]:disabled`);
          const label = await other.textContent(`#teleop-mode label:has(input[value="${mode}"])`);
          assert.match(label, /needs two arms/);
        }
      } finally {
        await context.close();
        await server.kill("SIGTERM");
      }
    },

    async "a value that is set is shown after a reload, and on other pages"() {
      await enable();
      await me().tab("method");
      const value = (0.01 + 0.05 * Math.random()).toFixed(4);
      await me().press('[data-method="snsqp"]');
      await me().said(/Method snsqp: done after/);
      await page().fill('[data-parameter="snsqp_zeta"]', value);
      await me().press("#apply");
      await me().said(new RegExp(`snsqp_zeta = ${value}: done after`));
      const other = await open();
      await me().load();
      for (const one of [me(), other]) {
        await one.tab("method");
        await one.page.waitForFunction(
          (wanted) => Number(document.querySelector('[data-parameter="snsqp_zeta"]')?.value) === Number(wanted),
          value,
        );
        await one.page.waitForSelector('[data-method="snsqp"][aria-checked="true"]');
        await one.page.waitForSelector('[data-parameter="snsqp_zeta"].ours');
      }
      await other.page.context().close();
      await takeControl();
      await me().tab("method");
      await me().press('[data-method="nspqp"]');
      await robot().until("use nspqp", (s) => s.method === "nspqp");
      await me().tab("operate");
    },

    async "home is done when the arms are there, and not done when they are not"() {
      const { arms } = await (await fetch(`${me().url}/api/robot`)).json();
      const away = (s) =>
        Math.max(...arms.flatMap((arm, k) => arm.home.map((q, j) => Math.abs(q - s.arms[k].joints[j]))));
      await run();
      await robot().until("leave home", (s) => away(s) > 3e-3);
      await me().press("#run-end");
      await me().said(/Ending the trajectory: done after/);
      const said = () => page().textContent(".messages");
      await me().press("#home");
      await robot().moves("home");
      assert.ok(!/Move home: done/.test(await said()), "it is said to be done while the arms move");
      await me().said(/Move home: done after/);
      assert.ok(away(robot().last) < 1e-3, `away from home: ${away(robot().last)}`);
      await run();
      await robot().until("leave home", (s) => away(s) > 3e-3);
      await me().press("#run-end");
      await me().said(/Ending the trajectory: done after/);
      await me().press("#home");
      await robot().moves("home");
      await me().press("#pause");
      await me().said(/Move home: NOT done: an arm is PAUSED/);
      await robot().stands("a pause on the way home", monotonic());
      await me().hold("#resume", robot().states("ENABLED"));
    },
  };
};
