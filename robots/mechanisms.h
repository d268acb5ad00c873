// SPDX-License-Identifier: Apache-2.0
/** @file Factory of the equilibrium follower of a robot whose arms move a common object. */
#pragma once

#include <memory>

#include "config/config.h"
#include "robots/mechanism_equilibrium.h"

namespace tandem::robots {

/// The mechanism of a robot with Capability::kCommonPath, in its equilibrium at home. @param robot  outlives it
/// @throw std::invalid_argument, with the file name, for a robot without that capability or without an equilibrium at
/// home.
EquilibriumFollower makeEquilibriumFollower(const config::Robot& robot);

}  // namespace tandem::robots
