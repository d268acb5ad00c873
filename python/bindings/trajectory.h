// SPDX-License-Identifier: Apache-2.0
/** @file Trajectory as the Python module has it. */
#pragma once

#include <string>

#include "planning/trajectory.h"

namespace tandem::python {

/** A trajectory file or text. */
struct Trajectory {
  planning::TrajectorySpec spec;
};

}  // namespace tandem::python
