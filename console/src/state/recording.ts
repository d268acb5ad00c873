// SPDX-License-Identifier: Apache-2.0
/** State of the server's recording: GET /api/recording. */

export interface RecordingState {
  recording: boolean;
  /** Of this or the last recording; empty if there was none. */
  file: string;
  seconds: number;
  messages: number;
  lost: number;
  bytes: number;
  marks: { seconds: number; text: string }[];
  /** Why it ended early; empty if it did not. */
  problem: string;
}

export function describeRecording(state: RecordingState): string {
  if (state.problem !== "") return `✕ It ended early: ${state.problem}`;
  if (state.file === "") return "Nothing was recorded yet.";
  const lost = state.lost > 0 ? `, ${state.lost} LOST` : "";
  const size = `${state.seconds.toFixed(0)} s, ${state.messages} messages${lost}, ${(state.bytes / 1e6).toFixed(1)} MB`;
  const last = state.marks.at(-1);
  const marks = last
    ? `, ${state.marks.length} ${state.marks.length === 1 ? "mark" : "marks"} (last: ${last.text}, at ${last.seconds.toFixed(1)} s)`
    : "";
  return `${state.recording ? "● RECORDING" : "Recorded"} ${size}${marks}: ${state.file.split("/").at(-1)}`;
}
