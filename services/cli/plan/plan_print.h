// SPDX-License-Identifier: Apache-2.0
/** @file Output of planning results as text and JSON. */
#pragma once

#include <iosfwd>
#include <nlohmann/json.hpp>
#include <optional>

#include "planning/leader_path.h"
#include "planning/task_freedom.h"
#include "services/dds/messages.h"

namespace tandem::cli {

nlohmann::ordered_json reportJson(const dds::TrajectoryReport& report);
void print(const dds::TrajectoryReport& report, std::ostream& out);

/// Freedom of the tasks of a trajectory.
nlohmann::ordered_json freedomJson(const std::vector<planning::TaskFreedom>& freedom,
                                   const std::vector<std::string>& arms);
void print(const std::vector<planning::TaskFreedom>& freedom, const std::vector<std::string>& arms, std::ostream& out);

/** How far a shaft leaves the path of its leader. */
struct LeaderPrediction {
  planning::LeaderDeviation planned;  ///< with the planned joints
  std::optional<double> rehearsed;    ///< in the rehearsal with them, m; at up to 128 times
};
nlohmann::ordered_json leaderJson(const LeaderPrediction& leader);
void print(const LeaderPrediction& leader, std::ostream& out);

nlohmann::ordered_json rehearsalJson(const dds::RehearsalReport& rehearsal);
/// @param how  "with the planned posture", ...
void print(const dds::RehearsalReport& rehearsal, const std::string& method, const char* how, std::ostream& out);

}  // namespace tandem::cli
