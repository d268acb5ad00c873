// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import type { Situation } from "../src/state/permission";
import { kDeeds, whyNotNow } from "../src/state/permission";
import { isPhone } from "../src/state/screen";
import { Action, Phase } from "../src/wire/messages";
import { seeded } from "./random";

const kFree: Situation = {
  operator: true,
  phone: false,
  hidden: false,
  connected: true,
  replay: false,
  live: true,
  planningSilent: "",
  lease: "mine",
  phase: Phase.running,
  noOrientation: "",
  refused: () => "",
};
/** Deeds that take power away or end a motion. */
const kSafe = ["release", "pause", "disable", "pauseTrajectory", "endTrajectory"];

/** Deeds that planning carries out. */
const kPlanned = ["start", "pauseTrajectory", "resumeTrajectory", "endTrajectory"];

test("each condition forbids what it has to, with a reason, in all situations", () => {
  const random = seeded();
  const coin = (): boolean => random() < 0.5;
  for (let run = 0; run < 2000; ++run) {
    const s: Situation = {
      operator: coin(),
      phone: coin(),
      hidden: coin(),
      connected: coin(),
      replay: random() < 0.1,
      live: coin(),
      planningSilent: coin() ? "2.0 s old" : "",
      lease: (["mine", "free", "another's"] as const)[Math.floor(3 * random())]!,
      phase: Math.floor(5 * random()),
      noOrientation: coin() ? "ignored" : "",
      refused: coin() ? () => "control refuses" : () => "",
    };
    for (const deed of kDeeds) {
      const why = whyNotNow(deed, s);
      if (!s.operator || !s.connected || !s.live) expect(why).not.toBe("");
      if (s.planningSilent !== "" && kPlanned.includes(deed)) expect(why).not.toBe("");
      if (s.hidden && !kSafe.includes(deed)) expect(why).not.toBe("");
      if (s.lease !== "mine" && !["take", "pause", "disable", "homeDrives"].includes(deed)) expect(why).not.toBe("");
      if (s.refused(0) !== "" && deed !== "endTrajectory") expect(why).not.toBe("");
      if (s.operator && s.replay) expect(why).toMatch(/^A recording is shown/);
      else if (s.operator && s.phone) expect(why).toMatch(/^On a phone/);
      else if (s.operator && s.noOrientation !== "") expect(why === "ignored").toBe(deed === "turn");
      if (!s.operator) expect(why).toMatch(/^Viewer/);
    }
  }
});

test("all is possible where nothing forbids it, and control's reasons are shown as they are", () => {
  for (const deed of kDeeds) {
    const phase = deed === "resumeTrajectory" ? Phase.paused : Phase.running;
    expect(whyNotNow(deed, { ...kFree, phase })).toBe("");
    const silent = whyNotNow(deed, { ...kFree, phase, planningSilent: "2.0 s old" });
    expect(silent).toMatch(kPlanned.includes(deed) ? /^Planning does not answer: its last data is 2.0 s old/ : /^$/);
    const action = (Action as Record<string, number>)[deed];
    if (action !== undefined)
      expect(whyNotNow(deed, { ...kFree, phase, refused: (asked) => (asked === action ? "so" : "") })).toBe("so");
  }
  expect(whyNotNow("method", { ...kFree, refused: (asked) => (asked === Action.setMethod ? "so" : "") })).toBe("so");
  expect(whyNotNow("take", { ...kFree, lease: "another's" })).toMatch(/^Another client/);
  expect(whyNotNow("pauseTrajectory", { ...kFree, phase: Phase.paused })).toBe("No trajectory runs.");
  expect(whyNotNow("resumeTrajectory", kFree)).toBe("No trajectory is paused.");
});

test("phones are small screens that are touched, however they are turned", () => {
  for (const [width, height, phone] of [
    [375, 667, true],
    [599, 2000, true],
    [600, 1024, false],
    [1280, 720, false],
  ] as const) {
    expect(isPhone(true, { width, height })).toBe(phone);
    expect(isPhone(true, { width: height, height: width })).toBe(phone);
    expect(isPhone(false, { width, height })).toBe(false);
  }
});
