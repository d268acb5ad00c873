// SPDX-License-Identifier: Apache-2.0
/** @file Plan: a feasible trajectory with its joint positions. */
#pragma once

#include <string>
#include <vector>

#include "safety/dimensions.h"

namespace tandem::planning_service {

struct Plan {
  std::string trajectory;                   ///< text of the checked trajectory
  safety::RobotVector start;                ///< start configuration of the check, m and rad
  std::vector<safety::RobotVector> points;  ///< joints at each point, m and rad
};

}  // namespace tandem::planning_service
