// SPDX-License-Identifier: Apache-2.0
#include "control/velocity_bounds.h"

#include <algorithm>
#include <cmath>

namespace tandem::control {
namespace {

/// Largest violation of a limit by rounding, m or rad.
constexpr double kDistanceRounding = 1e-12;

/// Largest approach speed over a remaining distance, m/s (rad/s). Outside (negative distance): the return speed,
/// negative.
double approach(double distance, double period, double velocity, double acceleration, bool come_back) {
  const double size = std::abs(distance);
  if (distance < 0.0 && (!come_back || size <= kDistanceRounding))
    return 0.0;
  double speed = std::min(size / period, velocity);
  if (std::isfinite(acceleration))
    speed = std::min(speed, std::sqrt(2.0 * acceleration * size));
  return distance < 0.0 ? -speed : speed;
}

}  // namespace

void velocityBounds(const StepProblem& problem, BoundsKind kind, double period, VelocityBounds& bounds) noexcept {
  const bool frozen = kind == BoundsKind::kFrozen;
  bounds.lower.resize(problem.joint_count);
  bounds.upper.resize(problem.joint_count);
  bounds.step_translation = bounds.step_rotation = safety::kUnlimited;
  for (int j = 0; j < problem.joint_count; ++j) {
    const JointState& joint = problem.joint[j];
    const double min = frozen ? joint.frozen_lower : joint.lower;
    const double max = frozen ? joint.frozen_upper : joint.upper;
    bounds.lower[j] = -approach(joint.position - min, period, joint.velocity, joint.approach_acceleration, !frozen);
    bounds.upper[j] = approach(max - joint.position, period, joint.velocity, joint.approach_acceleration, !frozen);
  }
  bounds.row_count = frozen ? 0 : problem.row_count;
  for (int i = 0; i < bounds.row_count; ++i) {
    const CoupledRow& row = problem.row[i];
    bounds.row_rate[i] = approach(row.gap, period, safety::kUnlimited, row.approach_acceleration, true);
  }
}

}  // namespace tandem::control
