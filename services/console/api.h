// SPDX-License-Identifier: Apache-2.0
/** @file JSON descriptions of robot, deployment and trajectories; SI units. */
#pragma once

#include <nlohmann/json.hpp>

#include "config/config.h"
#include "services/dds/roles.h"

namespace tandem::console {

/// The robot: deployment, arms with tubes, limits and base, grasped object, port, forbidden regions, methods with
/// their parameters, budgets, colours.
nlohmann::ordered_json describeRobot(const config::Deployment& deployment, const config::Robot& robot);

/// The trajectories among the presets, or the paths of a common object: name, description, and the text that
/// planning/request takes. Skips those that cannot be loaded, with a warning in the log.
nlohmann::ordered_json describeTrajectories(const config::Robot& robot);

}  // namespace tandem::console
