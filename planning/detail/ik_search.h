// SPDX-License-Identifier: Apache-2.0
/** @file Internal state of the inverse kinematics search. */
#pragma once

#include <limits>
#include <optional>

#include "planning/inverse_kinematics.h"

namespace tandem::planning {

/** What one call has found so far. */
struct InverseKinematics::Search {
  PoseProblem problem;                                     ///< reach; its demands are those that have proved necessary
  IkAnswer best;                                           ///< reached, or the nearest so far
  double least = std::numeric_limits<double>::infinity();  ///< objective of the nearest so far
  std::optional<Reach> broken;  ///< a demand that stood in the way of joints that reach the targets
  PoseProblem nearest_problem;  ///< of the nearest so far
  PoseSolution nearest;
  bool reached = false;
  int starts = 0, iterations = 0;
};

}  // namespace tandem::planning
