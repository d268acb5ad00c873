// SPDX-License-Identifier: Apache-2.0
/** @file Internal state of the inverse kinematics search. */
#pragma once

#include <limits>
#include <optional>

#include "planning/inverse_kinematics.h"

namespace tandem::planning {

/** Results of one call so far. */
struct InverseKinematics::Search {
  PoseProblem problem;                                     ///< reach; with the demands that have proved necessary
  IkAnswer best;                                           ///< reached, or the nearest so far
  double least = std::numeric_limits<double>::infinity();  ///< objective of the nearest so far
  std::optional<Reach> broken;                             ///< a demand violated by joints that reach the targets
  PoseProblem nearest_problem;                             ///< of the nearest so far
  PoseSolution nearest;
  bool reached = false;
  int starts = 0, iterations = 0;
};

}  // namespace tandem::planning
