// SPDX-License-Identifier: Apache-2.0
/** @file Stop ramp: simultaneous stop of all axes of one arm within its limits. */
#pragma once

#include "safety/limits.h"

namespace tandem::safety {

/** Coordinated stop: every axis slows down in the same proportion, v(t) = v0 (1 - t / t_s), so the arm stays on a
 * straight line in joint space and all axes stand at the same time.
 *
 * t_s = max_j |v0_j| / stop_deceleration_j. The limits are convex; where the end of the line would lie outside them,
 * the stop is shortened to the point at which the line meets them, with a correspondingly higher deceleration. So the
 * arm stands within max_j |v0_j| / stop_deceleration_j in every case, and every point on the way is inside the limits
 * where the start was (no farther out where it was not). A joint without stop_deceleration stops at once. */
class StopRamp {
 public:
  /// Begins a stop at position q (m, rad) and velocity v (m/s, rad/s). `limits` is read only during this call.
  void start(const ArmLimits& limits, const ArmVector& q, const ArmVector& v) noexcept;

  /** Goes on by dt (s, not negative) and writes where the arm shall be and how fast. From duration() on, q is end()
   * exactly and v is zero. */
  void step(double dt, ArmVector& q, ArmVector& v) noexcept;

  /// The arm stands, by this ramp. True before the first start().
  bool standing() const noexcept { return elapsed_ >= duration_; }
  /// From start to standstill, s.
  double duration() const noexcept { return duration_; }
  /// Where the arm comes to stand, m, rad.
  const ArmVector& end() const noexcept { return end_; }
  /// How far joint j goes from the start of the ramp, m, rad.
  double stoppingDistance(int joint) const noexcept;

 private:
  ArmVector start_;
  ArmVector velocity_;
  ArmVector end_;
  double duration_ = 0.0;
  double elapsed_ = 0.0;
};

}  // namespace tandem::safety
