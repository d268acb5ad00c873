// SPDX-License-Identifier: Apache-2.0
/** What the operator has to know now, over the scene: it comes and goes without moving anything else. */
import { h } from "./dom";

export class Notices {
  readonly element = h("div.notices", { role: "group", "aria-label": "Notices" });

  /** A line that is shown while it is not hidden. */
  line(kind: "fault" | "hold" | "limits", attributes: Record<string, string>): HTMLElement {
    const line = h("div", { class: kind, hidden: true, ...attributes });
    this.element.append(line);
    return line;
  }
}
