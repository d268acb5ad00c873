// SPDX-License-Identifier: Apache-2.0
/** @file Limits that prevent a stalled robot from achieving its tasks: those active at the least-squares velocity. */
#pragma once

#include <string>
#include <vector>

#include "control/parameters.h"
#include "control/step_problem.h"

namespace tandem::control {

/** Names of the limits that are active at the solution of
 *
 *   min over qdot   1/2 sum over all tasks |J_k qdot - v_k|^2 + 1/2 zeta |qdot|^2   s.t.  bounds and coupled rows
 *
 * The largest multiplier is first: without these limits the tasks would have a smaller error. Empty if no joint limit
 * increases the error. Allocates; not for the periodic path.
 * @param arms  names of the arms, as in describe()
 * @param steps  whether the step bounds of a method count as limits */
std::vector<std::string> obstructingLimits(const StepProblem& problem,
                                           const MethodParameters& parameters,
                                           const std::vector<std::string>& arms,
                                           bool steps);

}  // namespace tandem::control
