// SPDX-License-Identifier: Apache-2.0
/** What the server knows of robot and deployment: GET /api/robot and /api/trajectories. */

import type { Words } from "./words";

export interface Pose {
  position: number[];
  /** x y z w */
  orientation: number[];
}

/** SI units; null: unlimited. */
export interface Joint {
  name: string;
  /** For narrow places: "β2", "roll". */
  symbol: string;
  /** "translation of tube 2" */
  title: string;
  /** What it moves, by which limits are named: "tube 2". */
  part: string;
  translation: boolean;
  lower: number | null;
  upper: number | null;
  velocity: number | null;
}

export interface Tube {
  name: string;
  length: number;
  outer_radius: number;
  inner_radius: number;
}

export interface Arm {
  name: string;
  base: Pose;
  /** Of a catheter one, as long as it gets. */
  tubes: Tube[];
  /** Translations of all tubes, then their rotations; insertion, roll and bend of a catheter. */
  joints: Joint[];
}

/** What catheters hold, touched by the arms in the order of the robot. */
export interface GraspedObject {
  size: number;
  contacts: { arm: string; type: string; frame: Pose; hand: Pose }[];
}

export interface Parameter {
  name: string;
  value: number;
}

/** What types of robots can and cannot do (robots/capability.h). */
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
  /** Of robot and deployment, 16 hexadecimal digits: goes out with every request. */
  fingerprint: string;
  role: string;
  arms: Arm[];
  object: GraspedObject | null;
  port: { frame: Pose; radius: number; depth: number } | null;
  hardware: boolean;
  lock_step: boolean;
  status_period: number;
  control: {
    /** File of the method `foreign`; empty: there is none. */
    method_library: string;
    parameters: (Parameter & { methods: string[] })[];
    period: number;
    relative_gain: number;
    tip_gain: number;
  };
  budgets: { lease: number; teleoperation: number };
  /** Names and meanings of numbers in messages, by enumeration. */
  words: Words;
}

export interface Trajectory {
  name: string;
  summary: string;
  yaml: string;
}

export const isTranslation = (arm: Arm, joint: number): boolean => arm.joints[joint]?.translation ?? false;
export const mayCommand = (robot: Robot): boolean => robot.role === "operator";

/** Gains, then what the method reads. */
export function parametersOf(robot: Robot, method: string): Parameter[] {
  const { relative_gain, tip_gain, parameters } = robot.control;
  return [
    { name: "relative_gain", value: relative_gain },
    { name: "tip_gain", value: tip_gain },
    ...parameters.filter(({ methods }) => methods.includes(method)),
  ];
}

/** @throw Error that names the address and what came. */
export async function fetchJson<T>(path: string): Promise<T> {
  const answer = await fetch(path + window.location.search, { cache: "no-store" });
  if (!answer.ok) throw new Error(`${path}: the server replied ${answer.status} ${answer.statusText}`);
  return (await answer.json()) as T;
}
