// SPDX-License-Identifier: Apache-2.0
/** @file Python class Trajectory. */
#pragma once

#include <string>

#include "config/config.h"
#include "planning/trajectory.h"

namespace tandem::python {

/** A trajectory file or text. */
struct Trajectory {
  planning::TrajectorySpec spec;

  /// With the indices of its arms. @throw value_error for arms that the robot does not have
  planning::TrajectorySpec of(const config::Robot& robot) const;
};

}  // namespace tandem::python
