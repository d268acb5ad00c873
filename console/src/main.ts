// SPDX-License-Identifier: Apache-2.0
import { App } from "./app";
import { h } from "./panels/dom";
import type { Robot } from "./state/robot";
import { fetchJson } from "./state/robot";
import { useDescriptions } from "./state/descriptions";

const kRetry = 1000; // ms

async function start(): Promise<void> {
  const root = document.getElementById("app")!;
  for (;;) {
    try {
      const robot = await fetchJson<Robot>("/api/robot");
      useDescriptions(robot.descriptions);
      document.title = `${robot.robot} – Tandem`;
      const { protocol, host, search } = window.location;
      const path = import.meta.env.DEV ? "/ws" : "/";
      new App(root, robot, `${protocol === "https:" ? "wss" : "ws"}://${host}${path}${search}`);
      return;
    } catch (error) {
      root.replaceChildren(h("p.boot", { role: "alert" }, `No reply yet. ${String(error)}`));
      await new Promise((again) => setTimeout(again, kRetry));
    }
  }
}

void start();
