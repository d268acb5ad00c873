// SPDX-License-Identifier: Apache-2.0
/** Whether a key is still held. A menu of the browser receives the key's release instead of the page, which keeps the focus and learns
 * nothing: only the repetition of a held key proves that it is held. */

/** Longest delay of the first repetition, and longest period of the others, as operating systems let people set them, ms. */
export const kFirstRepeat = 1200;
export const kNextRepeat = 600;
/** Longest gap of the timer that repeats what is held, ms: a page that hangs for longer may have missed the release. */
export const kGap = 150;
/** @param gap  of the timer, ms */
export const hung = (gap: number): string =>
  `this page hung for ${gap.toFixed(0)} ms, and cannot know whether it was still held`;
export const kNotRepeated = "the key no longer repeats: press it again";

export class Repeats {
  private timer: ReturnType<typeof setTimeout> | undefined;

  /** @param missing  called once when the next repetition has not come in time */
  constructor(private readonly missing: () => void) {}

  /** A key went down, or repeats. */
  seen(repeated: boolean): void {
    this.end();
    this.timer = setTimeout(this.missing, repeated ? kNextRepeat : kFirstRepeat);
  }
  /** No key is held. */
  end(): void {
    clearTimeout(this.timer);
  }
}
