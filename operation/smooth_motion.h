// SPDX-License-Identifier: Apache-2.0
/** @file Motion toward a goal that may change at any time: bounded speed and acceleration, no overshoot. */
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace tandem::operation {

/** One step toward a goal along the straight line, with bounded acceleration and deceleration.
 * @param way  vector to the goal; @param velocity  of the step before; @param speed  largest one, per coordinate
 * @return the velocity of the next `dt` seconds; it never leads beyond the goal. */
template <class Vector>
Vector smoothVelocity(const Vector& displacement,
                      const Vector& velocity,
                      const Vector& speed,
                      const Vector& acceleration,
                      double dt) noexcept {
  // Fraction of the distance per second, limited by the slowest coordinate with its braking distance.
  double rate = 1.0 / dt;
  for (Eigen::Index i = 0; i < displacement.size(); ++i) {
    const double distance = std::abs(displacement[i]);
    if (distance == 0.0)
      continue;
    rate = std::min(rate, speed[i] / distance);
    // With steps of dt, v = sqrt((a dt / 2)^2 + 2 a d) - a dt / 2 is the largest speed with braking distance d.
    const double half = 0.5 * acceleration[i] * dt;
    rate = std::min(rate, (std::sqrt(half * half + 2.0 * acceleration[i] * distance) - half) / distance);
  }
  Vector next = displacement;
  for (Eigen::Index i = 0; i < displacement.size(); ++i) {
    const double change = acceleration[i] * dt;
    next[i] = velocity[i] + std::clamp(rate * displacement[i] - velocity[i], -change, change);
    // The last step ends at the goal.
    if (displacement[i] == 0.0 ? next[i] * velocity[i] <= 0.0
                               : next[i] * displacement[i] > 0.0 && std::abs(next[i]) * dt > std::abs(displacement[i]))
      next[i] = displacement[i] / dt;
  }
  return next;
}

/// One step of a velocity toward another one.
template <class Vector>
Vector rampedVelocity(const Vector& wanted, const Vector& velocity, const Vector& acceleration, double dt) noexcept {
  Vector next = wanted;
  for (Eigen::Index i = 0; i < wanted.size(); ++i) {
    const double change = acceleration[i] * dt;
    next[i] = velocity[i] + std::clamp(wanted[i] - velocity[i], -change, change);
  }
  return next;
}

}  // namespace tandem::operation
