// SPDX-License-Identifier: Apache-2.0
/** Actuators with their moving limits (Fig. 2 of Alsaka et al. 2024, live), and jogging. */
import type { Joint } from "../state/robot";
import { isTranslation } from "../state/robot";
import type { Range } from "../state/track";
import { allowed, place, rotationRange, turns, wrap } from "../state/track";
import { shortName } from "../state/descriptions";
import { maxJointsPerArm } from "../wire/messages";
import type { Context, Panel } from "./context";
import { whyNot } from "./context";
import { h, setAttribute, setClass, setText, setUsable, action } from "./dom";
import { Hold } from "./hold";
import type { Span } from "./span";
import { degrees, millimetres } from "../state/numbers";

const kJogTranslation = 0.002; // m/s
const kJogRotation = (10 * Math.PI) / 180; // rad/s

interface Bar {
  arm: number;
  joint: number;
  translation: boolean;
  range: Range;
  /** It shows angles modulo a turn. */
  wraps: boolean;
  row: HTMLElement;
  free: readonly HTMLElement[];
  value: HTMLElement;
  setpoint: HTMLElement;
  text: HTMLElement;
  jogs: HTMLButtonElement[];
}

export class Bars implements Panel {
  readonly element: HTMLElement;
  private readonly bars: Bar[] = [];
  private readonly holds: { arm: number; hold: Hold }[] = [];

  constructor(
    private readonly c: Context,
    private readonly span: Span,
  ) {
    const arms = c.robot.arms.map((arm, k) => {
      const reach = Math.min(...arm.joints.map((joint, j) => (isTranslation(arm, j) ? (joint.lower ?? 0) : 0)));
      const rows = arm.joints.map((joint, j) => this.makeBar(k, j, joint, reach));
      return h(
        "div.actuators",
        { role: "group", "aria-label": `Actuators of arm ${shortName(arm.name)}` },
        h("h2", {}, `Arm ${shortName(arm.name)}`),
        ...rows,
      );
    });
    this.element = h("section.bars", { "aria-label": "Actuators and their moving limits" }, ...arms);
  }

  private makeBar(arm: number, joint: number, of: Joint, reach: number): HTMLElement {
    const { translation } = of;
    const tubes = this.c.robot.arms[arm]!.tubes.length;
    const travel = tubes > 1 ? { from: reach, to: 0 } : { from: of.lower ?? 0, to: of.upper ?? 0 };
    const range = translation ? travel : rotationRange(of.lower, of.upper);
    const free = [h("i.free"), h("i.free")];
    const value = h("i.value");
    value.style.background = this.c.robot.arms[arm]!.tubes[joint % tubes]!.color;
    const setpoint = h("i.setpoint");
    const text = h("output.number");
    const said = `${of.title} of arm ${shortName(this.c.robot.arms[arm]!.name)}`;
    const bar: Bar = {
      arm,
      joint,
      translation,
      range,
      wraps: !translation && (of.lower === null || of.upper === null),
      row: h(of.symbol.length > 2 ? "div.bar.named" : "div.bar"),
      free,
      value,
      setpoint,
      text,
      jogs: [],
    };
    bar.jogs = [-1, 1].map((sign) => this.jogButton(bar, sign, said));
    bar.row.title = said;
    bar.row.append(
      h("span.name", {}, of.symbol),
      bar.jogs[0]!,
      h("div.track", {}, ...free, setpoint, value),
      bar.jogs[1]!,
      text,
    );
    this.bars.push(bar);
    this.span.watch(bar.row, arm, joint);
    return bar.row;
  }

  private jogButton(bar: Bar, sign: number, said: string): HTMLButtonElement {
    const speed = bar.translation ? `${1000 * kJogTranslation} mm/s` : "10 °/s";
    const button = action(sign < 0 ? "−" : "+", `Hold to jog at ${speed}`, () => {}, "jog");
    button.setAttribute("aria-label", `Hold to jog ${said} ${sign < 0 ? "down" : "up"}`);
    const { robot, commander } = this.c;
    const joints = robot.arms[bar.arm]!.joints.map((_, j) =>
      j !== bar.joint ? 0 : sign * (bar.translation ? kJogTranslation : kJogRotation),
    );
    const ask = async (): Promise<void> => {
      if (whyNot(this.c, "jog", performance.now(), bar.arm) !== "") return hold.end();
      const answer = await commander.jog(bar.arm, joints);
      if (answer.accepted || !hold.active) return;
      this.c.messages.add("bad", `Jog refused: ${answer.reason}`);
      hold.end();
    };
    const hold = new Hold(button, {
      // Each request is valid for the larger of the teleoperation budget and two periods.
      period: 400 * Math.max(robot.budgets.teleoperation, 2 * robot.control.period),
      ask: () => void ask(),
      end: () => void commander.hold(),
      say: (text) => this.c.messages.add("bad", text),
    });
    this.holds.push({ arm: bar.arm, hold });
    return button;
  }

  update(now: number): void {
    const { world } = this.c;
    const limits = world.moving();
    const refused = this.c.robot.arms.map((_, k) => whyNot(this.c, "jog", now, k));
    for (const { arm, hold } of this.holds) if (refused[arm] !== "") hold.end();
    const old = world.stale(world.limits, now);
    for (const bar of this.bars) {
      for (const jog of bar.jogs) setUsable(jog, refused[bar.arm]!);
      const position = world.joints(bar.arm)?.position[bar.joint];
      const setpoint = world.setpoints(bar.arm)?.position[bar.joint];
      const turn = (x: number): number => (bar.wraps ? wrap(x) : x);
      setClass(bar.row, "stale", old || world.stale(world.arms[bar.arm]!.measuredJs, now));
      if (position === undefined) continue;
      const at = bar.arm * maxJointsPerArm + bar.joint;
      const lower = limits?.lower[at] ?? -Infinity;
      const upper = limits?.upper[at] ?? Infinity;
      allowed(lower, upper, bar.range, bar.wraps).forEach(({ left, right }, k) => {
        bar.free[k]!.hidden = right <= left;
        bar.free[k]!.style.left = `${(100 * left).toFixed(2)}%`;
        bar.free[k]!.style.width = `${(100 * (right - left)).toFixed(2)}%`;
      });
      bar.value.style.left = `${(100 * place(turn(position), bar.range)).toFixed(2)}%`;
      if (setpoint !== undefined) bar.setpoint.style.left = `${(100 * place(turn(setpoint), bar.range)).toFixed(2)}%`;
      const round = bar.wraps ? turns(position) : 0;
      const more = round === 0 ? "" : ` ${round < 0 ? "−" : "+"}${Math.abs(round)}×360°`;
      setText(bar.text, bar.translation ? `${millimetres(position)} mm` : `${degrees(turn(position))}°${more}`);
      setAttribute(bar.text, "data-long", more === "" ? "no" : "yes");
      const active = (limits?.active[at] ?? 0) !== 0;
      setClass(bar.row, "active", active);
      setAttribute(bar.row, "data-active", active ? "yes" : "no");
    }
  }
}
