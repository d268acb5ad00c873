// SPDX-License-Identifier: Apache-2.0
/** @file Positions after power on that an operator has to confirm (jump_tolerance) or to measure (`reference:
 * measured`), for the command line. */
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "config/config.h"
#include "services/dds/messages.h"

namespace tandem::client {

/// [{"joint": "arm_a beta_1", "measured": 0.0031, "expected": 0.001, "tolerance": 0.0005, "text": "..."}], m or rad;
/// "expected" is null where nothing is known, and "text" says why; "measured" is null where somebody has to measure it.
/// @param state  of the same robot as `hal`
nlohmann::ordered_json unconfirmedPositions(const config::Robot& robot,
                                            const dds::HalStatus& hal,
                                            const dds::ActuationState& state);

/// The same as lines of text that begin with `indent`.
std::string describeUnconfirmed(const nlohmann::ordered_json& unconfirmed, const std::string& indent);

}  // namespace tandem::client
