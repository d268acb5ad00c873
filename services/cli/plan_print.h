// SPDX-License-Identifier: Apache-2.0
/** @file What planning found about a trajectory, for people and programs. */
#pragma once

#include <iosfwd>
#include <nlohmann/json.hpp>

#include "services/dds/messages.h"

namespace tandem::cli {

nlohmann::ordered_json reportJson(const dds::TrajectoryReport& report);
void print(const dds::TrajectoryReport& report, std::ostream& out);

}  // namespace tandem::cli
