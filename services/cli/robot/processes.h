// SPDX-License-Identifier: Apache-2.0
/** @file Processes and clocks of a running system, for `tandem status`. */
#pragma once

#include <nlohmann/json.hpp>

#include "services/client/client.h"

namespace tandem::cli {

/// Who moves the robot, since when, and who of them knows another one.
nlohmann::ordered_json processesJson(const client::Client& client);

/// What each service last published in topic `diagnostics`: level (0 ok, 1 warn, 2 error, 3 stale), message, values.
nlohmann::ordered_json diagnosticsJson(const client::Snapshot& snapshot);

nlohmann::ordered_json clocksJson(const std::vector<client::ClockOffset>& offsets);

/// Asks all hosts for their clocks, several times.
void askAll(client::Client& client);

/// Both, for people: `processes` and `clocks` of a status.
void printProcesses(const nlohmann::ordered_json& status);

}  // namespace tandem::cli
