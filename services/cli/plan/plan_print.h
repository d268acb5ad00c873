// SPDX-License-Identifier: Apache-2.0
/** @file What planning found about a trajectory, for people and programs. */
#pragma once

#include <iosfwd>
#include <nlohmann/json.hpp>

#include "services/dds/messages.h"

namespace tandem::cli {

nlohmann::ordered_json reportJson(const dds::TrajectoryReport& report);
void print(const dds::TrajectoryReport& report, std::ostream& out);

nlohmann::ordered_json rehearsalJson(const dds::RehearsalReport& rehearsal);
/// @param how  "with the planned posture", ...
void print(const dds::RehearsalReport& rehearsal, const std::string& method, const char* how, std::ostream& out);

}  // namespace tandem::cli
