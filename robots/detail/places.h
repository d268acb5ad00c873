// SPDX-License-Identifier: Apache-2.0
/** @file Points along a catheter, for display. */
#pragma once

#include <vector>

#include "kinematics/cosserat/rod.h"

namespace tandem::robots {

/// Places of cross-sections, then that of the tool tip; m, robot base frame.
inline std::vector<Eigen::Vector3d> placesOf(const std::vector<kinematics::cosserat::RodPoint>& points,
                                             const Eigen::Vector3d& tip) {
  std::vector<Eigen::Vector3d> places;
  for (const auto& point : points)
    places.push_back(point.pose.translation());
  places.push_back(tip);
  return places;
}

}  // namespace tandem::robots
