// SPDX-License-Identifier: Apache-2.0
/** @file Keys common to the arms of all robot types. */
#pragma once

#include <vector>

#include "config/key_table.h"

namespace tandem::config {

/// The name of an arm.
Field armName();
/// A frame in its parent.
const Mapping& poseTable();
/// velocity, approach_acceleration, slew_limit, stop_deceleration, max_step: a safety::JointLimit without its box.
std::vector<Field> motionLimits(bool angle);
/// The `control` of a robot.
const Mapping& controlTable();

}  // namespace tandem::config
