// SPDX-License-Identifier: Apache-2.0
/** @file tandem: command line of the system. */
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <regex>
#include <sstream>
#include <string>

#include "services/cli/command_table.h"
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

/// Words for shells and scripts in place of a command. @return whether `words` begins with one of them
bool answerHidden(const CLI::App& app, const std::vector<std::string>& words) {
  using namespace tandem::cli;
  std::vector<std::string> lines;
  if (!words.empty() && words.front() == kComplete)
    lines = completions(app, {words.begin() + 1, words.end()});
  else if (!words.empty() && words.front() == kCommands)
    lines = commandsOf(app);
  else
    return false;
  for (const std::string& line : lines)
    std::cout << line << '\n';
  return true;
}

/// CLI11's messages about values in the form of all others: place, found, expected.
std::string foundAndExpected(const std::string& text) {
  static const std::regex choice(R"(([^\s:]+): (.*) not in \{(.*)\})");
  static const std::regex range(R"(([^\s:]+): Value (.*) not in range (\S+) to (\S+))");
  return std::regex_replace(std::regex_replace(text, choice, "$1: found '$2', expected one of $3"), range,
                            "$1: found $2, expected a number from $3 to $4");
}

/// Prints the requested help, or the error of the command line. @return exit code
int refuseLine(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& words) {
  using namespace tandem::cli;
  std::ostringstream out, err;
  const bool asked = app.exit(error, out, err) == 0;
  std::cout << out.str();
  if (asked)
    return kOk;
  std::string text = foundAndExpected(err.str());
  const std::string meant = suggestion(app, words);
  text += meant.empty() ? "" : meant + '\n';
  text.resize(text.find_last_not_of('\n') + 1);
  tandem::client::refuse(kUsage, text);
  return kUsage;
}

void addCommands(CLI::App& app, int& exit_code) {
  using namespace tandem::cli;
  tandem::client::addRoleOption(app);
  tandem::runtime::addPlaceOptions(app);
  app.fallthrough();
  for (Register* part :
       {registerUp,         registerExperiment,  registerRobot,     registerStatus,    registerTopics,
        registerDoctor,     registerFk,          registerSolve,     registerStability, registerWorkspace,
        registerPlan,       registerValidate,    registerSchema,    registerCan,       registerHome,
        registerJog,        registerSecurity,    registerUnits,     registerRecord,    registerInfo,
        registerReplay,     registerExport,      registerPlot,      registerConsole,   registerTeleop,
        registerMonteCarlo, registerCooperative, registerPresets,   registerNew,       registerCompletion,
        registerShow,       registerConformance, registerCommission}) {
    part(app, exit_code);
  }
  requireFiniteNumbers(app);
  completeCommands(app);
  app.footer(
      "Start here:\n"
      "  tandem experiment table3          reproduce Table 3 of Alsaka et al. 2024 over DDS\n"
      "  tandem up laptop                  start simulator, control and planning in real time\n"
      "  tandem robot run circle           ... and in another terminal: move\n"
      "  tandem teleop --enable            ... or teleoperate the tips\n"
      "  tandem status                     ... and watch\n"
      "Every subcommand has --help.");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Tandem: cooperating continuum robots over DDS. Research software, not for clinical use.", "tandem");
  app.require_subcommand(1);
  app.set_version_flag("--version", tandem::cli::versionText());
  int exit_code = tandem::cli::kOk;
  using namespace tandem::cli;
  addCommands(app, exit_code);
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (answerHidden(app, words))
    return kOk;
  const bool only_parse = !words.empty() && words.front() == kParse;
  if (only_parse)
    app.parse_complete_callback([] { throw CLI::Success(); });  // before the command's own callback
  try {
    const auto end = std::ranges::find(words, "--");
    tandem::client::asJson() = std::find(words.begin(), end, "--json") != end;
    // The last word first, as CLI11 takes them.
    app.parse(std::vector<std::string>(words.rbegin(), words.rend() - (only_parse ? 1 : 0)));
  } catch (const CLI::ParseError& error) {
    return refuseLine(app, error, words);
  }
  return exit_code;
}
