// SPDX-License-Identifier: Apache-2.0
/** @file tandem doctor: suitability of this PC for a deployment. */
#include <iostream>
#include <nlohmann/json.hpp>

#include "config/robot_files.h"
#include "services/cli/deployment/doctor_checks.h"
#include "services/cli/subcommand.h"
#include "services/runtime/process.h"

namespace tandem::cli {
namespace {

struct DoctorCommand {
  std::string deployment = runtime::defaultDeployment();
  double seconds = 3.0;
  bool json = false;
};

constexpr const char* kLevelName[] = {"good", "warning", "bad"};

const char* nameOf(Finding::Level level) { return kLevelName[static_cast<int>(level)]; }

void printDoctor(const Finding& finding) {
  std::cout << nameOf(finding.level) << std::string(9 - std::string(nameOf(finding.level)).size(), ' ')
            << finding.subject << ": " << finding.found << '\n';
  if (!finding.advice.empty())
    std::cout << "         -> " << finding.advice << '\n';
}

int runDoctor(const DoctorCommand& options) {
  const config::Deployment deployment = runtime::loadDeployment(options.deployment);
  config::loadAnyRobot(deployment);
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  Finding::Level worst = Finding::Level::kGood;
  const auto report = [&](const std::vector<Finding>& findings) {
    for (const Finding& finding : findings) {
      worst = std::max(worst, finding.level);
      all.push_back({{"subject", finding.subject},
                     {"level", nameOf(finding.level)},
                     {"found", finding.found},
                     {"advice", finding.advice}});
      if (!options.json)
        printDoctor(finding);
    }
    std::cout << std::flush;
  };
  report(checkMachine(deployment));
  report(checkRights(deployment));
  report(checkClock(deployment));
  report(checkNetwork(deployment));
  report(checkSecurity(deployment));
  report(checkCan(deployment));
  const double period = shortestPeriod(deployment);
  if (!options.json)
    std::cout << "         timer: watching for " << options.seconds << " s ..." << std::endl;
  report({judgeTimer(measureTimer(period, deployment.realtime_priority, deployment.lock_memory, options.seconds),
                     deployment)});
  if (options.json) {
    std::cout
        << nlohmann::ordered_json{{"deployment", deployment.name}, {"level", nameOf(worst)}, {"findings", all}}.dump(2)
        << '\n';
  } else {
    constexpr const char* kVerdicts[] = {"this PC is suitable", "this PC is suitable, with the warnings above",
                                         "this PC is not suitable"};
    std::cout << deployment.name << ": " << kVerdicts[static_cast<int>(worst)] << '\n';
  }
  return worst == Finding::Level::kBad ? kFailure : kOk;
}

}  // namespace

void registerDoctor(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<DoctorCommand>();
  CLI::App* command =
      app.add_subcommand("doctor", "check this PC: kernel, rights, clock, network, CAN, timer; suggest remedies");
  command->add_option("deployment,-d,--deployment", options->deployment, "deployment file or preset")
      ->capture_default_str();
  command->add_option("--for", options->seconds, "duration of the timer measurement, s")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 3600.0));
  command->add_flag("--json", options->json, "JSON instead of text");
  command->footer("Exit code 1: a check failed. Run it while no robot moves: it loads all cores.");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return runDoctor(*options); }); });
}

}  // namespace tandem::cli
