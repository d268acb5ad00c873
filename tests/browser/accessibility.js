// SPDX-License-Identifier: Apache-2.0
// Scenes of accessibility: WCAG 2.2 AA by axe, and what screen readers are told. Run by page_test.py Access.
"use strict";
const assert = require("node:assert");
const axe = require("axe-core");

const kRules = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"];
const kTabs = ["operate", "method", "teleoperate", "health", "log"];

/** Records what is written into live regions: by their roles and attributes as browsers read them. Runs in the page. */
function listen() {
  const role = { alert: "assertive", status: "polite", log: "polite" };
  const kind = (e) =>
    e.getAttribute("aria-live") ?? role[e.getAttribute("role")] ?? (e.tagName === "OUTPUT" ? "polite" : "off");
  const regions = [...document.querySelectorAll("*")].filter((e) => kind(e) !== "off");
  const said = [];
  const look = (records) => {
    for (const { target } of records) {
      const element = target.nodeType === Node.ELEMENT_NODE ? target : target.parentElement;
      const region = regions.find((one) => one.contains(element));
      if (region) said.push({ kind: kind(region), text: region.textContent });
    }
  };
  new MutationObserver(look).observe(document, { childList: true, characterData: true, subtree: true });
  window.heard = said;
  return regions.map(kind);
}

/** Violations of the page as it is shown, each with its elements. */
async function violations(page) {
  await page.evaluate(axe.source);
  const found = await page.evaluate(
    async (rules) => (await window.axe.run(document, { runOnly: rules, resultTypes: ["violations"] })).violations,
    kRules,
  );
  return found.flatMap(({ id, nodes }) =>
    nodes.map((node) => `${id}: ${node.html.slice(0, 120)}: ${node.failureSummary.replaceAll(/\s+/g, " ")}`),
  );
}

module.exports = ({ robot, me, enable, run, shot }) => {
  const page = () => me().page;
  const heard = (pattern) =>
    page().waitForFunction((source) => window.heard.some(({ text }) => new RegExp(source).test(text)), pattern.source);

  return {
    async "access: screen readers are told events and alarms, each once, and no values"() {
      await enable();
      const regions = await page().evaluate(listen);
      assert.deepStrictEqual(regions.sort(), ["assertive", "polite"], "live regions");
      await me().press("#disable");
      await robot().states("DISABLED");
      await heard(/Arm B: ENABLED to DISABLED/);
      await me().press("#enable");
      await heard(/Arm B: DISABLED to ENABLED/);
      await run();
      // A reader that is told something more often than once a second does not end a sentence.
      const from = await page().evaluate(() => [window.heard.length, performance.now()]);
      await page().waitForFunction((since) => performance.now() - since > 5000, from[1]);
      const changes = (await page().evaluate(() => window.heard.length)) - from[0];
      console.log(`    ${changes} changes of live regions in 5 s of a run`);
      assert.ok(changes <= 7, `${changes} changes of live regions in 5 s of a run`);
      await page().keyboard.press("Escape");
      await heard(/Arm A: stop_requested: a client requested a stop/);
      await heard(/stopped: confirmed after \d+ ms/);
      await enable();
      await heard(/Arm A: FAULT to DISABLED/);
      const all = await page().evaluate(() => window.heard);
      const times = (pattern, kind) =>
        all.filter((one) => one.kind === kind).reduce((n, { text }) => n + [...text.matchAll(pattern)].length, 0);
      assert.strictEqual(times(/Arm A: ENABLED to DISABLED/g, "polite"), 1, "a state is announced once");
      assert.strictEqual(times(/Arm A: ENABLED to FAULT/g, "polite"), 1, "a state is announced once");
      assert.strictEqual(times(/Arm A: stop_requested/g, "assertive"), 1, "a fault is announced once");
      assert.strictEqual(times(/stop_requested/g, "polite"), 0, "a fault is no event");
    },

    async "access: axe finds nothing against WCAG 2.2 AA in any tab"() {
      await enable();
      robot().command("stop"); // a fault, its alarms and its notice are looked at, too
      await page().waitForSelector('[data-fault="arm_a"]:not([hidden])');
      for (const theme of ["dark", "light"]) {
        await page().emulateMedia({ colorScheme: theme });
        for (const tab of kTabs) {
          await me().tab(tab);
          await page().click("#view", { button: "middle" }); // nothing is under the pointer
          assert.deepStrictEqual(await violations(page()), [], `${tab}, ${theme}`);
          await shot(`console-${theme}-${tab}`);
        }
      }
      await page().emulateMedia({ colorScheme: "dark" });
      await me().tab("operate");
    },
  };
};
