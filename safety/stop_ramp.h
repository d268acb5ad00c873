// SPDX-License-Identifier: Apache-2.0
/** @file Stop ramp: simultaneous stop of all joints of one arm within its limits. */
#pragma once

#include "safety/limits.h"

namespace tandem::safety {

/** Coordinated stop: every joint slows down in the same proportion, v(t) = v0 (1 - t / t_s), so the arm stays on a
 * straight line in joint space and all joints stop at the same time.
 *
 * t_s = max_j |v0_j| / stop_deceleration_j. The limits are convex; if the end of the line would lie outside them, the
 * stop is shortened to the point at which the line meets them, with a correspondingly higher deceleration. So the arm
 * always stops within max_j |v0_j| / stop_deceleration_j, and every point of the path is inside the limits if the start
 * was (otherwise no farther out). A joint without stop_deceleration stops at once. */
class StopRamp {
 public:
  /// Starts a stop at position q (m, rad) and velocity v (m/s, rad/s). `limits` is read only during this call.
  void start(const ArmLimits& limits, const ArmVector& q, const ArmVector& v) noexcept;

  /** Advances by dt (s, not negative) and writes the setpoint and its velocity. From duration() on, q is end() exactly
   * and v is zero. */
  void step(double dt, ArmVector& q, ArmVector& v) noexcept;

  /// The ramp is at its end. True before the first start().
  bool standing() const noexcept { return elapsed_ >= duration_; }
  /// From start to standstill, s.
  double duration() const noexcept { return duration_; }
  /// Position at standstill, m, rad.
  const ArmVector& end() const noexcept { return end_; }
  /// Distance of joint j from the start to the end of the ramp, m, rad.
  double stoppingDistance(int joint) const noexcept;

 private:
  ArmVector start_;
  ArmVector velocity_;
  ArmVector end_;
  double duration_ = 0.0;
  double elapsed_ = 0.0;
};

}  // namespace tandem::safety
