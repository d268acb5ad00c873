// SPDX-License-Identifier: Apache-2.0
/** @file Check of a method on random problems, before it may move a robot. */
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "control/resolver.h"

namespace tandem::control {

/** Conditions of the check of a method. */
struct CheckConditions {
  MethodParameters parameters;                   ///< with which the method was constructed
  std::vector<const safety::ArmLimits*> limits;  ///< of the robot: its arms, joint types and coupled rows
  bool judge_time = false;                       ///< 95 of 100 calls must take at most half of parameters.period
  std::size_t (*allocation_count)() = nullptr;   ///< allocations of the calling thread so far; null: not counted
};

/** Result of the check. */
struct CheckResult {
  std::string refusal;  ///< "found ..., expected ..."; empty: the method may be used
  std::string remarks;  ///< for people: whether limits are kept, neglected tasks, duration
};

/** Solves random problems with the robot's arms, joints and rows, with fixed seeds.
 *
 * With limits far away, task k of velocity v_k and Jacobian J_k:
 *   |J_1 qdot - s_1 v_1| <= 0.05 |v_1| and s_1 >= 0.5 in 90 of 100 problems;
 *   for k > 1 half the change of v_k^T J_k qdot / |v_k|^2 between v_k and -v_k is 0.1 or more on average, unless the
 *   average of s_k is below 0.1: such a task is neglected, and the method reports it.
 * With near limits: qdot stays within velocityBounds() and coupled rows, unless Solution::bounds is infinite
 * everywhere: such a method leaves the limits to the gate.
 * Every solution is finite, has the right size and status kSolved or kInfeasible; calls after the first allocate
 * nothing and are fast enough. */
CheckResult checkMethod(Resolver& resolver, const CheckConditions& conditions);

}  // namespace tandem::control
