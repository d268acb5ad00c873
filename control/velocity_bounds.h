// SPDX-License-Identifier: Apache-2.0
/** @file Velocity bounds from position limits. */
#pragma once

#include "control/parameters.h"
#include "control/step_problem.h"

namespace tandem::control {

/** Bounds on qdot for one step of T seconds: Alsaka et al. 2024, below (7), after Flacco et al. 2015,
 *
 *   lower_i = max{ (q_min,i - q_i) / T, -V_i, -sqrt(2 A_i (q_i - q_min,i)) },
 *   upper_i = min{ (q_max,i - q_i) / T,  V_i,  sqrt(2 A_i (q_max,i - q_i)) }.
 *
 * Frozen: q_min, q_max are the intervals of equation (1) with a stationary inner neighbour, as printed.
 * Coupled: q_min, q_max are the boxes, and every row a^T q <= b of equation (1) becomes
 *   a^T qdot <= min{ gap / T, sqrt(2 A gap) },  gap = b - a^T q.
 * Frozen, a joint outside its limit does not move farther out: that side's bound is zero. Coupled, joints and rows
 * outside return: that side's bound is the same speed with the opposite sign (see Recovery).
 * @param period  T, s, positive. */
void velocityBounds(const StepProblem& problem, BoundsKind kind, double period, VelocityBounds& bounds) noexcept;

}  // namespace tandem::control
