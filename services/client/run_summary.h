// SPDX-License-Identifier: Apache-2.0
/** @file Summary of a run, for people and as JSON. */
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "config/config.h"
#include "services/client/client.h"
#include "services/dds/messages.h"

namespace tandem::client {

/// Name, phase, reason, points, time, errors of each task, interventions of the gate, limits; SI units.
nlohmann::ordered_json summaryJson(const dds::RunSummary& summary, const config::Robot& robot);

/// Planning reports the end of a run, and the summary of that run has not been received yet.
bool summaryIsDue(const Snapshot& snapshot);

/// "circle finished", "circle failed: missed 2 of 12 points ..."; one line.
std::string describeEnd(const nlohmann::ordered_json& summary);

/// The rest in several indented lines, errors in mm.
std::string describeSummary(const nlohmann::ordered_json& summary);

}  // namespace tandem::client
