// SPDX-License-Identifier: Apache-2.0
/** @file Feasible translation range of each tube, given the translation of the next inner tube. */
#pragma once

#include <vector>

#include "safety/limits.h"

namespace tandem::config {

/** Boxes and rows of beta_1..beta_n (equation (1) of Alsaka et al. 2024 with its margins and the travel of the stages),
 * arranged for a choice of the translations one after another from tube 1 outwards: every choice inside the interval
 * leaves a feasible range for the next tubes. */
class TranslationRange {
 public:
  struct Interval {
    double lower, upper;  ///< m
  };

  explicit TranslationRange(const safety::ArmLimits& limits);

  int tubes() const { return static_cast<int>(range_.size()); }
  /// Range of tube i (from 0) for tube i - 1 at `before` (m; ignored for tube 0).
  Interval of(int tube, double before) const;

 private:
  std::vector<Interval> range_;   ///< of beta_i, with all outer tubes inside their limits
  std::vector<Interval> offset_;  ///< of beta_i - beta_{i-1}
};

}  // namespace tandem::config
