// SPDX-License-Identifier: Apache-2.0
/** @file Point-to-point motion of one arm in joint space, for move_jp and home. */
#pragma once

#include "safety/limits.h"

namespace tandem::safety {

/// Speeds and accelerations of move_jp for joints without limits: m/s, rad/s, m/s^2, rad/s^2.
inline constexpr double kMoveTranslationVelocity = 0.01;
inline constexpr double kMoveRotationVelocity = 0.5;
inline constexpr double kMoveTranslationAcceleration = 0.02;
inline constexpr double kMoveRotationAcceleration = 1.0;

/// Largest speed of joint j in a motion, m/s or rad/s: its limit, or the default above without a limit.
double moveVelocity(const ArmLimits& limits, int joint) noexcept;

/// Acceleration and deceleration of joint j, m/s^2 or rad/s^2: the smallest of the default, slew_limit and
/// stop_deceleration.
double moveAcceleration(const ArmLimits& limits, int joint) noexcept;

/** Synchronised trapezoidal motion from q0 to q1, from standstill to standstill. All joints start and end together, so
 * the arm moves along a straight line in joint space; limits are convex, hence it stays inside them if both ends are
 * inside.
 *
 * Speeds are those of the limits, accelerations the smallest of the default, slew_limit and stop_deceleration; joints
 * without a speed limit use the defaults above. */
class JointMotion {
 public:
  /// Empty motion of duration 0.
  JointMotion() = default;
  /// @param q0, q1 m, rad, of the size of the arm.
  JointMotion(const ArmLimits& limits, const ArmVector& q0, const ArmVector& q1) noexcept;

  /// Time from start to end, s; 0 if q0 equals q1.
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
  double ramp_ = 0.0;          ///< time of acceleration, and of deceleration, s
  double duration_ = 0.0;
};

}  // namespace tandem::safety
