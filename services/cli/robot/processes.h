// SPDX-License-Identifier: Apache-2.0
/** @file Processes and clocks of a running system, for `tandem status`. */
#pragma once

#include <nlohmann/json.hpp>

#include "services/client/client.h"

namespace tandem::cli {

/// Who moves the robot, since when, and who of them knows another one.
nlohmann::ordered_json processesJson(const Client& client);

nlohmann::ordered_json clocksJson(const std::vector<ClockOffset>& offsets);

/// Asks all hosts for their clocks, several times.
void askAll(Client& client);

/// Both, for people: `processes` and `clocks` of a status.
void printProcesses(const nlohmann::ordered_json& status);

}  // namespace tandem::cli
