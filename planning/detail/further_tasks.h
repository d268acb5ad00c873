// SPDX-License-Identifier: Apache-2.0
/** @file Desired places of the further tasks of a trajectory. */
#pragma once

#include <vector>

#include "planning/trajectory.h"

namespace tandem::planning {

/// Sets TrajectoryPoint::further of sampled points, without the start.
void setFurther(const TrajectorySpec& spec, const TrajectoryPoint& start, std::vector<TrajectoryPoint>& points);

/// Desired values of the further tasks at the start. @param measured  poses of the tips there
TrajectoryPoint wantedAtStart(const TrajectorySpec& spec, const TrajectoryPoint& measured);

}  // namespace tandem::planning
