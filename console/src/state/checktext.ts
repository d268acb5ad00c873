// SPDX-License-Identifier: Apache-2.0
/** What a check has found, in a few words, with the content of `tandem plan check`. */
import type { PointReport } from "../wire/messages";
import { Reach, RehearsalEnd } from "../wire/messages";
import type { CheckState } from "./check";
import { millimetres } from "./numbers";

export interface CheckText {
  text: string;
  level: "info" | "good" | "bad";
}

export const reached = ({ reach }: PointReport): boolean => reach === Reach.reached;

export function describeCheck(check: CheckState): CheckText {
  switch (check.kind) {
    case "none":
      return { text: check.reason === "" ? "" : `Not checked: ${check.reason}`, level: "info" };
    case "running":
      return { text: `Planning checks the trajectory: ${(100 * check.share).toFixed(0)} %`, level: "info" };
    case "refused":
      return { text: `✕ ${check.reason}`, level: "bad" };
  }
  if (check.moved) return { text: "The arms have moved since the check.", level: "info" };
  const { report, rehearsed, without_posture: rehearsal } = check.result;
  if (report.start !== "") return { text: `✕ It cannot start from the present joints: ${report.start}`, level: "bad" };
  const missed = report.points.filter((point) => !reached(point));
  const failed = rehearsed !== 0 && rehearsal.end !== RehearsalEnd.completed;
  // The rehearsal goes other ways than planning's postures: where there is one, its clearance counts.
  const clearance = rehearsed !== 0 ? rehearsal.least_clearance : Math.min(...report.points.map((p) => p.clearance));
  const overlap = clearance < 0;
  const lines: string[] = [];
  if (missed.length > 0)
    lines.push(
      `✕ ${missed.length} of ${report.points.length} points cannot be reached. Point ${missed[0]!.point}: ${missed[0]!.reason}.`,
    );
  else lines.push(`${failed ? "" : "✓ "}All ${report.points.length} points can be reached.`);
  if (failed)
    lines.push(
      `✕ In the rehearsal, ${check.method} reaches ${rehearsal.converged} of ${rehearsal.points}: ${rehearsal.reason}.`,
    );
  else if (rehearsed !== 0) lines.push(`${check.method} needs ${rehearsal.iterations} control periods.`);
  if (overlap) lines.push(`⚠ The arms overlap by up to ${millimetres(-clearance)} mm.`);
  else if (Number.isFinite(clearance)) lines.push(`Least clearance of the arms: ${millimetres(clearance)} mm.`);
  return {
    text: lines.join(" "),
    level: missed.length > 0 || failed ? "bad" : overlap ? "info" : "good",
  };
}
