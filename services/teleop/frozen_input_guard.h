// SPDX-License-Identifier: Apache-2.0
/** @file Frozen-input guard: releases the dead-man switch of a device whose readings stay unchanged for 1.5 s while
 * they command motion (lost wireless connection). */
#pragma once

#include <vector>

namespace tandem::teleop {

/** Lets a device command motion as long as its raw numbers change now and then: a hand never holds still for long, and
 * nobody sees whether a device still speaks. Where they do not, the switch counts as let go of until it really is. */
class FrozenInputGuard {
 public:
  static constexpr double kLongest = 1.5;  ///< s that numbers may stay the same while they command motion

  /// @param raw  what the device says, unfiltered; @param moves  whether it commands motion now; @param held  its
  /// switch;
  /// @param time  s
  bool update(const std::vector<int>& raw, bool moves, bool held, double time) {
    if (raw != last_ || !moves)
      changed_ = time;
    last_ = raw;
    if (!held)
      silent_ = false;
    else if (moves && time - changed_ > kLongest)
      silent_ = true;
    return held && !silent_;
  }
  /// Whether it has been stopped, and not let go of since.
  bool silent() const { return silent_; }

 private:
  std::vector<int> last_;
  double changed_ = 0.0;
  bool silent_ = false;
};

}  // namespace tandem::teleop
