// SPDX-License-Identifier: Apache-2.0
#include "control/limit_weights.h"

#include <algorithm>
#include <cmath>

namespace tandem::control {

RobotVector limitWeights(const StepProblem& problem, const MethodParameters& parameters, LimitView view) noexcept {
  constexpr double kMillimetres = 1e3;
  RobotVector weights(problem.joint_count);
  for (int j = 0; j < problem.joint_count; ++j) {
    const JointState& joint = problem.joint[j];
    if (joint.kind == JointKind::kRotation) {
      weights[j] = parameters.rotation_weight;
      continue;
    }
    double gradient = 0.0;
    const double lower = view.both_neighbours ? joint.moving_lower : joint.frozen_lower;
    const double upper = view.both_neighbours ? joint.moving_upper : joint.frozen_upper;
    if (std::isfinite(lower) && std::isfinite(upper)) {
      const double min = kMillimetres * lower, max = kMillimetres * upper;
      const double beta = kMillimetres * joint.position;
      const double nearest = kMillimetres * view.nearest;
      const double to_max = std::max(std::abs(max - beta), nearest), to_min = std::max(std::abs(beta - min), nearest);
      const double range = max - min;
      gradient = range * range * (2.0 * beta - max - min) / (4.0 * to_max * to_max * to_min * to_min);
    }
    weights[j] = parameters.translation_weight * (1.0 + std::abs(gradient));
  }
  return weights;
}

TaskGram plainGram(const StepProblem& problem,
                   const MethodParameters& parameters,
                   int begin,
                   const TaskJacobian& J) noexcept {
  TaskJacobian weighted = J;
  for (int j = 0; j < J.cols(); ++j) {
    const bool rotation = problem.joint[begin + j].kind == JointKind::kRotation;
    weighted.col(j) /= rotation ? parameters.rotation_weight : parameters.translation_weight;
  }
  return weighted.lazyProduct(J.transpose());
}

double singularThreshold(const MethodParameters& parameters) noexcept {
  return parameters.singular_lever / std::sqrt(parameters.rotation_weight);
}

}  // namespace tandem::control
