// SPDX-License-Identifier: Apache-2.0
/** @file Interlock on the distance between the bodies of arms, and to the port. */
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "safety/faults.h"

namespace tandem::safety {

/** A measured smallest distance; below zero bodies overlap by that much. */
struct ClearanceSample {
  double distance = std::numeric_limits<double>::infinity();  ///< m; NaN: a model had no solution
  std::int64_t stamp = 0;                                     ///< when it was measured, ns; 0: never
};

/** Stops arms that come closer than a least distance d. With c the distance and w the widest one since the last stop
 * (infinity at first, and wherever c >= d), it stops moving arms if
 *
 *   c < d   and   c < w - 0.05 mm,
 *
 * so arms that are too close can be moved apart, and any approach stops them again. Also stops them if the distance is
 * unknown or old. Nothing allocates, locks or throws. */
class ClearanceInterlock {
 public:
  static constexpr double kCloser = 50e-6;  ///< m

  /// @param least  d, m; minus infinity: no interlock  @param budget  largest age of a distance, s
  ClearanceInterlock(double least, double budget) : least_(least), budget_(budget) {}

  bool used() const noexcept { return least_ > -std::numeric_limits<double>::infinity(); }

  /// @param moving  whether an arm may move; otherwise nothing is judged. @return a fault, or none
  FaultRecord judge(const ClearanceSample& sample, bool moving, std::int64_t now) noexcept {
    if (!used())
      return {};
    const bool known = sample.stamp != 0 && sample.distance == sample.distance;
    if (known && sample.distance >= least_)
      widest_ = std::numeric_limits<double>::infinity();
    if (!moving) {
      waits_since_ = 0;
      return {};
    }
    waits_since_ = waits_since_ == 0 ? now : waits_since_;
    const double age = 1e-9 * static_cast<double>(now - std::max(sample.stamp, waits_since_));
    if (age > budget_)
      return {bit(Fault::kClearance), FaultCause::kNoAnswer, idl::kNoJoint, age, budget_};
    if (sample.stamp == 0)
      return {};
    if (!known)
      return {bit(Fault::kClearance), FaultCause::kModel};
    if (sample.distance < least_ && sample.distance < widest_ - kCloser) {
      widest_ = sample.distance;
      return {bit(Fault::kClearance), FaultCause::kUnspecified, idl::kNoJoint, sample.distance, least_};
    }
    widest_ = std::max(widest_, sample.distance);
    return {};
  }

 private:
  double least_, budget_;
  double widest_ = std::numeric_limits<double>::infinity();
  std::int64_t waits_since_ = 0;  ///< ns, for a first distance; 0: no arm may move
};

}  // namespace tandem::safety
