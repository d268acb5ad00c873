// SPDX-License-Identifier: Apache-2.0
/** Tones by severity. Browsers allow them after the first key or click in the page. */
import type { Level } from "../state/log";

/** Frequency, Hz, and beginnings of the tones, s. */
const kTones: Partial<Record<Level, { pitch: number; at: readonly number[] }>> = {
  alarm: { pitch: 880, at: [0, 0.2, 0.4] },
  bad: { pitch: 330, at: [0] },
};
const kLength = 0.12; // s
const kGap = 300; // ms between two that begin: several events of one moment sound once

export class Sound {
  private context: AudioContext | null = null;
  private last: Partial<Record<Level, number>> = {};
  on = true;

  constructor() {
    const allow = (): void => {
      this.context ??= new AudioContext();
      void this.context.resume();
    };
    for (const gesture of ["pointerdown", "keydown"]) window.addEventListener(gesture, allow, { capture: true });
  }
  /** Whether tones can sound: not before the first key or click, and not while they are switched off. */
  get audible(): boolean {
    return this.on && this.context?.state === "running";
  }
  play(level: Level): void {
    const tones = kTones[level];
    const now = performance.now();
    if (!tones || !this.context || !this.audible || now - (this.last[level] ?? -Infinity) < kGap) return;
    this.last[level] = now;
    for (const at of tones.at) {
      const oscillator = new OscillatorNode(this.context, { frequency: tones.pitch, type: "square" });
      const volume = new GainNode(this.context, { gain: 0.15 });
      oscillator.connect(volume).connect(this.context.destination);
      oscillator.start(this.context.currentTime + at);
      oscillator.stop(this.context.currentTime + at + kLength);
    }
  }
}
