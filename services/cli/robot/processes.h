// SPDX-License-Identifier: Apache-2.0
/** @file Processes and clocks of a running system, for `tandem status`. */
#pragma once

#include <nlohmann/json.hpp>

#include "services/client/client.h"

namespace tandem::cli {

/// Processes that move the robot, their start times, and which of them have discovered each other.
nlohmann::ordered_json processesJson(const client::Client& client);

/// Last diagnostics of each service: level (0 ok, 1 warn, 2 error, 3 stale), message, values.
nlohmann::ordered_json diagnosticsJson(const client::Snapshot& snapshot);

nlohmann::ordered_json clocksJson(const std::vector<client::ClockOffset>& offsets);

/// Requests the clock of every host, several times.
void requestAll(client::Client& client);

/// Text output of `processes` and `clocks` of a status.
void printProcesses(const nlohmann::ordered_json& status);

}  // namespace tandem::cli
