// SPDX-License-Identifier: Apache-2.0
/** @file Frozen-input guard: releases the dead-man switch of a device whose readings stay unchanged for 1.5 s while
 * they command motion (lost wireless connection). */
#pragma once

#include <vector>

namespace tandem::teleop {

/** Permits motion as long as the raw values of a device change: a hand always moves a little, and a lost connection is
 * not reported otherwise. After unchanged values, the switch is reported as released until the operator releases it. */
class FrozenInputGuard {
 public:
  static constexpr double kLongest = 1.5;  ///< s, longest time of unchanged values that command motion

  /// @param raw  unfiltered values of the device @param moves  whether they command motion now @param held  state of
  /// its switch
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
  /// Whether the guard has stopped the device, and its switch has not been released since.
  bool silent() const { return silent_; }

 private:
  std::vector<int> last_;
  double changed_ = 0.0;
  bool silent_ = false;
};

}  // namespace tandem::teleop
