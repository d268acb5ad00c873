// SPDX-License-Identifier: Apache-2.0
/** @file tandem: command line of the system. */
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdlib>
#include <iostream>

#include "services/cli/completion.h"
#include "services/cli/models/cooperative.h"
#include "services/cli/subcommand.h"
#include "services/cli/suggestion.h"
#include "services/cli/version.h"
#include "services/client/role.h"
#include "services/runtime/process.h"

namespace {

/// Refuses nan and inf as a value of any option that is a number: CLI::Range accepts nan.
void requireFiniteNumbers(CLI::App& app) {
  const CLI::Validator finite(
      [](const std::string& text) {
        return std::isfinite(std::strtod(text.c_str(), nullptr)) ? "" : "found " + text + ", expected a finite number";
      },
      "");
  for (CLI::Option* option : app.get_options()) {
    if (option->get_type_name().starts_with("FLOAT"))
      option->check(finite);
  }
  for (CLI::App* part : app.get_subcommands({}))
    requireFiniteNumbers(*part);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Tandem: cooperating continuum robots over DDS. Research software, not for clinical use.", "tandem");
  app.require_subcommand(1);
  app.set_version_flag("--version", tandem::cli::versionText());
  app.footer(
      "Start here:\n"
      "  tandem experiment table3          reproduce Table 3 of Alsaka et al. 2024 over DDS\n"
      "  tandem up laptop                  start simulator, control and planning in real time\n"
      "  tandem robot run circle           ... and in another terminal: move\n"
      "  tandem teleop --enable            ... or teleoperate the tips\n"
      "  tandem status                     ... and watch\n"
      "Every subcommand has --help.");
  int exit_code = tandem::cli::kOk;
  using namespace tandem::cli;
  tandem::client::addRoleOption(app);
  tandem::runtime::addPlaceOptions(app);
  app.fallthrough();
  for (Register* part :
       {registerUp,         registerExperiment,  registerRobot,   registerStatus,    registerTopics,
        registerDoctor,     registerFk,          registerSolve,   registerStability, registerWorkspace,
        registerPlan,       registerValidate,    registerSchema,  registerCan,       registerHome,
        registerJog,        registerSecurity,    registerUnits,   registerRecord,    registerInfo,
        registerReplay,     registerExport,      registerPlot,    registerConsole,   registerTeleop,
        registerMonteCarlo, registerCooperative, registerPresets, registerNew,       registerCompletion}) {
    part(app, exit_code);
  }
  requireFiniteNumbers(app);
  if (argc > 1 && std::string(argv[1]) == kComplete) {
    for (const std::string& word : completions(app, {argv + 2, argv + argc}))
      std::cout << word << '\n';
    return kOk;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error) == 0 ? kOk : kUsage;
    const std::string meant = code == kOk ? "" : suggestion(app, {argv + 1, argv + argc});
    if (!meant.empty())
      std::cerr << meant << '\n';
    return code;
  }
  return exit_code;
}
