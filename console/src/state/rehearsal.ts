// SPDX-License-Identifier: Apache-2.0
/** The rehearsal of a checked trajectory: joints that control would pass through. */
import type { ComputationResult } from "../wire/messages";

export interface Rehearsed {
  /** Of all arms in order, m, rad. */
  joints: number[];
  /** Of the trajectory, from 1; 0: the start. */
  point: number;
  /** s after the start */
  time: number;
}

/** Joints on the way, as a run without planned postures takes it; none without a rehearsal. @param joints  number, of all arms
 * @param period  of control, s */
export function rehearsedJoints(result: ComputationResult, joints: number, period: number): Rehearsed[] {
  if (result.rehearsed === 0 || joints === 0) return [];
  const { joints: all, joints_points: points, stride, iterations } = result.without_posture;
  return Array.from({ length: Math.min(points.length, Math.floor(all.length / joints)) }, (_, k) => ({
    joints: [...all.slice(k * joints, (k + 1) * joints)],
    point: points[k]!,
    time: period * Math.min(k * stride, iterations),
  }));
}
