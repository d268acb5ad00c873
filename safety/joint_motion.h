// SPDX-License-Identifier: Apache-2.0
/** @file Point-to-point motion of one arm in joint space, for move_jp and home. */
#pragma once

#include "safety/limits.h"

namespace tandem::safety {

/// Speeds and accelerations of move_jp where the limits leave them free: m/s, rad/s, m/s^2, rad/s^2.
inline constexpr double kMoveTranslationVelocity = 0.01;
inline constexpr double kMoveRotationVelocity = 0.5;
inline constexpr double kMoveTranslationAcceleration = 0.02;
inline constexpr double kMoveRotationAcceleration = 1.0;

/// How fast a motion moves joint j at most, m/s or rad/s: as the limits say, or the default above where they are free.
double moveVelocity(const ArmLimits& limits, int joint) noexcept;

/// How fast it speeds up and slows down, m/s^2 or rad/s^2: the smallest of the default, slew_limit and
/// stop_deceleration.
double moveAcceleration(const ArmLimits& limits, int joint) noexcept;

/** Synchronised trapezoidal motion from q0 to q1, from rest to rest. All joints start and end together, so the arm
 * moves along a straight line in joint space; limits are convex, hence it stays inside them if both ends are inside.
 *
 * Speeds are those of the limits, accelerations the smaller of the default, slew_limit and stop_deceleration; joints
 * without a speed limit take the defaults above. The first half of the joints are translations. */
class JointMotion {
 public:
  /// Stands at nothing; duration 0.
  JointMotion() = default;
  /// @param q0, q1 m, rad, of the size of the arm.
  JointMotion(const ArmLimits& limits, const ArmVector& q0, const ArmVector& q1) noexcept;

  /// From start to end, s; 0 where q0 equals q1.
  double duration() const noexcept { return duration_; }
  bool finished(double t) const noexcept { return t >= duration_; }
  /// Position t seconds after the start, m, rad; q1 exactly from duration() on, q0 before the start.
  ArmVector position(double t) const noexcept;
  /// Velocity t seconds after the start, m/s, rad/s; zero outside [0, duration()].
  ArmVector velocity(double t) const noexcept;
  const ArmVector& goal() const noexcept { return q1_; }

 private:
  ArmVector q0_;
  ArmVector q1_;
  double acceleration_ = 0.0;  ///< of the path parameter in [0, 1], 1/s^2
  double ramp_ = 0.0;          ///< time of speeding up, and of slowing down, s
  double duration_ = 0.0;
};

}  // namespace tandem::safety
