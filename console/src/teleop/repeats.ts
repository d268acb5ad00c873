// SPDX-License-Identifier: Apache-2.0
/** Whether a key is still held. A menu of the browser receives the key's release instead of the page, which keeps the focus and learns
 * nothing: only the repetition of a held key proves that it is held. */

/** Longest delay of the first repetition, and longest period of the others, as operating systems let people set them, ms. */
export const kFirstRepeat = 1200;
export const kNextRepeat = 600;
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
