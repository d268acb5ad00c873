// SPDX-License-Identifier: Apache-2.0
/** @file Nearness of an arm to its joint limits, or to a loss of elastic stability, as a scalar for a soft task. */
#pragma once

#include "kinematics/arm_model.h"
#include "safety/limits.h"

namespace tandem::kinematics {

/** Nearness of an arm to what a soft task keeps it away from. With the distances g_i(q) to that, of which d is the one
 * at which the task begins to act,
 *
 *     C(q) = sum over i of max(0, d - g_i)^2 / (2 d),
 *     grad C = - sum over i of max(0, d - g_i) / d grad g_i.
 *
 * C is once continuously differentiable where the g_i are, and zero with its gradient where nothing is nearer than d. A
 * task C' = -gain C with one g_i makes d - g_i decay with gain / 2.
 *
 * A row grad C qdot = -gain C constrains qdot at any length of grad C, so a task that is suddenly in a list, or out of
 * it, makes the velocity jump. The activation h blends it in (control::Task): with the depth p = sqrt(2 C / d), which
 * is 1 - g / d for one limit, and u = |grad C|, dimensionless with radians counted as kLengthPerRadian,
 *
 *     h = S(p / kFullDepth) S(u / (kLeastLever p)),   S(x) = x^2 (3 - 2 x) for x in [0, 1], 1 beyond:
 *
 * zero at g = d, with its derivative; one at g = d / 2 and nearer; and zero where no joint leads away (limits on both
 * sides, say), where the row would ask for unbounded velocities. */
struct Avoidance {
  static constexpr double kFullDepth = 0.5, kLeastLever = 0.1;

  double least = 0.0;       ///< smallest g_i; infinite without one
  double cost = 0.0;        ///< C, in the unit of d
  double activation = 0.0;  ///< h, 0 to 1
  Gradient gradient;        ///< of C by the joints
};

/** Nearness to joint limits, m: g_i is the distance of a translation from each end of its box, that of a rotation times
 * kLengthPerRadian, and the gap b - a^T q of every coupled row. */
Avoidance jointLimitAvoidance(const safety::ArmLimits& limits, const JointsRef& q, double distance) noexcept;

/** Nearness to a loss of elastic stability, dimensionless: g is Tip::stability, 1 without elastic interaction and 0
 * where the arm snaps.
 * @param branch  of the model's result for q  @param stability  that result's  @param distance  below 1 */
Avoidance stabilityAvoidance(const ArmModel& model,
                             const JointsRef& q,
                             const Branch& branch,
                             double stability,
                             double distance);

}  // namespace tandem::kinematics
