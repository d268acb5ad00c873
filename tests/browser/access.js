// SPDX-License-Identifier: Apache-2.0
// Scenes of a console with tokens: what a viewer may do, where the token is kept, and what the page says without a valid one.
"use strict";
const assert = require("node:assert");
const fs = require("node:fs");
const path = require("node:path");
const { serve } = require("./harness.js");

module.exports = ({ robot, me, setting, enable, shot, open }) => {
  const browser = () => me().page.context().browser();
  /** A console at the same port, with a token for each role that ends with `letter`. @returns [server, operator's token, viewer's] */
  async function serveWithTokens(letter) {
    const folder = path.dirname(setting.deployment);
    const tokens = ["operator", "viewer"].map((role) => {
      const token = `${role}-`.padEnd(40, letter);
      fs.writeFileSync(path.join(folder, `${role}.token`), token, { mode: 0o600 });
      return token;
    });
    const server = await serve(setting, "viewed", (text) =>
      text
        .replace(/^console:.*$/m, "")
        .concat(`console: {port: ${setting.spare}, operator_token: operator.token, viewer_token: viewer.token}\n`),
    );
    return [server, ...tokens];
  }

  return {
    async "the page's files come compressed, and the browser keeps those that are named by their contents"() {
      const context = await browser().newContext();
      const page = await context.newPage();
      try {
        const responses = [];
        page.on("response", (response) => responses.push(response));
        await page.goto(me().url, { waitUntil: "load" });
        let bytes = 0;
        for (const response of responses.filter((r) => !r.url().includes("/api/"))) {
          const [address, headers] = [new URL(response.url()).pathname, response.headers()];
          bytes += Number(headers["content-length"]);
          const named = address.startsWith("/assets/");
          assert.strictEqual(
            headers["cache-control"],
            named ? "public, max-age=31536000, immutable" : "no-cache",
            address,
          );
          if (named || address === "/") assert.strictEqual(headers["content-encoding"], "gzip", address);
        }
        assert.ok(bytes > 100e3 && bytes < 300e3, `the page has ${bytes} bytes`);
        console.log(`    the page's files: ${(bytes / 1000).toFixed(0)} kB on the wire`);
      } finally {
        await context.close();
      }
    },

    async "a viewer sees why nothing can be commanded, and can stop"() {
      const [server, , token] = await serveWithTokens("x");
      try {
        const viewer = await open(`${server.url}/?token=${token}`);
        assert.strictEqual(viewer.page.url(), `${server.url}/`, "the token is in the address bar");
        const enabled = await viewer.page.$$eval(
          "button:not(#stop, [role=tab], [data-camera], .small, #sound, #acknowledge, #log-export)",
          (all) => all.filter((b) => b.getAttribute("aria-disabled") !== "true").map((b) => b.id || b.textContent),
        );
        assert.deepStrictEqual(enabled, [], "a viewer has buttons that do nothing");
        await viewer.text("#panel-0 .reasons", /Viewer: this page can read and stop, but not command/);
        await enable();
        await viewer.page.keyboard.press("Escape");
        await robot().until("stop for a viewer", (s) => s.arms.every((arm) => /stop_requested/.test(arm.faults)));
        await viewer.text("#stop-note", /confirmed after/);
        await viewer.page.reload(); // needs no token in the address
        await viewer.state("#link", "live");
        assert.ok(!/may not publish|not advertised/.test(await viewer.page.textContent(".messages")));
        assert.deepStrictEqual(viewer.complaints, [], "the browser complains of a viewer's page");
        await viewer.page.context().close();
      } finally {
        await server.kill("SIGTERM");
      }
      await enable();
    },

    async "without a valid token the page says what to do, and takes one"() {
      let [server, token] = await serveWithTokens("x");
      const context = await browser().newContext({ viewport: { width: 1280, height: 720 } });
      const page = await context.newPage();
      const asks = async (reason) => {
        await page.waitForFunction(
          (source) => new RegExp(source).test(document.querySelector("#token-required")?.textContent ?? ""),
          reason.source,
        );
        assert.ok(!page.url().includes("token"), page.url());
      };
      try {
        await page.goto(server.url);
        await asks(
          /This console requires a token, and the request has none\. Copy the token from the file that `operator_token`/,
        );
        await shot("console-token", { page });
        await page.goto(`${server.url}/?token=wrong-token-0123456789`);
        await asks(/The token of this request is not one of this console's tokens\. Copy the token/);
        await page.fill("#token", token);
        await page.click("#token-open");
        await page.waitForSelector('#link[data-state="live"]');
        assert.strictEqual(page.url(), `${server.url}/`);
        const read = await page.evaluate(
          (word) => document.cookie + JSON.stringify({ ...sessionStorage, ...localStorage }),
          token,
        );
        assert.ok(!read.includes(token), "scripts can read the token");
        const before = await page.evaluate(() => history.length);
        await page.goBack().catch(() => null);
        assert.ok(!page.url().includes(token), `one of ${before} pages of the history has the token`);
        await page.goto(server.url);
        await page.waitForSelector('#link[data-state="live"]');
        await server.kill("SIGTERM");
        [server] = await serveWithTokens("y"); // the tokens are replaced while the page is open
        await asks(/The token of this request is not one of this console's tokens/);
      } finally {
        await context.close();
        await server.kill("SIGTERM");
      }
    },
  };
};
