// SPDX-License-Identifier: Apache-2.0
/** Age of displayed data, and the age at which it is stale. */

/** ms: age at which data is stale. Five periods, at least half a second. */
export const staleAfter = (period: number): number => Math.max(500, 5000 * period);

/** ms since `at`; infinite if nothing was ever received. */
export const age = (at: number, now: number): number => (at < 0 ? Infinity : Math.max(0, now - at));

export function ageText(milliseconds: number): string {
  if (!Number.isFinite(milliseconds)) return "never received";
  if (milliseconds < 1000) return `${Math.round(milliseconds)} ms old`;
  if (milliseconds < 60_000) return `${(milliseconds / 1000).toFixed(1)} s old`;
  if (milliseconds < 3_600_000) return `${Math.floor(milliseconds / 60_000)} min old`;
  return `${Math.floor(milliseconds / 3_600_000)} h old`;
}
