// SPDX-License-Identifier: Apache-2.0
/** @file Keys common to the arms of all robot types. */
#pragma once

#include <vector>

#include "config/key_table.h"

namespace tandem::config {

/// Name of an arm.
Field armName();
/// Pose of a frame in its parent frame.
const Mapping& poseTable();
/// velocity, approach_acceleration, slew_limit, stop_deceleration, max_step: a safety::JointLimit without its box.
std::vector<Field> motionLimits(bool angle);
/// Table of the `control` of a robot.
const Mapping& controlTable();

}  // namespace tandem::config
