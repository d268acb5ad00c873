// SPDX-License-Identifier: Apache-2.0
/** @file Construction of the mechanism of a robot whose arms move one thing together. */
#pragma once

#include <memory>

#include "config/config.h"
#include "robots/mechanism_rest.h"

namespace tandem::robots {

/// The object that catheters hold, or the target that one of them pushes.
/// @param robot  outlives the mechanism  @throw std::invalid_argument for a robot of concentric tubes.
std::unique_ptr<Mechanism> makeMechanism(const config::Robot& robot);

/// The same at rest at home, to be followed. @throw std::invalid_argument likewise, and where there is no rest at home:
/// names the file.
RestFollower makeRestFollower(const config::Robot& robot);

}  // namespace tandem::robots
