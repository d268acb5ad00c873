// SPDX-License-Identifier: Apache-2.0
/** @file Construction of the simulated arms of a robot. */
#pragma once

#include "config/config.h"
#include "sim/plant_tips.h"

namespace tandem::robots {

/// Simulated arms of a robot with Capability::kTips, with the errors of a plant.
/// @throw std::invalid_argument as RobotType::makeModel() and sim::PlantTips do, and for errors of tubes that the robot
/// does not have.
sim::PlantTips makePlantTips(const config::Robot& robot, const sim::PlantOptions& options);

}  // namespace tandem::robots
