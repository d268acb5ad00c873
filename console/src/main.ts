// SPDX-License-Identifier: Apache-2.0
import { App } from "./app";
import { Announcer } from "./panels/announcer";
import { h } from "./panels/dom";
import { askForToken } from "./panels/token";
import type { Robot } from "./state/robot";
import { fetchJson, TokenRequired } from "./state/robot";
import { useDescriptions } from "./state/descriptions";

const kRetry = 1000; // ms

async function start(): Promise<void> {
  const root = document.getElementById("app")!;
  // The server removes a valid token from the address; one that is still there is refused, and not kept in sight either.
  const { search } = window.location;
  window.history.replaceState(null, "", "/");
  const announcer = new Announcer();
  let said = "";
  for (;;) {
    try {
      const robot = await fetchJson<Robot>(`/api/robot${search}`);
      useDescriptions(robot.descriptions);
      document.title = `${robot.robot} – Tandem`;
      const { protocol, host } = window.location;
      const path = import.meta.env.DEV ? "/ws" : "/";
      new App(root, robot, announcer, `${protocol === "https:" ? "wss" : "ws"}://${host}${path}`);
      return;
    } catch (error) {
      const text = error instanceof TokenRequired ? error.message : `No reply yet. ${String(error)}`;
      if (text !== said) announcer.alarm(text);
      said = text;
      if (error instanceof TokenRequired) return root.replaceChildren(askForToken(text));
      root.replaceChildren(h("p.boot", {}, text));
      await new Promise((again) => setTimeout(again, kRetry));
    }
  }
}

void start();
