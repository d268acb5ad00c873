// SPDX-License-Identifier: Apache-2.0
#include "control/detail/qp_methods.h"

#include <algorithm>

namespace tandem::control {

void addLimits(const StepProblem& problem, const VelocityBounds& bounds, QuadraticProgram& qp) noexcept {
  qp.lower.head(problem.joint_count) = bounds.lower;
  qp.upper.head(problem.joint_count) = bounds.upper;
  for (int i = 0; i < bounds.row_count; ++i) {
    qp.A(i, problem.row[i].first) = problem.row[i].a_first;
    qp.A(i, problem.row[i].second) = problem.row[i].a_second;
    qp.b[i] = bounds.row_rate[i];
  }
}

void boundSteps(const StepProblem& problem, double translation, double rotation, VelocityBounds& bounds) noexcept {
  bounds.step_translation = translation;
  bounds.step_rotation = rotation;
  for (int j = 0; j < problem.joint_count; ++j) {
    const double velocity = problem.joint[j].kind == JointKind::kRotation ? rotation : translation;
    // Does not contradict a bound that requires a return from outside a limit.
    bounds.lower[j] = std::min(std::max(bounds.lower[j], -velocity), velocity);
    bounds.upper[j] = std::max(std::min(bounds.upper[j], velocity), -velocity);
  }
}

SolveStatus statusOf(QpStatus status) noexcept {
  switch (status) {
    case QpStatus::kSolved:
      return SolveStatus::kSolved;
    case QpStatus::kInfeasible:
      return SolveStatus::kInfeasible;
    case QpStatus::kIterationLimit:
      return SolveStatus::kIterationLimit;
    case QpStatus::kNotFinite:
      return SolveStatus::kNotFinite;
    default:
      return SolveStatus::kFailed;
  }
}

}  // namespace tandem::control
