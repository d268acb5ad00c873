// SPDX-License-Identifier: Apache-2.0
/** @file What the subcommands of `tandem cooperative` share. */
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "config/cooperative.h"

namespace tandem::cli {

/// A cooperative robot by file or preset. @throw config::Error
config::CooperativeRobot cooperativeRobot(const std::string& name);

void registerCooperative(CLI::App& app, int& exit_code);
/// `tandem cooperative co-manipulate` and `target-assist`.
void registerTracks(CLI::App& app, int& exit_code);
/// `tandem cooperative mobility` and `reach`.
void registerMobility(CLI::App& app, int& exit_code);
void registerReach(CLI::App& app, int& exit_code);

}  // namespace tandem::cli
