// SPDX-License-Identifier: Apache-2.0
/** @file Capabilities of robots: functions that one type has and another one lacks. Code outside `robots` and
 * `config` checks capabilities, not types. */
#pragma once

#include <cstdint>
#include <string>

#include "config/config.h"

namespace tandem::robots {

enum class Capability : std::uint8_t {
  kTips,         ///< each tip follows tasks of its own: trajectories, Cartesian commands, measured tips
  kCommonPath,   ///< the arms move a common object along a path: see Mechanism
  kComputation,  ///< inverse kinematics, feasibility, timing and clearance of trajectories: see planning/
  kStability,    ///< distance of each arm from a snap to another equilibrium: see kinematics/stability.h
};

bool has(const config::Robot& robot, Capability capability);

/// Reason why a robot lacks a capability: found, expected, and the robot's alternative. Empty: it has the capability.
std::string refusal(const config::Robot& robot, Capability capability);

}  // namespace tandem::robots
