// SPDX-License-Identifier: Apache-2.0
/** Names and colours of the lines in charts: an arm's colour means that arm; all else differs by dashes. */
import type { TaskReference } from "../wire/messages";
import { TaskKind } from "../wire/messages";
import { shortName } from "./descriptions";
import { type Followed, followedTasks, scaleOf } from "./taskerrors";

/** A line. Its colour is one of the style sheet, --trace-…; an empty name: there is none. */
export interface Trace {
  name: string;
  colour: string;
  dashed: boolean;
}

const kArmColours = 4;
const kOrdinals = ["1st", "2nd", "3rd", "4th"];
export const kNoTrace: Trace = { name: "", colour: "--trace-1", dashed: false };
/** Lines that belong to no arm. */
export const plain = (name: string, k: number): Trace => ({
  name,
  colour: k % 2 === 0 ? "--trace-1" : "--trace-2",
  dashed: k % 2 !== 0,
});

/** A line that belongs to an arm. */
export const armTrace = (name: string, arm: number): Trace => ({
  name,
  colour: `--trace-arm-${arm % kArmColours}`,
  dashed: false,
});

/** Names of tasks, before their arms. */
const kNames: Partial<Record<number, string>> = {
  [TaskKind.tipAxis]: "axis",
  [TaskKind.tipOrientation]: "orientation",
  [TaskKind.relativeOrientation]: "orientation",
  [TaskKind.lookAt]: "view",
  [TaskKind.remoteCentre]: "centre",
  [TaskKind.tipPose]: "pose",
  [TaskKind.relativePose]: "pose",
  [TaskKind.jointLimits]: "limits",
  [TaskKind.elasticStability]: "stability",
};
const kRelative: readonly number[] = [TaskKind.relativeOrientation, TaskKind.relativePose];

function traceOf({ kind, arm, other_arm }: TaskReference, arms: readonly string[], k: number): Trace {
  const name = (j: number): string => shortName(arms[j] ?? String(j));
  if (kind === TaskKind.tipPosition) return armTrace(`tip ${name(arm)}`, arm);
  if (kind === TaskKind.relativePosition) return plain(`${name(arm)} from ${name(other_arm)}`, k);
  if (kind === TaskKind.objectPose) return plain("object", k);
  const what = kNames[kind] ?? kOrdinals[k]!;
  return plain(`${what} ${name(arm)}${kRelative.includes(kind) ? ` from ${name(other_arm)}` : ""}`, k);
}

/** Lines of as many tasks as control follows: those of the trajectory under way, otherwise in their order. */
export function taskTraces(count: number, plan: Followed | null, arms: readonly string[]): Trace[] {
  const tasks = followedTasks(count, plan);
  return kOrdinals.map((ordinal, k) => {
    if (k >= count) return kNoTrace;
    return tasks[k] ? traceOf(tasks[k], arms, k) : plain(ordinal, k);
  });
}

/** The same of their errors: a unit other than mm is part of the name. */
export const errorTraces = (count: number, plan: Followed | null, arms: readonly string[]): Trace[] =>
  taskTraces(count, plan, arms).map((trace, k) => {
    const { unit } = scaleOf(followedTasks(count, plan)[k]);
    return unit === "mm" || unit === "" ? trace : { ...trace, name: `${trace.name}, ${unit}` };
  });
