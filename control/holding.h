// SPDX-License-Identifier: Apache-2.0
/** @file Which limits hold a robot back that stands still before it has arrived. */
#pragma once

#include "control/parameters.h"
#include "control/solution.h"

namespace tandem::control {

/** The limits that push against
 *
 *   min over qdot   1/2 sum over all tasks |J_k qdot - v_k|^2 + 1/2 zeta |qdot|^2   s.t.  bounds and coupled rows
 *
 * at its solution, the heaviest first: those without which the tasks would come nearer. None where no limit of the
 * joints is in the way. Allocates; not for the periodic path.
 * @param conflict  its limits, to be put into words by describe() */
void findHolding(const StepProblem& problem, const MethodParameters& parameters, Conflict& conflict);

}  // namespace tandem::control
