// SPDX-License-Identifier: Apache-2.0
/** @file The table of tandem status --follow on a terminal. */
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace tandem::cli {

/** Estimates how long a trajectory still takes, from the points that it has passed. */
class TimeLeft {
 public:
  /// Takes a status. @param json  as `tandem status --json` prints it  @param now  s, of any clock
  void see(const nlohmann::ordered_json& json, double now);
  /// "about 12 s left"; empty where nothing runs, and before the second point.
  std::string text() const;

 private:
  std::uint64_t id_ = 0;
  int first_point_ = 0, point_ = 0, points_ = 0;
  double began_ = 0.0, passed_ = 0.0;  ///< s, of the first point seen and of the last
  bool follows_ = false;
};

/// Table of the arms and what matters now, for people; as wide as 80 columns.
/// @param json  as `tandem status --json` prints it  @param colours  with ANSI colours
std::string statusTable(const nlohmann::ordered_json& json, const std::string& time_left, bool colours);

}  // namespace tandem::cli
