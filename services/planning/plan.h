// SPDX-License-Identifier: Apache-2.0
/** @file Plan: a feasible trajectory with its joint positions. */
#pragma once

#include <string>
#include <vector>

#include "safety/dimensions.h"

namespace tandem::planning_service {

struct Plan {
  std::string trajectory;                   ///< the text that was checked
  safety::RobotVector start;                ///< joints that it was checked from, m and rad
  std::vector<safety::RobotVector> points;  ///< joints at each point
};

}  // namespace tandem::planning_service
