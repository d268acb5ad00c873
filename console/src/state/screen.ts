// SPDX-License-Identifier: Apache-2.0
/** Whether the page is on a phone, where it can watch and stop, but not command. */

const kLeast = 600; // px: the shorter side of the smallest tablets

/** By the screen and not by the window: a magnified page, or a narrow window beside others, keeps its commands. */
export const isPhone = (touched: boolean, screen: { width: number; height: number }): boolean =>
  touched && Math.min(screen.width, screen.height) < kLeast;

/** Of this page. A screen of any size that is operated with a mouse is not a phone's. */
export const onPhone = (): boolean => isPhone(matchMedia("(pointer: coarse)").matches, window.screen);
