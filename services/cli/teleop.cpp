// SPDX-License-Identifier: Apache-2.0
/** @file tandem teleop: becomes tandem-teleop, which alone needs what reads devices. */
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "services/cli/arguments.h"

namespace tandem::cli {
namespace {

int become(const std::vector<std::string>& words) {
  const auto program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "tandem-teleop";
  std::vector<std::string> all{program.string()};
  all.insert(all.end(), words.begin(), words.end());
  std::vector<char*> arguments;
  for (std::string& word : all)
    arguments.push_back(word.data());
  arguments.push_back(nullptr);
  execv(arguments[0], arguments.data());
  throw Failure(kFailure, program.string() + ": " + std::strerror(errno));
}

}  // namespace

void registerTeleop(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("teleop", "move the tips by hand: gamepad, SpaceMouse, keyboard, or a trace");
  command->prefix_command();
  command->allow_extras();
  command->fallthrough(false);  // what follows is not for `tandem`
  command->set_help_flag();  // --help is tandem-teleop's
  command->callback([command, &exit_code] { guarded(exit_code, [&] { return become(command->remaining()); }); });
}

}  // namespace tandem::cli
