// SPDX-License-Identifier: Apache-2.0
/** @file Helpers shared by the QP methods: limits as constraints, solver outcomes as statuses. */
#pragma once

#include "control/quadratic_program.h"
#include "control/solution.h"
#include "control/velocity_bounds.h"

namespace tandem::control {

/// Adds bounds and coupled rows of one step to a QP whose first joint_count variables are the joint velocities.
void addLimits(const StepProblem& problem, const VelocityBounds& bounds, QuadraticProgram& qp) noexcept;

/// Adds step bounds, so that a step stays where the Jacobian is valid.
/// @param translation  m/s
/// @param rotation  rad/s
void boundSteps(const StepProblem& problem, double translation, double rotation, VelocityBounds& bounds) noexcept;

/// Status of the step for the status of its QP.
SolveStatus statusOf(QpStatus status) noexcept;

}  // namespace tandem::control
