// SPDX-License-Identifier: Apache-2.0
/** @file Velocity bounds that return an arm from outside its limits. */
#pragma once

#include <memory>

#include "control/quadratic_program.h"

namespace tandem::control {

/** Velocity that returns joints and rows from outside their limits, while the others stay inside theirs:
 *
 *   min over qdot   1/2 sum over all outside (a_i^T qdot - wanted_i)^2 + eps/2 qdot^T qdot
 *   s.t.            bounds and rows of all inside, and |qdot_j| <= V_j
 *
 * where wanted_i is the speed of the approach to a limit, from the other side (VelocityBounds). The result becomes the
 * bound of those outside: it has precedence over the tasks, and is always feasible. */
class Recovery {
 public:
  explicit Recovery(Backend backend) : backend_(makeQpBackend(backend)) {}

  /// @param bounds  of velocityBounds(): those that require a return are relaxed to feasible values
  /// @param velocity  a velocity that satisfies the bounds; zero if nothing is outside
  void apply(const StepProblem& problem, VelocityBounds& bounds, RobotVector& velocity) noexcept;
  /// Discards the state of former steps.
  void reset() noexcept { backend_->reset(); }

 private:
  void limit(const StepProblem& problem, const VelocityBounds& bounds);

  std::unique_ptr<QpBackend> backend_;
  QuadraticProgram qp_;
  QpSolution solution_;
};

}  // namespace tandem::control
