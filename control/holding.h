// SPDX-License-Identifier: Apache-2.0
/** @file Limits that keep a stalled robot from its tasks: those active at the least-squares velocity. */
#pragma once

#include <string>
#include <vector>

#include "control/parameters.h"
#include "control/step_problem.h"

namespace tandem::control {

/** The limits, in words, that are active in
 *
 *   min over qdot   1/2 sum over all tasks |J_k qdot - v_k|^2 + 1/2 zeta |qdot|^2   s.t.  bounds and coupled rows
 *
 * at its solution, the strongest first: those without which the tasks would come nearer. None where no limit of the
 * joints is in the way. Allocates; not for the periodic path.
 * @param arms  names of the arms, as describe() takes them
 * @param steps  whether what a method allows in a step counts as a limit */
std::vector<std::string> holding(const StepProblem& problem,
                                 const MethodParameters& parameters,
                                 const std::vector<std::string>& arms,
                                 bool steps);

}  // namespace tandem::control
