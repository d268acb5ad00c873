// SPDX-License-Identifier: Apache-2.0
/** The present range of the joint that is pointed at or has the focus: its numbers, and the line that the tip follows in it. */
import type { View } from "../scene/view";
import { shortName } from "../state/descriptions";
import { degrees, millimetres } from "../state/numbers";
import { fetchJson } from "../state/robot";
import { maxJointsPerArm } from "../wire/messages";
import type { Context } from "./context";
import { h, setShown, setText } from "./dom";

/** m or rad: other joints or limits are asked for again. */
const kOther = 5e-4;
/** ms between two questions, and after one that failed. */
const [kAgain, kFailed] = [300, 3000];

interface Range {
  lower: number;
  upper: number;
}

/** Range in which a joint can move now, with its neighbours where they are; a full turn if it has no limits. */
export const presentRange = (lower: number, upper: number, position: number): Range => ({
  lower: Math.max(lower, position - Math.PI),
  upper: Math.min(upper, position + Math.PI),
});

export class Span {
  /** Says the range while a joint is pointed at. */
  readonly element = h("output.figure", { id: "span", hidden: true });
  private chosen: { arm: number; joint: number } | null = null;
  private at: number[] = [];
  private asks = false;
  private next = 0;

  constructor(
    private readonly c: Context,
    private readonly view: View,
  ) {}

  /** A bar's row is pointed at, or one of its keys has the focus. */
  watch(row: HTMLElement, arm: number, joint: number): void {
    const choose = (): void => {
      this.clear();
      this.chosen = { arm, joint };
    };
    const leave = (): void => {
      if (this.chosen?.arm !== arm || this.chosen.joint !== joint || row.matches(":hover, :focus-within")) return;
      this.clear();
      this.chosen = null;
    };
    for (const name of ["pointerenter", "focusin"]) row.addEventListener(name, choose);
    for (const name of ["pointerleave", "focusout"]) row.addEventListener(name, () => setTimeout(leave));
  }

  update(now: number): void {
    const { chosen } = this;
    if (!chosen) return;
    const { robot, world } = this.c;
    const of = robot.arms[chosen.arm]!;
    const limits = world.moving();
    const index = chosen.arm * maxJointsPerArm + chosen.joint;
    const all = robot.arms.map(({ joints }, k) => world.joints(k)?.position.slice(0, joints.length));
    const position = all[chosen.arm]?.[chosen.joint];
    if (!limits || position === undefined || !world.live(now)) return this.clear();
    const { lower, upper } = presentRange(limits.lower[index]!, limits.upper[index]!, position);
    const { translation, title } = of.joints[chosen.joint]!;
    const text = (q: number): string => (translation ? millimetres(q) : degrees(q));
    const free = upper - lower > 2 * Math.PI - 1e-6;
    const range = free ? "turns freely" : `now ${text(lower)} to ${text(upper)} ${translation ? "mm" : "°"}`;
    const line = this.at.length > 0 ? "; green: where the tip gets" : "";
    setText(this.element, `${title} of arm ${shortName(of.name)}: ${range}${line}`);
    setShown(this.element, true);
    if (!robot.capabilities.tips || this.asks || now < this.next) return;
    const joints = all.flatMap((one) => [...(one ?? [])]);
    const wanted = [index, lower, upper, ...joints];
    if (this.at.length > 0 && this.at.every((value, k) => Math.abs(value - wanted[k]!) < kOther)) return;
    this.next = now + kAgain;
    const first = robot.arms.slice(0, chosen.arm).reduce((sum, arm) => sum + arm.joints.length, 0);
    void this.ask(wanted, `joints=${joints.join(",")}&joint=${first + chosen.joint}&lower=${lower}&upper=${upper}`);
  }

  private async ask(wanted: number[], query: string): Promise<void> {
    const of = this.chosen;
    this.asks = true;
    try {
      const { replayed } = this.c;
      const [path, file] =
        replayed === "" ? ["/api/span", ""] : ["/api/recordings/span", `file=${encodeURIComponent(replayed)}&`];
      const { tips } = await fetchJson<{ tips: (number[] | null)[] }>(path, file + query);
      if (this.chosen !== of || this.element.hidden) return;
      this.at = wanted;
      this.view.span.show(tips);
      this.view.touch();
    } catch {
      this.next = performance.now() + kFailed; // the link says what is wrong with the server
    } finally {
      this.asks = false;
    }
  }

  private clear(): void {
    if (this.element.hidden) return;
    this.at = [];
    setShown(this.element, false);
    this.view.span.show([]);
    this.view.touch();
  }
}
