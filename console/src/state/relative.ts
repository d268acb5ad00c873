// SPDX-License-Identifier: Apache-2.0
/** The relative position of two tips as text: of the arms whose relative position is a task, otherwise of the first two. */
import type { PlanningReference } from "../wire/messages";
import { TaskKind } from "../wire/messages";
import { shortName } from "./descriptions";
import { millimetres } from "./numbers";

/** @param tips  of the arms in order, m; null: not known @returns empty while one of the two tips is not known */
export function describeRelative(
  plan: Pick<PlanningReference, "tasks" | "task_count"> | null,
  tips: readonly (readonly number[] | null)[],
  arms: readonly string[],
): string {
  const task = plan?.tasks.slice(0, plan.task_count).find(({ kind }) => kind === TaskKind.relativePosition);
  const [of, from] = task ? [task.arm, task.other_arm] : [0, 1];
  const [to, other] = [tips[of], tips[from]];
  if (!to || !other) return "";
  const relative = to.map((x, k) => x - other[k]!);
  const name = (arm: number): string => shortName(arms[arm] ?? String(arm));
  const text = `tip ${name(of)} from tip ${name(from)}: ${relative.map((x) => millimetres(x, 1)).join(", ")} mm`;
  if (!task) return text;
  return `${text} · error ${millimetres(Math.hypot(...relative.map((x, k) => x - task.position[k]!)), 3)} mm`;
}
