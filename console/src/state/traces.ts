// SPDX-License-Identifier: Apache-2.0
/** Names and colours of the lines in charts: an arm's colour means that arm; all else differs by dashes. */
import type { PlanningReference, TaskReference } from "../wire/messages";
import { Phase, TaskKind } from "../wire/messages";
import { shortName } from "./descriptions";

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

function traceOf({ kind, arm, other_arm }: TaskReference, arms: readonly string[], k: number): Trace {
  const name = (j: number): string => shortName(arms[j] ?? String(j));
  if (kind === TaskKind.tipPosition) return armTrace(`tip ${name(arm)}`, arm);
  if (kind === TaskKind.relativePosition) return plain(`${name(arm)} from ${name(other_arm)}`, k);
  return plain(kind === TaskKind.objectPose ? "object" : kOrdinals[k]!, k);
}

/** Lines of as many tasks as control follows: those of the trajectory under way, otherwise in their order. */
export function taskTraces(count: number, plan: PlanningReference | null, arms: readonly string[]): Trace[] {
  const followed =
    plan !== null && plan.task_count === count && (plan.phase === Phase.running || plan.phase === Phase.paused);
  return kOrdinals.map((ordinal, k) => {
    if (k >= count) return kNoTrace;
    return followed ? traceOf(plan.tasks[k]!, arms, k) : plain(ordinal, k);
  });
}
