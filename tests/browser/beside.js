// SPDX-License-Identifier: Apache-2.0
// beside.js SETTING: the page remains open until standard input ends; then prints the resources used by it and its server, as one line of
// JSON.
"use strict";
const assert = require("node:assert");
const { Operator, Server } = require("./harness.js");

const setting = JSON.parse(process.argv[2]);
const server = new Server(setting);

async function main() {
  await server.start();
  const browser = await Operator.launch(setting);
  const me = await Operator.open(browser, server.url);
  const scene = await me.waitForScene("both arms drawn", (s) => s.blue > 150 && s.orange > 150);
  console.log("open");
  const frames = [];
  const stats = [];
  let ended = false;
  process.stdin.resume();
  process.stdin.once("end", () => (ended = true));
  while (!ended) {
    await me.page.waitForTimeout(1000);
    frames.push(Number(await me.page.$eval("#fps", (rate) => rate.dataset.frames)));
    stats.push(await (await fetch(`${server.url}/api/stats`)).json());
  }
  await me.state("#link", "live");
  assert.deepStrictEqual(me.complaints, []);
  const rank = (values, share) => values.sort((a, b) => a - b)[Math.floor(share * (values.length - 1))];
  console.log(
    JSON.stringify({
      frames: { least: rank(frames, 0), median: rank(frames, 0.5), most: rank(frames, 1) },
      server_cpu: rank(
        stats.map((s) => s.cpu),
        0.5,
      ),
      bytes_per_second: rank(
        stats.map((s) => s.bytes_per_second),
        0.5,
      ),
      dropped: Math.max(...stats.flatMap((s) => s.clients.map((client) => client.dropped))),
      bluish_at_start: scene.blue,
    }),
  );
  await browser.close();
  await server.kill("SIGINT");
}

main().catch((error) => {
  console.error(error);
  process.exit(1);
});
