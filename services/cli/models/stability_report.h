// SPDX-License-Identifier: Apache-2.0
/** @file Stability report of one joint vector, as text and as JSON. */
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "config/config.h"
#include "kinematics/stability.h"

namespace tandem::cli {

/** At one joint vector, from a cold start. */
struct StabilityReport {
  std::string arm;
  Eigen::VectorXd joints;  ///< m, rad
  std::string status;      ///< "ok", "unstable: ...", or why there is no answer
  kinematics::Branch branch;
  kinematics::Stability stability;
  std::vector<kinematics::EquilibriumInfo> equilibria;  ///< by energy
  int here = -1;                                        ///< which of them the branch is on
};

StabilityReport reportStability(const config::Arm& arm, const Eigen::VectorXd& joints);

/// SI; angles in rad.
nlohmann::ordered_json toJson(const StabilityReport& report);

/// Lines for people, mm and degrees.
std::string toText(const StabilityReport& report);

}  // namespace tandem::cli
