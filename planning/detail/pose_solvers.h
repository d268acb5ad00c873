// SPDX-License-Identifier: Apache-2.0
/** @file The two solvers of PoseProblem. */
#pragma once

#include <optional>

#include "planning/pose_problem.h"

namespace tandem::planning {

/** Sequential quadratic programming with the Hessian of the objective alone (Gauss-Newton), for poses near the start.
 * Step d of z from the present point, in the same units:
 *
 *     min  1/2 |z + d - z_ref|^2   s.t.  lower <= g + (dg/dz) d <= upper,   d within the boxes
 *
 * The curvature of the constraints is neglected, so steps become smaller by a factor that grows with the distance to
 * the reference and with the curvature. An optimum has a step below 1e-9 and constraints satisfied to 1e-9.
 * @return nullopt: a problem of another kind or size, or steps that do not become smaller; then solveByIpopt() finds
 * the answer. */
std::optional<PoseSolution> solveBySteps(const PoseProblem& problem, const safety::RobotVector& start);

/// Interior point method with exact Hessians.
PoseSolution solveByIpopt(const PoseProblem& problem,
                          const safety::RobotVector& start,
                          int max_iterations,
                          const std::function<bool()>& cancelled);

}  // namespace tandem::planning
