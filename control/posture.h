// SPDX-License-Identifier: Apache-2.0
/** @file Posture task: planned joint positions as the lowest priority. */
#pragma once

#include "control/quadratic_program.h"

namespace tandem::control {

/** Velocity toward the posture q_p of a problem that has one,
 *
 *   qdot_p = c k_p (q_p - q),
 *
 * with k_p = posture_gain and c <= 1 the largest for which |qdot_p,j| is at most V_j, the step of a translation and
 * `rotation`, rad/s, for every joint: along the straight line to the posture. */
RobotVector postureVelocity(const StepProblem& problem, const MethodParameters& parameters, double rotation) noexcept;

/** Velocity of translations away from limits and neighbours: minus gradient of
 *
 *   C(q) = k_s / 2  sum over all gaps of max(0, d - gap)^2,
 *
 * where the gaps are the two of every box and that of every coupled row, which moves apart the tubes on both of its
 * sides: the dependence on both neighbours that Alsaka et al. 2024 (section 4) propose in place of H(beta).
 * d = spread_distance, k_s = spread_gain; scaled as a whole so that no translation exceeds V and translation_step. Zero
 * for rotations. */
RobotVector spreadVelocity(const StepProblem& problem, const MethodParameters& parameters) noexcept;

/** Posture term of closed-form methods: the part of qdot_p that disturbs no task,
 *
 *   (I - J# J) qdot_p,   J# = W^-1 J^T (J W^-1 J^T + damping I)^-1,   J all tasks' Jacobians stacked.
 *
 * Zero if the problem has no posture.
 * @param weights  diagonal of W */
void addPosture(const StepProblem& problem,
                const MethodParameters& parameters,
                const RobotVector& weights,
                double damping,
                RobotVector& velocity) noexcept;

/** The velocity within the limits nearest to qdot_p:   min |qdot - qdot_p|^2   s.t. bounds and rows. */
class PostureWithinLimits {
 public:
  explicit PostureWithinLimits(Backend backend) : backend_(makeQpBackend(backend)) {}

  /// @param bounds  feasible ones
  /// @param velocity  a feasible velocity; replaced by the nearest one
  void apply(const StepProblem& problem,
             const RobotVector& wanted,
             const VelocityBounds& bounds,
             RobotVector& velocity) noexcept;
  void reset() noexcept { backend_->reset(); }

 private:
  std::unique_ptr<QpBackend> backend_;
  QuadraticProgram qp_;
  QpSolution solution_;
};

}  // namespace tandem::control
