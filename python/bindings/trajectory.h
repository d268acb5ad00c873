// SPDX-License-Identifier: Apache-2.0
/** @file Python class Trajectory. */
#pragma once

#include <string>

#include "planning/trajectory.h"

namespace tandem::python {

/** A trajectory file or text. */
struct Trajectory {
  planning::TrajectorySpec spec;
};

}  // namespace tandem::python
