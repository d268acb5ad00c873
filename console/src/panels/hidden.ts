// SPDX-License-Identifier: Apache-2.0
/** What becomes of the control lease while nobody sees the page: said before it is taken, and in the tab's title while the page is hidden. */
import type { Context } from "./context";
import { h } from "./dom";

const kPeriod = 250; // ms

export class Hidden {
  readonly element: HTMLElement;
  private readonly title = document.title;
  private since = 0;
  private timer: ReturnType<typeof setInterval> | undefined;

  constructor(private readonly c: Context) {
    const lease = c.robot.budgets.lease;
    this.element = h("span.unseen", { id: "unseen" }, `hidden, this page loses control after ${lease} s`);
    this.element.title = `While its tab is in the background or its window minimized, the page does not renew the control lease: after ${lease} s it is lost, and arms that move stop with FAULT lease_lost.`;
    document.addEventListener("visibilitychange", () => this.change());
  }

  private change(): void {
    clearInterval(this.timer);
    const { messages, commander, robot } = this.c;
    if (document.visibilityState === "visible") {
      document.title = this.title;
      if (this.since > 0)
        messages.add("info", `The page is visible again, after ${((Date.now() - this.since) / 1000).toFixed(1)} s`);
      this.since = 0;
      return;
    }
    this.since = Date.now();
    const had = commander.holds;
    messages.add(
      "info",
      had ? `The page is hidden: control is lost in ${robot.budgets.lease} s` : "The page is hidden",
    );
    if (!had) return;
    this.timer = setInterval(() => this.count(), kPeriod);
    this.count();
  }
  private count(): void {
    const left = this.c.robot.budgets.lease - (Date.now() - this.since) / 1000;
    document.title = this.c.commander.holds
      ? `⚠ hidden: control is lost in ${Math.max(0, left).toFixed(0)} s`
      : "⚠ CONTROL LOST while hidden";
  }
}
