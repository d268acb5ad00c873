// SPDX-License-Identifier: Apache-2.0
/** @file tandem teleop: replaces itself by tandem-teleop, which links the device libraries. */
#include "services/cli/deployment/sibling.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {

void registerTeleop(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("teleop", "teleoperate the tips: gamepad, SpaceMouse, keyboard, or a trace");
  command->prefix_command();
  command->allow_extras();
  command->fallthrough(false);  // further arguments are tandem-teleop's
  command->set_help_flag();     // so is --help
  command->callback(
      [command, &exit_code] { guarded(exit_code, [&]() -> int { become("tandem-teleop", command->remaining()); }); });
}

}  // namespace tandem::cli
