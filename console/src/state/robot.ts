// SPDX-License-Identifier: Apache-2.0
/** Description of robot and deployment from the server: GET /api/robot and /api/trajectories. */

import type { Descriptions } from "./descriptions";

export interface Pose {
  position: number[];
  /** x y z w */
  orientation: number[];
}

/** SI units; null: unlimited. */
export interface Joint {
  name: string;
  /** Short name: "β2", "roll". */
  symbol: string;
  /** "translation of tube 2" */
  title: string;
  /** Body that it moves, as in names of limits: "tube 2". */
  part: string;
  translation: boolean;
  lower: number | null;
  upper: number | null;
  velocity: number | null;
}

export interface Tube {
  name: string;
  /** "#rrggbb" */
  color: string;
  length: number;
  outer_radius: number;
  inner_radius: number;
}

export interface Arm {
  name: string;
  /** "#rrggbb" */
  color: string;
  base: Pose;
  /** A catheter has one, at its greatest length. */
  tubes: Tube[];
  /** Translations of all tubes, then their rotations; insertion, roll and bend of a catheter. */
  joints: Joint[];
  /** Their values at home. */
  home: number[];
}

/** Object that catheters grasp, with contacts in the order of the robot's arms. */
export interface GraspedObject {
  size: number;
  /** "#rrggbb" */
  color: string;
  contacts: { arm: string; type: string; frame: Pose; hand: Pose }[];
}

/** m, along the axes of the robot's base frame. */
export interface Box {
  min: number[];
  max: number[];
}
/** One of a sphere, everything behind a plane, and a box; m, robot base frame. */
export interface Region {
  name: string;
  sphere?: { center: number[]; radius: number };
  /** The normal points out of the forbidden side. */
  half_space?: { point: number[]; normal: number[] };
  box?: Box;
}
/** What targets of tips keep out of, and what they stay in. */
export interface Regions {
  forbidden: Region[];
  margin: number;
  workspace: Box | null;
}

export interface Parameter {
  name: string;
  value: number;
}

/** Capabilities of robot types (robots/capability.h). */
export interface Capabilities {
  tips: boolean;
  common_path: boolean;
  computation: boolean;
}

export interface Robot {
  capabilities: Capabilities;
  deployment: string;
  prefix: string;
  robot: string;
  /** Of robot and deployment, 16 hexadecimal digits: part of every request. */
  fingerprint: string;
  /** Of the server: new at every start. */
  session: string;
  role: string;
  /** From which the server has this page's requests. */
  client_address: string;
  arms: Arm[];
  object: GraspedObject | null;
  port: { frame: Pose; radius: number; depth: number } | null;
  regions: Regions;
  hardware: boolean;
  lock_step: boolean;
  status_period: number;
  /** Overlaps of arms at home. */
  warnings: string[];
  control: {
    /** File of the method `foreign`; empty if there is none. */
    method_library: string;
    parameters: (Parameter & { methods: string[] })[];
    period: number;
    relative_gain: number;
    tip_gain: number;
  };
  budgets: { lease: number; teleoperation: number };
  /** Names and meanings of values in messages, by enumeration. */
  descriptions: Descriptions;
}

export interface Trajectory {
  name: string;
  summary: string;
  yaml: string;
  refused: string; // why this robot cannot run it; empty: it can
}

export const isTranslation = (arm: Arm, joint: number): boolean => arm.joints[joint]?.translation ?? false;
export const mayCommand = (robot: Robot): boolean => robot.role === "operator";

/** Gains, then the parameters of the method. */
export function parametersOf(robot: Robot, method: string): Parameter[] {
  const { relative_gain, tip_gain, parameters } = robot.control;
  return [
    { name: "relative_gain", value: relative_gain },
    { name: "tip_gain", value: tip_gain },
    ...parameters.filter(({ methods }) => methods.includes(method)),
  ];
}

/** The server requires a token, and the browser has none, or another one. The message is the server's. */
export class TokenRequired extends Error {}

/** @throw TokenRequired, or Error with the address and the reply. */
export async function fetchJson<T>(path: string): Promise<T> {
  const answer = await fetch(path, { cache: "no-store" });
  if (answer.status === 401) throw new TokenRequired(((await answer.json()) as { error: string }).error);
  if (!answer.ok) throw new Error(`${path}: the server replied ${answer.status} ${answer.statusText}`);
  return (await answer.json()) as T;
}
