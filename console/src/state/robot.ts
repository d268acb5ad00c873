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

/** How much of the orientation of tips operators command, and why the arms cannot follow the other kinds (empty: they can). */
export interface Teleoperation {
  orientation: "ignored" | "axis" | "full";
  refused: { axis: string; full: string };
}

/** Of control, in SI. */
export interface Parameter {
  name: string;
  value: number;
  /** "rad/s"; empty for a plain number. */
  unit: string;
  meaning: string;
  /** Names of the methods that use it. */
  methods: string[];
}

/** Capabilities of robot types (robots/capability.h). */
export interface Capabilities {
  tips: boolean;
  common_path: boolean;
  computation: boolean;
}

/** By the files of robot and deployment: the server's, or those in a recording. */
export interface RobotDescription {
  capabilities: Capabilities;
  deployment: string;
  prefix: string;
  robot: string;
  /** Of robot and deployment, 16 hexadecimal digits: part of every request. */
  fingerprint: string;
  arms: Arm[];
  object: GraspedObject | null;
  port: { frame: Pose; radius: number; depth: number } | null;
  regions: Regions;
  teleoperation: Teleoperation;
  hardware: boolean;
  lock_step: boolean;
  status_period: number;
  /** Overlaps of arms at home. */
  warnings: string[];
  control: {
    /** File of the method `foreign`; empty if there is none. */
    method_library: string;
    /** The gains, then those of the methods. */
    parameters: Parameter[];
    period: number;
  };
  budgets: { lease: number; teleoperation: number };
  /** Names and meanings of values in messages, by enumeration. */
  descriptions: Descriptions;
}

/** GET /api/robot */
export interface Robot extends RobotDescription {
  /** Of the server: new at every start. */
  session: string;
  role: string;
  /** From which the server has this page's requests. */
  client_address: string;
}

/** A trajectory as values in SI units. */
export interface TrajectorySpec {
  /** Index; -1 for the other one: no relative position. */
  arm: number;
  other_arm: number;
  timed: boolean;
  /** The relative position moves, too. */
  moving: boolean;
  /** Keys of its tasks beside the tip and the relative position. */
  further: string[];
  /** points, speed, acceleration, tolerance, max_iterations */
  values: Record<string, number | number[]>;
  /** One shape, with the values of its keys. */
  shape: Partial<Record<string, Record<string, number | number[]>>>;
}

export interface Trajectory {
  name: string;
  /** null: of a path of the common object */
  spec: TrajectorySpec | null;
  summary: string;
  yaml: string;
  refused: string; // why this robot cannot run it; empty: it can
}

export const isTranslation = (arm: Arm, joint: number): boolean => arm.joints[joint]?.translation ?? false;
export const mayCommand = (robot: Robot): boolean => robot.role === "operator";

/** The gains, and the parameters of the method. */
export const parametersOf = (robot: Robot, method: string): Parameter[] =>
  robot.control.parameters.filter(({ methods }) => methods.includes(method));

/** The server requires a token, and the browser has none, or another one. The message is the server's. */
export class TokenRequired extends Error {}

/** @param query  of the path @throw TokenRequired, or Error with the address, the reply, and the reason in it. */
export const fetchJson = async <T>(path: string, query = "", method: "GET" | "POST" = "GET"): Promise<T> =>
  (await (await fetchAnswer(path, query, method)).json()) as T;
/** As above. */
export const fetchBytes = async (path: string, query: string): Promise<ArrayBuffer> =>
  (await fetchAnswer(path, query, "GET")).arrayBuffer();

async function fetchAnswer(path: string, query: string, method: string): Promise<Response> {
  const answer = await fetch(query === "" ? path : `${path}?${query}`, { cache: "no-store", method });
  if (answer.ok) return answer;
  const why = (await answer.json().catch(() => ({}))) as { error?: string };
  if (answer.status === 401) throw new TokenRequired(why.error);
  throw new Error(
    `${path}: the server replied ${answer.status} ${answer.statusText}${why.error ? `: ${why.error}` : ""}`,
  );
}
