// SPDX-License-Identifier: Apache-2.0
/** Orientations of tips in teleoperation: what operators can turn, how far a tip is from its commanded orientation, and whether it follows. */
import type { TeleopStatus } from "../wire/messages";
import { TeleopState } from "../wire/messages";
import { degrees } from "./numbers";
import type { Teleoperation } from "./robot";

/** Why operators cannot turn tips, whatever the state of the robot; empty if they can. */
export function whyNoOrientation({ orientation, refused }: Teleoperation): string {
  if (orientation !== "ignored") return "";
  const ignored = "The deployment ignores orientations (teleoperation.orientation: ignored)";
  if (refused.axis !== "") return `${ignored}, and its arms cannot follow them: ${refused.axis}.`;
  return `${ignored}; its arms could follow ${refused.full === "" ? "full" : `axis, but not full: ${refused.full}`}.`;
}

/** What turns, and what the arms cannot turn; empty where orientations are ignored. */
export function describeOrientation({ orientation, refused }: Teleoperation): string {
  if (orientation === "ignored") return "";
  if (orientation === "full") return "Turns the whole tip, behind all positions.";
  const more = refused.full === "" ? "" : ` The arms cannot turn more: ${refused.full}.`;
  return `Turns the tip axis (blue), behind all positions; about it the tip is free.${more}`;
}

/** Rotation vectors in the robot's base frame from the tip's present orientation, rad. */
export interface Turn {
  arm: number;
  /** To the orientation that control commands. */
  commanded: Float64Array;
  /** To the one that the operator asks for, without limits. */
  asked: Float64Array;
  /** The commanded orientation is as far ahead of the tip as it may be. */
  leashed: boolean;
}

/** Of the driven tip; null while nobody drives, and where control ignores orientations. */
export function turnOf(teleop: TeleopStatus | null): Turn | null {
  if (teleop?.state !== TeleopState.following && teleop?.state !== TeleopState.clutched) return null;
  const stage = (name: string): TeleopStatus["stages"][number] | undefined =>
    teleop.stages.find((one) => one.name === `rotation_${name}`);
  const [filter, reach] = [stage("filter"), stage("reach")];
  if (!filter || !reach) return null;
  return { arm: teleop.arm, commanded: reach.output, asked: filter.output, leashed: reach.limited_by !== "" };
}

/** Angle of a rotation vector, rad. */
export const angleOf = (rotation: ArrayLike<number>): number =>
  Math.hypot(rotation[0] ?? 0, rotation[1] ?? 0, rotation[2] ?? 0);

/** x y z w of a rotation vector. */
export function quaternionOf(rotation: ArrayLike<number>): [number, number, number, number] {
  const angle = angleOf(rotation);
  const factor = angle < 1e-9 ? 0.5 : Math.sin(0.5 * angle) / angle;
  return [factor * rotation[0]!, factor * rotation[1]!, factor * rotation[2]!, Math.cos(0.5 * angle)];
}

const kShown = 0.1 / 57.3; // rad: smaller differences are not mentioned

/** "tip A 1.2° from its commanded orientation, 8.4° from the one asked for" @param name  of the arm */
export function describeTurn({ commanded, asked }: Turn, name: string | undefined): string {
  const [error, whole] = [angleOf(commanded), angleOf(asked)];
  const more = whole - error > kShown ? `, ${degrees(whole)}° from the one asked for` : "";
  return `tip ${name ?? "?"} ${degrees(error)}° from its commanded orientation${more}`;
}

/** Time in which a tip that lags on its leash has to turn towards its target, ms, and the angle that it has to, rad. */
const kStill = 1000;
const kTurns = 0.2 / 57.3;

interface Orientation {
  x: number;
  y: number;
  z: number;
  w: number;
}
/** Angle by which a rotation from one orientation to another, of less than a quarter turn, is about an axis, rad. */
function angleAbout(axis: ArrayLike<number>, from: Orientation, to: Orientation): number {
  const vector = [
    to.x * from.w - to.w * from.x - to.y * from.z + to.z * from.y,
    to.y * from.w - to.w * from.y - to.z * from.x + to.x * from.z,
    to.z * from.w - to.w * from.z - to.x * from.y + to.y * from.x,
  ];
  const real = to.x * from.x + to.y * from.y + to.z * from.z + to.w * from.w;
  const along = vector.reduce((sum, part, k) => sum + part * axis[k]!, 0) / angleOf(axis);
  return 2 * Math.asin(Math.max(-1, Math.min(1, Math.sign(real) * along)));
}

/** Whether a tip that is behind its commanded orientation still turns towards it: at home the arms have the rank that the deployment asks
 * for, elsewhere they may lack it, and a tip may then turn about another axis without end. */
export class TurnWatch {
  private from: { at: number; tip: Orientation } | null = null;
  private stuck = false;

  /** @param tip  present orientation of the driven tip; null: not known @returns why it does not turn; empty if it does, or need not */
  see(now: number, turn: Turn | null, tip: Orientation | null): string {
    if (!turn?.leashed || !tip) {
      this.from = null;
      this.stuck = false;
      return "";
    }
    this.from ??= { at: now, tip };
    const turns = angleAbout(turn.commanded, this.from.tip, tip) > kTurns;
    if (turns || now - this.from.at > kStill) {
      this.stuck = !turns;
      this.from = { at: now, tip };
    }
    return this.stuck
      ? `The arm cannot turn further in this direction: ${degrees(angleOf(turn.commanded))}° are left.`
      : "";
  }
}
