// SPDX-License-Identifier: Apache-2.0
/** @file tandem cooperative: catheters that hold an object together or push one another. */
#include "services/cli/cooperative.h"

#include "config/config.h"
#include "services/cli/arguments.h"

namespace tandem::cli {

config::CooperativeRobot cooperativeRobot(const std::string& name) {
  return config::loadCooperative(config::findFile(name, "cooperative"));
}

void registerCooperative(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("cooperative", "catheters that hold an object together, or of which one pushes the other");
  command->require_subcommand(1);
  registerTracks(*command, exit_code);
  registerMobility(*command, exit_code);
  registerReach(*command, exit_code);
}

}  // namespace tandem::cli
