// SPDX-License-Identifier: Apache-2.0
/** @file Loader of robot files that accepts concentric tubes only. */
#pragma once

#include <string>

#include "config/config.h"

namespace tandem::config {

/// Loads the robot of a deployment. @param why reason why catheters are not supported, as text
/// @throw Error as loadRobot() does, and for catheters, at the deployment's `robot`.
Robot loadTubes(const Deployment& deployment, const std::string& why);

}  // namespace tandem::config
