// SPDX-License-Identifier: Apache-2.0
/** @file Which limits forbid a task, from the certificate of an infeasible problem. */
#pragma once

#include <string>
#include <vector>

#include "control/quadratic_program.h"
#include "control/solution.h"

namespace tandem::control {

/// Takes the limits of a certificate, the heaviest first; the QP's first joint_count variables are the velocities, its
/// rows those of the bounds. Allocates nothing.
void explain(const StepProblem& problem,
             const VelocityBounds& bounds,
             const QpSolution& certificate,
             Conflict& conflict) noexcept;

/** In words: "tube 2 of arm a against tube 1, velocity limit of tube 2 of arm a".
 * @param arms  names of the arms, in the robot's order */
std::string describe(const StepProblem& problem, const Conflict& conflict, const std::vector<std::string>& arms);

}  // namespace tandem::control
