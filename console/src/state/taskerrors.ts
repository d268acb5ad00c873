// SPDX-License-Identifier: Apache-2.0
/** Errors of tasks for people. Control weighs angles with 0.05 m per radian, so that all errors are lengths; here an angle is an angle. */
import type { ControlStatus, PlanningReference, TaskReference, TeleopStatus } from "../wire/messages";
import { Phase, Source, TaskKind, TeleopMode } from "../wire/messages";
import type { Teleoperation } from "./robot";

/** kinematics::kLengthPerRadian, m/rad: of task_error in control/status. */
const kLengthPerRadian = 0.05;

/** What is shown of task_error. */
export interface ErrorScale {
  /** "mm with angles": a pose's; the angle counts with 0.05 m per radian. Empty: a plain number. */
  unit: "mm" | "°" | "mm with angles" | "";
  /** From task_error. */
  factor: number;
}

const kLength: ErrorScale = { unit: "mm", factor: 1e3 };
const kAngle: ErrorScale = { unit: "°", factor: 180 / Math.PI / kLengthPerRadian };
const kPose: ErrorScale = { unit: "mm with angles", factor: 1e3 };
const kScales: Partial<Record<number, ErrorScale>> = {
  [TaskKind.tipAxis]: kAngle,
  [TaskKind.tipOrientation]: kAngle,
  [TaskKind.relativeOrientation]: kAngle,
  [TaskKind.lookAt]: kAngle,
  [TaskKind.tipPose]: kPose,
  [TaskKind.relativePose]: kPose,
  [TaskKind.objectPose]: kPose,
  [TaskKind.elasticStability]: { unit: "", factor: 1 / kLengthPerRadian },
};

/** The trajectory under way, as far as its tasks are concerned. */
export type Followed = Pick<PlanningReference, "phase" | "task_count" | "tasks">;

/** What control follows: the tasks of an operator in the order of planning::teleoperation::Pipeline, or the trajectory. */
export function followed(
  { source }: Pick<ControlStatus, "source">,
  plan: PlanningReference | null,
  teleop: Pick<TeleopStatus, "mode" | "arm" | "other_arm"> | null,
  orientation: Teleoperation["orientation"],
): Followed | null {
  if (source !== Source.teleoperation || !teleop) return plan;
  const { mode, arm, other_arm } = teleop;
  const task = (kind: number, whose: number): TaskReference => ({ kind, arm: whose, other_arm }) as TaskReference;
  const tasks =
    mode === TeleopMode.tip
      ? [...new Set([arm, other_arm])].map((k) => task(TaskKind.tipPosition, k))
      : [task(TaskKind.relativePosition, arm), task(TaskKind.tipPosition, mode === TeleopMode.pair ? arm : other_arm)];
  if (orientation !== "ignored")
    tasks.push(task(orientation === "axis" ? TaskKind.tipAxis : TaskKind.tipOrientation, arm));
  return { phase: Phase.running, task_count: tasks.length, tasks };
}

/** The tasks of the trajectory under way, if control follows as many; otherwise none: their kinds are not known. */
export const followedTasks = (count: number, plan: Followed | null): readonly TaskReference[] =>
  plan !== null && plan.task_count === count && (plan.phase === Phase.running || plan.phase === Phase.paused)
    ? plan.tasks.slice(0, count)
    : [];

/** Of a task whose kind is not known: mm. */
export const scaleOf = (task: Pick<TaskReference, "kind"> | undefined): ErrorScale =>
  (task && kScales[task.kind]) ?? kLength;

/** "error 0.012 / 0.340 mm", "error 0.012 mm / 1.250°"; empty without tasks. */
export function describeErrors(
  status: Pick<ControlStatus, "task_count" | "task_error">,
  plan: Parameters<typeof followedTasks>[1],
): string {
  const tasks = followedTasks(status.task_count, plan);
  const errors = [...status.task_error.slice(0, status.task_count)].map((error, k) => {
    const { unit, factor } = scaleOf(tasks[k]);
    return { unit: unit === "°" || unit === "" ? unit : ` ${unit}`, text: (factor * error).toFixed(3) };
  });
  if (errors.length === 0) return "";
  const same = errors.every(({ unit }) => unit === errors[0]!.unit);
  const all = errors.map(({ text, unit }) => (same ? text : `${text}${unit}`)).join(" / ");
  return `error ${all}${same ? errors[0]!.unit : ""}`;
}
