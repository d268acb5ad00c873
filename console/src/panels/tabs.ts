// SPDX-License-Identifier: Apache-2.0
/** Tabs with the WAI-ARIA pattern: arrow keys move between them, Tab moves into the active one. */
import { h } from "./dom";

export function tabs(entries: readonly [string, HTMLElement][]): HTMLElement {
  const buttons = entries.map(([title], k) =>
    h(
      "button",
      { type: "button", role: "tab", id: `tab-${title.toLowerCase()}`, "aria-controls": `panel-${k}` },
      title,
    ),
  );
  const panels = entries.map(([title, content], k) =>
    h("div.panel", { role: "tabpanel", id: `panel-${k}`, "aria-labelledby": `tab-${title.toLowerCase()}` }, content),
  );
  const show = (index: number, focus: boolean): void => {
    buttons.forEach((button, k) => {
      button.setAttribute("aria-selected", k === index ? "true" : "false");
      button.tabIndex = k === index ? 0 : -1;
      panels[k]!.hidden = k !== index;
    });
    if (focus) buttons[index]!.focus();
  };
  buttons.forEach((button, k) => {
    button.addEventListener("click", () => show(k, false));
    button.addEventListener("keydown", (event) => {
      const step = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
      if (step !== 0) show((k + step + buttons.length) % buttons.length, true);
    });
  });
  show(0, false);
  return h("div.tabs", {}, h("div.tablist", { role: "tablist", "aria-label": "Panels" }, ...buttons), ...panels);
}
