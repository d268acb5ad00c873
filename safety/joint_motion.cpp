// SPDX-License-Identifier: Apache-2.0
#include "safety/joint_motion.h"

#include <algorithm>
#include <cmath>

namespace tandem::safety {

double moveVelocity(const ArmLimits& limits, int joint) noexcept {
  const double limit = limits.joints[static_cast<std::size_t>(joint)].velocity;
  if (std::isfinite(limit))
    return limit;
  return limits.isTranslation(joint) ? kMoveTranslationVelocity : kMoveRotationVelocity;
}

double moveAcceleration(const ArmLimits& limits, int joint) noexcept {
  const JointLimit& limit = limits.joints[static_cast<std::size_t>(joint)];
  const bool translation = limits.isTranslation(joint);
  return std::min({translation ? kMoveTranslationAcceleration : kMoveRotationAcceleration, limit.slew_limit,
                   limit.stop_deceleration});
}

JointMotion::JointMotion(const ArmLimits& limits, const ArmVector& q0, const ArmVector& q1) noexcept
    : q0_(q0), q1_(q1) {
  double speed = kUnlimited;  // of the path parameter, 1/s
  acceleration_ = kUnlimited;
  for (int j = 0; j < limits.jointCount(); ++j) {
    const double distance = std::abs(q1[j] - q0[j]);
    if (distance == 0.0)
      continue;
    speed = std::min(speed, moveVelocity(limits, j) / distance);
    acceleration_ = std::min(acceleration_, moveAcceleration(limits, j) / distance);
  }
  if (!std::isfinite(speed))
    return;  // no distance
  // Either the speed is reached, or the distance is so short that deceleration begins half-way.
  ramp_ = std::min(speed / acceleration_, std::sqrt(1.0 / acceleration_));
  duration_ = ramp_ + 1.0 / (acceleration_ * ramp_);
}

ArmVector JointMotion::position(double t) const noexcept {
  if (finished(t))
    return q1_;
  if (t <= 0.0)
    return q0_;
  double part = 0.0;
  if (t < ramp_) {
    part = 0.5 * acceleration_ * t * t;
  } else if (t <= duration_ - ramp_) {
    part = acceleration_ * ramp_ * (t - 0.5 * ramp_);
  } else {
    part = 1.0 - 0.5 * acceleration_ * (duration_ - t) * (duration_ - t);
  }
  part = std::clamp(part, 0.0, 1.0);
  return q0_ + part * (q1_ - q0_);
}

ArmVector JointMotion::velocity(double t) const noexcept {
  const double ramp_time = std::min({t, ramp_, duration_ - t});
  return std::max(0.0, acceleration_ * ramp_time) * (q1_ - q0_);
}

}  // namespace tandem::safety
