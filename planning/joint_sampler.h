// SPDX-License-Identifier: Apache-2.0
/** @file Random sampling of joint vectors inside the limits of a concentric tube arm. */
#pragma once

#include <random>
#include <vector>

#include "safety/limits.h"

namespace tandem::planning {

/** Samples joints inside the boxes and the coupled rows of makeTubeLimits(): translations one after another from tube 1
 * outwards, each inside the interval that leaves room for the tubes that follow. */
class JointSampler {
 public:
  explicit JointSampler(const safety::ArmLimits& limits);

  /// Uniform in each interval; rotations without limits from -pi to pi.
  safety::ArmVector random(std::mt19937_64& engine) const;
  /// Translations in the middle of their intervals, rotations as in q and inside their boxes.
  safety::ArmVector middle(const safety::ArmVector& q) const;
  /// q projected inside: each joint in turn to the nearest value that leaves room for the others.
  safety::ArmVector inside(const safety::ArmVector& q) const;
  /// Whether no rotation has a limit.
  bool turnsFreely() const;

 private:
  safety::Interval room(int tube, double before) const;

  const safety::ArmLimits& limits_;
  std::vector<safety::Interval> reach_;   ///< of beta_i, with all outer tubes inside their limits
  std::vector<safety::Interval> offset_;  ///< of beta_i - beta_{i-1}
};

}  // namespace tandem::planning
