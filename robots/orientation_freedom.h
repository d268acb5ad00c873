// SPDX-License-Identifier: Apache-2.0
/** @file Whether the arms of a robot can follow orientations of their tips beside the positions. */
#pragma once

#include <string>

#include "planning/task_freedom.h"
#include "planning/teleoperation/spaces.h"
#include "robots/robot_model.h"

namespace tandem::robots {

/// "ignored", "axis" or "full", as in deployments.
std::string nameOf(planning::teleoperation::TipOrientation orientation);

/// Freedom that the position of an arm's tip leaves to its orientation, at home. @param model  with Capability::kTips
planning::TaskFreedom orientationFreedom(const config::Robot& robot,
                                         const RobotModel& model,
                                         int arm,
                                         planning::teleoperation::TipOrientation orientation);

/// Why operators and CRTK clients cannot command this orientation: "found full with arm_a, whose joints turn its tip
/// with rank 1 behind its position (at home), expected rank 3". Empty: they can. @param orientation  kAxis or kFull
std::string orientationRefusal(const config::Robot& robot,
                               const RobotModel& model,
                               planning::teleoperation::TipOrientation orientation);

/// @throw config::Error with that reason, for the key teleoperation.orientation of the deployment
void requireOrientation(const config::Deployment& deployment, const config::Robot& robot);

}  // namespace tandem::robots
