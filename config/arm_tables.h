// SPDX-License-Identifier: Apache-2.0
/** @file Keys that all kinds of robots have in common. */
#pragma once

#include <vector>

#include "config/key_table.h"

namespace tandem::config {

/// The name of an arm.
Field armName();
/// A frame in its parent.
const Mapping& poseTable();
/// Largest speed of a joint.
Field speedLimit(Quantity quantity);
/// approach_acceleration, slew_limit, stop_deceleration.
std::vector<Field> accelerationLimits(Quantity quantity, double stop_default);
Field stepLimit(Quantity quantity);
/// The `control` of a robot.
const Mapping& controlTable();

}  // namespace tandem::config
