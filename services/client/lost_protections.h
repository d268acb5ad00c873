// SPDX-License-Identifier: Apache-2.0
/** @file Protections that the drives of a robot do not have, for the command line. */
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "config/config.h"
#include "services/dds/messages.h"

namespace tandem::client {

/// [{"lost": "command_deadline (1400:05)", "joints": "arm_a beta_1, arm_a beta_2"}], one entry for each set of lost
/// protections; "joints" is "all" if all drives of the robot have lost the same.
nlohmann::ordered_json lostProtections(const config::Robot& robot, const dds::HalStatus& hal);

/// The same as lines of text that begin with `indent`.
std::string describeLost(const nlohmann::ordered_json& lost, const std::string& indent);

}  // namespace tandem::client
