// SPDX-License-Identifier: Apache-2.0
/** Colours of what guides the eye. Those of arms, tubes and grasped object come with the robot (services/console/palette.cpp). */

/** Axes of frames: x, y, z. */
export const kAxisColors = ["#ff4040", "#40d040", "#6080ff"] as const;
/** Goals and plans: light, with line styles of their own. */
export const kGoal = "#f0e442";
export const kNear = "#cc79a7";
/** Requested motion that limits prevent. */
export const kClamped = "#d55e00";
/** Regions that targets of tips do not enter. */
export const kForbidden = "#e0407b";
/** The box that they do not leave. */
export const kWorkspace = "#7f95aa";
/** Bodies close to each other. */
export const kClose = "#ff1f4b";
/** Points of a checked trajectory that are reached, and not. */
export const kReached = "#1fb88d";
export const kMissed = "#ff7a3d";
