// SPDX-License-Identifier: Apache-2.0
/** Header, always visible: link, arms, lease owner, stop. */
import { mayCommand } from "../state/robot";
import { shortName, stateGlyph, stateMeaning, stateName, valuesOf } from "../state/descriptions";
import type { Context, Panel } from "./context";
import { reportedByControl, whyNot } from "./context";
import { action, h, setAttribute, setClass, setText, setUsable } from "./dom";
import { onPhone } from "../state/screen";
import { Hidden } from "./hidden";

const kOnPhone = (): HTMLElement =>
  h("span.onphone", { id: "on-phone" }, "On a phone: watch and STOP only. Command from a larger screen.");
const kRelease = "Release control";
/** Of an arm, beside its state. */
const kConditions = ["homed", "recovery", "busy"] as const;
/** A state that nothing says to last has the sign of an unknown one. */
const kUnknown = -1;
const kCrtkClients = 2n ** 64n - 1n;

export class Header implements Panel {
  readonly element: HTMLElement;
  private readonly link = h("output.link", { id: "link" });
  private readonly arms: HTMLElement[];
  private readonly who = h("output.who", { id: "lease", "data-longest": "Control: another client" });
  private readonly take: HTMLButtonElement;

  constructor(private readonly c: Context) {
    const states = [...valuesOf("OperatingState").map(({ name }) => name), stateName(kUnknown)];
    const longest = states.reduce((one, other) => (other.length > one.length ? other : one), "");
    this.arms = c.robot.arms.map(({ name }) =>
      h("span.arm", {
        "data-arm": name,
        "data-longest": `${shortName(name)} ${stateGlyph(0)} ${[longest, ...kConditions].join(" · ")}`,
      }),
    );
    this.take = action(
      "Take control",
      "Acquire the control lease: only the client that has it may command",
      () => void this.toggle(),
      "take",
    );
    this.take.id = "take";
    this.take.dataset["longest"] = kRelease;
    this.element = h(
      "header.top",
      {},
      h("div.brand", {}, h("strong", {}, "Tandem"), h("span", {}, `${c.robot.robot} · ${c.robot.deployment}`)),
      this.link,
      h("div.arms", { role: "group", "aria-label": "State of the arms" }, ...this.arms),
      h(
        "div.lease",
        { role: "group", "aria-label": "Control lease" },
        this.who,
        this.take,
        onPhone() ? kOnPhone() : c.replayed === "" ? new Hidden(c).element : null,
      ),
    );
  }

  private async toggle(): Promise<void> {
    const { commander } = this.c;
    if (commander.holds) {
      this.c.pilot.arm(false);
      await this.c.orders.give("Releasing control", commander.release());
    } else {
      const mine = (): boolean => this.c.world.controlStatus()?.lease_owner === commander.client;
      await this.c.orders.give("Taking control", commander.acquire(), reportedByControl(this.c, mine));
    }
  }

  update(now: number): void {
    const { world, commander, current } = this.c;
    if (this.c.replayed !== "") return this.showReplay();
    const live = world.live(now);
    setText(this.link, current.text);
    setAttribute(this.link, "data-state", current.state);
    this.updateArms(live);
    this.updateLease(live);
    setUsable(this.take, whyNot(this.c, commander.holds ? "release" : "take", now));
    setText(this.take, commander.holds ? kRelease : "Take control");
  }

  /** Nothing here is said of the robot. */
  private showReplay(): void {
    setText(this.link, "⟲ REPLAY · not live");
    setAttribute(this.link, "data-state", "replay");
    this.updateArms(true);
    setText(this.who, "Control: not in a replay");
    setAttribute(this.who, "data-mine", "no");
    setUsable(this.take, whyNot(this.c, "take", 0));
  }

  private updateArms(live: boolean): void {
    const status = this.c.world.controlStatus();
    this.arms.forEach((element, k) => {
      const state = status?.operating_state[k] ?? kUnknown;
      const is = [status?.homed[k], status?.recovery[k], status?.busy[k]];
      const more = kConditions.filter((_, j) => is[j]);
      setText(
        element,
        `${shortName(this.c.robot.arms[k]!.name)} ${stateGlyph(live ? state : kUnknown)} ${[stateName(state), ...more].join(" · ")}`,
      );
      setAttribute(element, "data-state", stateName(state));
      setAttribute(element, "title", live ? stateMeaning(state) : `Not known now. Last: ${stateName(state)}`);
      setClass(element, "stale", !live);
    });
  }

  private updateLease(live: boolean): void {
    const { commander, world, robot } = this.c;
    const owner = world.controlStatus()?.lease_owner;
    let text = "Control: another client";
    if (!live || owner === undefined) text = "Control: unknown";
    else if (commander.holds) text = "Control: this page";
    else if (owner === 0n) text = "Control: free";
    else if (owner === kCrtkClients) text = "Control: CRTK clients";
    setText(this.who, !mayCommand(robot) ? `${text} · viewer` : text);
    setAttribute(this.who, "data-mine", commander.holds ? "yes" : "no");
  }
}
