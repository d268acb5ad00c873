// SPDX-License-Identifier: Apache-2.0
/** Arms with descriptions of their faults, power, homing, and positions to confirm. */
import { driveRecord, faultsOf, holdReason, idleText, shortName } from "../state/descriptions";
import type { StateCommand } from "../state/descriptions";
import type { Deed } from "../state/permission";
import { unconfirmedPositions } from "../state/positions";
import type { Unconfirmed } from "../state/positions";
import { EmergencyStop } from "../wire/messages";
import type { Context, Panel } from "./context";
import { Reasons } from "./choice";
import { reachesHome, reachesState, whyNot } from "./context";
import { action, card, h, setShown, setText, setUsable } from "./dom";
import { Hold, confirmed } from "./hold";

const kRepeat = 200; // ms: the drives home while the request is repeated
const kConfirm = 3000; // ms for each arm: hal::ArmHardware::kConfirmTime

export class Operate implements Panel {
  readonly element: HTMLElement;
  private readonly faults: HTMLElement[];
  private readonly emergency: HTMLElement;
  private readonly hold: HTMLElement;
  private readonly idle: HTMLElement;
  private readonly reasons = new Reasons();
  private readonly commands: [HTMLButtonElement, StateCommand][];
  private readonly home: HTMLButtonElement;
  private readonly reference: HTMLButtonElement;
  private readonly positions: HTMLElement;
  private readonly confirm: HTMLButtonElement;

  constructor(private readonly c: Context) {
    this.emergency = c.notices.line("fault", { id: "emergency-stop" });
    setText(
      this.emergency,
      "✕ EMERGENCY STOP pressed: all arms are stopped. When safe: release it, disable, then enable.",
    );
    this.faults = c.robot.arms.map((arm) => c.notices.line("fault", { "data-fault": arm.name }));
    this.hold = c.notices.line("hold", {});
    this.idle = c.notices.line("hold", { id: "idle" });
    this.positions = c.notices.line("fault", { id: "unconfirmed" });
    const button = (
      label: string,
      command: StateCommand,
      state: string,
      help: string,
    ): [HTMLButtonElement, StateCommand] => {
      const give = (): void => void c.orders.give(label, c.commander.state(command), reachesState(c, state));
      const made = command === "resume" ? confirmed(label, help, give, this.say) : action(label, help, give);
      made.id = command;
      return [made, command];
    };
    this.commands = [
      button("Enable", "enable", "ENABLED", "Power on: the arms may move. Nothing moves by itself."),
      button("Pause", "pause", "PAUSED", "Keep power on and hold position"),
      button("Hold to resume", "resume", "ENABLED", "From PAUSED back to ENABLED"),
      button("Disable", "disable", "DISABLED", "Power off; clears faults whose cause is gone"),
    ];
    this.home = action(
      "Move home",
      "Move all arms to the home of the robot file",
      () => void c.orders.give("Move home", c.commander.home(), reachesHome(c)),
    );
    this.home.id = "home";
    this.reference = this.holdButton();
    this.confirm = this.confirmButton();
    this.element = card(
      "Arms",
      h("div.row", {}, ...this.commands.map(([element]) => element)),
      h("div.row", {}, this.home, this.reference, this.confirm),
      this.reasons.element,
    );
  }

  /** Why a button that was held has ended. */
  private readonly say = (text: string): void => this.c.messages.add("bad", text);
  /** The drives home while this button is held. */
  private holdButton(): HTMLButtonElement {
    const element = action(
      "Hold to home drives",
      "Run the homing procedures of drives without absolute encoders while this is held",
      () => {},
    );
    const ask = async (): Promise<void> => {
      const answer = await this.c.commander.homeDrives();
      if (!hold.active || (answer.accepted && answer.value === 0)) return;
      if (!answer.accepted) this.c.messages.add("bad", `Homing refused: ${answer.reason}`);
      if (answer.value !== 0) this.c.messages.add("done", "All joints are homed");
      hold.end();
    };
    // Without further requests the HAL ends the homing run by itself.
    const hold = new Hold(element, { period: kRepeat, ask: () => void ask(), end: () => {}, say: this.say });
    return element;
  }

  private unconfirmed(): Unconfirmed[] {
    const { world, robot } = this.c;
    const hal = world.halStatus();
    return hal
      ? unconfirmedPositions(
          hal,
          robot.arms,
          robot.arms.map((_, k) => world.joints(k)),
        )
      : [];
  }

  /** Confirms positions while it is held, as `tandem home --confirm` does; the HAL takes a repeated request alone as a confirmation. */
  private confirmButton(): HTMLButtonElement {
    const element = action(
      "Hold to confirm positions",
      "Compare each joint with the positions in the notice. Hold this for 3 s per arm if they are right; if not, correct the offset in the hardware file.",
      () => {},
      "confirm",
    );
    element.id = "confirm-positions";
    let asked: Unconfirmed[] = [];
    const ask = async (): Promise<void> => {
      const positions = this.unconfirmed().filter(({ unmeasured }) => !unmeasured);
      if (hold.heldFor < kRepeat) asked = positions;
      // Who holds the button has not seen a position that joins later.
      if (positions.some(({ joint }) => asked.every((one) => one.joint !== joint))) return hold.end();
      const arms = new Set(asked.map(({ arm }) => arm)).size;
      element.style.setProperty("--held", `${Math.min(100, hold.heldFor / (0.01 * kConfirm * arms)).toFixed(0)}%`);
      const answer = await this.c.commander.homeDrives();
      if (!hold.active || (!answer.accepted && answer.reason.includes("--confirm"))) return;
      if (answer.accepted) this.c.messages.add("done", `Confirmed: ${asked.map(({ text }) => text).join("; ")}`);
      else this.c.messages.add("bad", `Positions are not confirmed: ${answer.reason}`);
      hold.end();
    };
    const end = (): void => element.style.setProperty("--held", "0%");
    const hold = new Hold(element, { period: kRepeat, ask: () => void ask(), end, say: this.say });
    return element;
  }

  update(now: number): void {
    const { world, robot } = this.c;
    const status = world.controlStatus();
    const hal = world.halStatus();
    const texts = robot.arms.map((arm, k) => {
      const faults = faultsOf((status?.faults[k] ?? 0) | (hal?.faults[k] ?? 0));
      const record = hal ? driveRecord(hal, k, arm.joints.length) : "";
      const more = record !== "" && record !== faults.map((f) => f.name).join(", ") ? `\nDrives: ${record}` : "";
      return faults.map((f) => `${f.name}: ${f.meaning}. ${f.remedy}`).join("\n") + more;
    });
    texts.forEach((text, k) => {
      // A text that applies to several arms is shown once, at the first of them.
      const shown = text !== "" && texts.indexOf(text) === k;
      setShown(this.faults[k]!, shown);
      const whose = robot.arms.filter((_, j) => texts[j] === text).map((arm) => shortName(arm.name));
      setText(this.faults[k]!, shown ? `✕ Arm ${whose.join(", ")}: ${text}` : "");
    });
    setShown(this.emergency, hal?.emergency_stop === EmergencyStop.pressed);
    const waits = (status?.hold ?? 0) !== 0;
    setShown(this.hold, waits);
    if (waits && status)
      setText(
        this.hold,
        `The trajectory is held: ${holdReason(status.hold)} (${(1000 * status.tip_age).toFixed(0)} ms)`,
      );
    const idle = robot.arms
      .map((arm, k) => ({ name: shortName(arm.name), text: status ? idleText(status, k) : "" }))
      .filter(({ text }) => text !== "");
    const idling = idle.map(({ name, text }) => `Arm ${name} ${text}`).join("; ");
    if (this.idle.hidden && idling !== "" && this.c.replayed === "") this.c.messages.add("bad", idling);
    setShown(this.idle, idling !== "");
    setText(this.idle, idling);
    const positions = this.unconfirmed();
    const textsOf = (unmeasured: boolean): string =>
      positions
        .filter((one) => one.unmeasured === unmeasured)
        .map(({ text }) => text)
        .join("; ");
    const [unmeasured, unconfirmed] = [textsOf(true), textsOf(false)];
    const notices = [
      unconfirmed && `✕ Position not confirmed: ${unconfirmed}. Compare it with the joint, then hold Confirm.`,
      unmeasured && `✕ Position not measured: ${unmeasured}.`,
    ].filter((notice) => notice !== "");
    setShown(this.positions, notices.length > 0);
    setText(this.positions, notices.join("\n"));
    setShown(this.confirm, unconfirmed !== "");
    this.updateButtons(now);
  }

  private updateButtons(now: number): void {
    const { world } = this.c;
    const refused: [string, string][] = [];
    const judge = (element: HTMLButtonElement, deed: Deed): void => {
      const why = whyNot(this.c, deed, now);
      setUsable(element, why);
      if (!element.hidden) refused.push([element.textContent ?? deed, why]);
    };
    for (const [element, command] of this.commands) {
      if (command === "resume") element.dataset["help"] = `From PAUSED back to ENABLED; ${world.continues()}`;
      judge(element, command);
    }
    judge(this.home, "home");
    setShown(this.reference, (world.halStatus()?.bus_count ?? 0) > 0);
    judge(this.reference, "homeDrives");
    judge(this.confirm, "homeDrives");
    this.reasons.show(refused);
  }
}
