// SPDX-License-Identifier: Apache-2.0
/** @file Helpers shared by the two QP methods: limits as constraints, solver outcomes as statuses. */
#pragma once

#include "control/quadratic_program.h"
#include "control/solution.h"
#include "control/velocity_bounds.h"

namespace tandem::control {

/// Bounds and coupled rows of one step into a QP whose first joint_count variables are the joint velocities.
void addLimits(const StepProblem& problem, const VelocityBounds& bounds, QuadraticProgram& qp) noexcept;

/// Bounds what one step may do, so that it stays where the Jacobian holds.
/// @param translation  m/s
/// @param rotation  rad/s
void boundSteps(const StepProblem& problem, double translation, double rotation, VelocityBounds& bounds) noexcept;

/// What the outcome of a QP means for the step.
SolveStatus statusOf(QpStatus status) noexcept;

}  // namespace tandem::control
