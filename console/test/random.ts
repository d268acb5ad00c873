// SPDX-License-Identifier: Apache-2.0
/** Random numbers whose seed is printed; TANDEM_SEED repeats a run. */
export function seeded(): () => number {
  let state = Number(process.env["TANDEM_SEED"] ?? Math.floor(Math.random() * 2 ** 31));
  console.log(`TANDEM_SEED=${state}`);
  return () => {
    // mulberry32
    state = (state + 0x6d2b79f5) | 0;
    let t = Math.imul(state ^ (state >>> 15), 1 | state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 2 ** 32;
  };
}
