// SPDX-License-Identifier: Apache-2.0
/** Text of a run's summary, with the content of that of `tandem robot run`. */
import { Phase, TaskKind } from "../wire/messages";
import type { PlanningReference, RunSummary } from "../wire/messages";
import { nameOf, shortName } from "./descriptions";
import { millimetres } from "./numbers";

export interface SummaryText {
  /** "circle: finished, 100 of 100 points reached in 12.3 s". */
  headline: string;
  lines: string[];
  /** The run failed, or bodies overlapped. */
  bad: boolean;
}

/** Of which run a summary is: the last one of the planning that runs now; of an earlier one, or of another robot or deployment; neither while
 * another run is under way. */
export type Standing = "last" | "earlier" | "none";

/** @param plan  what planning publishes now; null: nothing is known of it @param fingerprint  of robot and deployment */
export function standingOf(
  summary: RunSummary | null,
  plan: Pick<PlanningReference, "fingerprint" | "trajectory_id" | "point_count"> | null,
  fingerprint: string,
): Standing {
  if (summary === null || plan === null) return "none";
  if (plan.fingerprint !== BigInt(`0x${fingerprint}`)) return "earlier";
  if (summary.trajectory_id === plan.trajectory_id) return "last";
  return plan.point_count === 0 ? "earlier" : "none"; // planning has had no run since its start
}

/** Tasks of angles, with errors in degrees. */
const kAngles: Partial<Record<number, string>> = {
  [TaskKind.tipAxis]: "axis of",
  [TaskKind.tipOrientation]: "orientation of",
  [TaskKind.relativeOrientation]: "relative orientation of",
  [TaskKind.lookAt]: "direction of view of",
};

/** @param arms  names, in the robot's order */
export function describeSummary(summary: RunSummary, arms: readonly string[]): SummaryText {
  const arm = (k: number): string => shortName(arms[k] ?? String(k));
  const task = (k: number): string => {
    const own = arm(summary.task_arm[k] ?? 0);
    const both = `${own} and ${arm(summary.task_other_arm[k] ?? 0)}`;
    const angle = kAngles[summary.task_kind[k] ?? 0];
    if (angle !== undefined) return `${angle} ${summary.task_kind[k] === TaskKind.relativeOrientation ? both : own}`;
    if (summary.task_kind[k] === TaskKind.relativePosition) return `relative position of ${both}`;
    if (summary.task_kind[k] === TaskKind.remoteCentre) return `remote centre of ${own}`;
    if (summary.task_kind[k] === TaskKind.tipPose) return `pose of ${own}`;
    if (summary.task_kind[k] === TaskKind.relativePose) return `relative pose of ${both}`;
    if (summary.task_kind[k] === TaskKind.jointLimits) return `joint limits of ${own}`;
    if (summary.task_kind[k] === TaskKind.elasticStability) return `elastic stability of ${own}`;
    return summary.task_kind[k] === TaskKind.objectPose ? "common object" : `tip of ${own}`;
  };
  const lines: string[] = [];
  const overlap = summary.least_clearance < 0;
  if (overlap) lines.push(`WARNING: bodies overlapped by up to ${millimetres(-summary.least_clearance, 3)} mm`);
  for (let k = 0; k < summary.task_count; ++k) {
    const angular = kAngles[summary.task_kind[k] ?? 0] !== undefined;
    const plain = summary.task_kind[k] === TaskKind.elasticStability;
    const [rms, percentile, most] = [summary.rms, summary.percentile_95, summary.maximum].map((of) =>
      angular
        ? (((of[k] ?? NaN) * 180) / Math.PI).toFixed(3)
        : plain
          ? (of[k] ?? NaN).toFixed(3)
          : millimetres(of[k] ?? NaN, 3),
    );
    const unit = angular ? "deg" : plain ? "stability" : "mm";
    lines.push(`error, ${task(k)}: RMS ${rms}, 95 % within ${percentile}, maximum ${most} ${unit}`);
  }
  lines.push(`interventions of the safety gate: ${summary.gate_interventions}`);
  if (!overlap && Number.isFinite(summary.least_clearance))
    lines.push(`least distance of bodies: ${millimetres(summary.least_clearance, 3)} mm`);
  summary.limits.forEach((limit, k) => {
    const share = 100 * (summary.limit_shares[k] ?? NaN);
    lines.push(`${limit} restricted the motion in ${Number(share.toPrecision(3))} % of the control periods`);
  });
  const phase = summary.phase === Phase.idle ? "ended by a client" : nameOf("Phase", summary.phase);
  const reached = `${summary.reached} of ${summary.points} points reached in ${summary.duration.toFixed(1)} s`;
  return {
    headline: `${summary.name}: ${phase}${summary.reason === "" ? "" : `: ${summary.reason}`}; ${reached}`,
    lines,
    bad: overlap || summary.phase === Phase.failed,
  };
}
