// SPDX-License-Identifier: Apache-2.0
/** @file What `tandem plan` prints of a check and of a rehearsal, for people and as JSON. */
#pragma once

#include <nlohmann/json.hpp>
#include <string_view>

#include "planning/feasibility.h"
#include "planning/rehearsal.h"

namespace tandem::cli {

nlohmann::ordered_json reportJson(const planning::FeasibilityReport& report);
void print(const planning::FeasibilityReport& report);

nlohmann::ordered_json rehearsalJson(const planning::Rehearsal& rehearsal);
/// @param how  "with the planned posture", ...
void print(const planning::Rehearsal& rehearsal, std::string_view method, const char* how);

}  // namespace tandem::cli
