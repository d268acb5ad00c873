// SPDX-License-Identifier: Apache-2.0
/** What the page shows instead of the robot while the server does not accept its token. */
import { h } from "./dom";

/** @param why  of the server, with the next step */
export function askForToken(why: string): HTMLElement {
  const input = h("input", { id: "token", type: "password", required: true, autocomplete: "off" });
  const open = (event: Event): void => {
    event.preventDefault();
    // The server answers with a redirection to the address without the token, and keeps the token as a cookie.
    window.location.assign(`/?token=${encodeURIComponent(input.value.trim())}`);
  };
  return h(
    "div.boot",
    { id: "token-required" },
    h("p", {}, why),
    h("p", {}, "Or enter it here. The browser keeps it as a cookie of this address, so it must accept cookies:"),
    h("form", { onsubmit: open }, h("label", {}, "Token ", input), " ", h("button", { id: "token-open" }, "Open")),
  );
}
