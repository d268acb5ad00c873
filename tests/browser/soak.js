// SPDX-License-Identifier: Apache-2.0
// soak.js SETTING: the page stays open for a while; prints what the server and the page say of it, as JSON.
"use strict";
const { Operator } = require("./harness.js");

async function main() {
  const setting = JSON.parse(process.argv[2]);
  const browser = await Operator.launch(setting);
  try {
    const me = await Operator.open(browser, `${setting.url}/`);
    const frames = [];
    const bytes = [];
    const cpu = [];
    for (let second = 0; second < setting.seconds; ++second) {
      await me.page.waitForTimeout(1000);
      frames.push(await me.page.$eval("#fps", (rate) => Number(rate.dataset.frames)));
      const stats = await (await fetch(`${setting.url}/api/stats`)).json();
      bytes.push(stats.bytes_per_second);
      cpu.push(stats.cpu);
    }
    const median = (values) => values.sort((a, b) => a - b)[Math.floor(values.length / 2)];
    console.log(JSON.stringify({ frames: median(frames), bytes: median(bytes), cpu: median(cpu), complaints: me.complaints }));
  } finally {
    await browser.close();
  }
}
main().catch((error) => {
  console.error(error);
  process.exit(1);
});
