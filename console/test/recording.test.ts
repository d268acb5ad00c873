// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";

import type { RecordingState } from "../src/state/recording";
import { describeRecording } from "../src/state/recording";

const kState: RecordingState = {
  recording: true,
  file: "/var/lib/tandem/recordings/now_laptop.mcap",
  seconds: 12.3,
  messages: 4567,
  lost: 0,
  bytes: 2_340_000,
  marks: [],
  problem: "",
};

test("a recording says whether it runs, what it has, and why it ended early", () => {
  expect(describeRecording(kState)).toBe("● RECORDING 12 s, 4567 messages, 2.3 MB: now_laptop.mcap");
  expect(describeRecording({ ...kState, recording: false, lost: 3 })).toBe(
    "Recorded 12 s, 4567 messages, 3 LOST, 2.3 MB: now_laptop.mcap",
  );
  const marks = ["touch", "release"].map((text, k) => ({ seconds: k + 0.25, text }));
  expect(describeRecording({ ...kState, marks })).toContain(", 2 marks (last: release, at 1.3 s)");
  expect(describeRecording({ ...kState, recording: false, problem: "the disk is full" })).toBe(
    "✕ It ended early: the disk is full",
  );
  expect(describeRecording({ ...kState, recording: false, file: "" })).toBe("Nothing was recorded yet.");
});
