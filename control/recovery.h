// SPDX-License-Identifier: Apache-2.0
/** @file Velocity bounds that return an arm from outside its limits. */
#pragma once

#include <memory>

#include "control/quadratic_program.h"

namespace tandem::control {

/** Velocity that brings joints and rows back which are outside their limits, while the others keep theirs:
 *
 *   min over qdot   1/2 sum over what is outside (a_i^T qdot - wanted_i)^2 + eps/2 qdot^T qdot
 *   s.t.            bounds and rows of all that is inside, and |qdot_j| <= V_j
 *
 * with wanted_i the speed of the approach to a limit, from the other side (VelocityBounds). What comes out is then what
 * the bounds of those outside ask for at least: the task has to leave it that, and always can. */
class Recovery {
 public:
  explicit Recovery(Backend backend) : backend_(makeQpBackend(backend)) {}

  /// @param bounds  of velocityBounds(): those that ask for a way back are changed to what is possible
  /// @param velocity  a velocity that satisfies the bounds, zero where nothing is outside
  void apply(const StepProblem& problem, VelocityBounds& bounds, RobotVector& velocity) noexcept;

 private:
  void limit(const StepProblem& problem, const VelocityBounds& bounds);

  std::unique_ptr<QpBackend> backend_;
  QuadraticProgram qp_;
  QpSolution solution_;
};

}  // namespace tandem::control
