// SPDX-License-Identifier: Apache-2.0
/** @file Helpers shared by the subcommands of `tandem cooperative`. */
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>

#include "config/cooperative.h"

namespace tandem::cli {

/// A cooperative robot by file or preset. @throw config::Error
config::CooperativeRobot cooperativeRobot(const std::string& name);

/** Robot with a grasped object, and values that replace those of its file. */
struct GraspOptions {
  std::string robot = "ablation-pair", contact, load;
  std::optional<double> squeeze;
};
void addGraspOptions(CLI::App& command, GraspOptions& options);
/// A robot with an object. @throw config::Error, or Failure(kUsage) where it has none or the load is no force
config::CooperativeRobot graspingRobot(const GraspOptions& options);

/// Actuation that is constant under loads: "displacement of the pull wires", or that of each arm if they differ.
std::string actuationOf(const config::CooperativeRobot& robot);

void registerCooperative(CLI::App& app, int& exit_code);
/// `tandem cooperative co-manipulate` and `target-assist`.
void registerTracks(CLI::App& app, int& exit_code);
/// `tandem cooperative mobility`, `payload` and `reach`.
void registerMobility(CLI::App& app, int& exit_code);
void registerPayload(CLI::App& app, int& exit_code);
void registerReach(CLI::App& app, int& exit_code);

}  // namespace tandem::cli
