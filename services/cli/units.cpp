// SPDX-License-Identifier: Apache-2.0
/** @file tandem units: which systemd units are a deployment on this host. */
#include <algorithm>
#include <cctype>
#include <iostream>

#include "config/any_robot.h"
#include "services/cli/arguments.h"
#include "services/setup/process.h"

namespace tandem::cli {
namespace {

/// Units look their deployment up by name: it has to be one that can be found so, and that systemd does not escape.
std::string instanceOf(const std::string& name) {
  const auto plain = [](unsigned char c) { return std::isalnum(c) || c == '-' || c == '_' || c == '.'; };
  if (name.empty() || !std::all_of(name.begin(), name.end(), plain) || name.ends_with(".yaml")) {
    throw Failure(kUsage,
                  "found deployment '" + name +
                      "', expected the name of a file in /etc/tandem/deployments or of a preset, without .yaml, "
                      "of letters, digits, -, _ and .");
  }
  return name;
}

int runUnits(const std::string& name) {
  const std::string instance = instanceOf(name);
  const config::Deployment deployment = config::loadDeployment(config::findFile(name, "deployment"));
  config::loadAnyRobot(deployment.robot);
  const auto fail = [&](const std::string& text) { throw Failure(kUsage, deployment.file.string() + ": " + text); };
  if (deployment.clock == config::ClockMode::kLockStep)
    fail("clock: found lock_step, expected real_time: units are for robots, `tandem experiment` runs in lock-step");
  const std::string host = service::hostName(deployment);
  std::string units;
  for (const config::Process& process : deployment.processes) {
    if (process.host != host)
      continue;
    if (!process.is_service || !process.arguments.empty())
      fail("processes: found '" + process.name +
           "' with arguments of its own, expected services alone; `tandem up` starts it");
    units += process.executable + "@" + instance + ".service\n";
  }
  if (units.empty())
    fail("processes: none of them runs on host '" + host + "', which is here");
  std::cout << units;
  return kOk;
}

}  // namespace

void registerUnits(CLI::App& app, int& exit_code) {
  auto name = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("units", "the systemd units that are a deployment on this host, one a line");
  command->add_option("deployment,-d,--deployment", *name, "name of a deployment")->required();
  command->footer("  systemctl enable --now tandem@NAME.target $(tandem units NAME)");
  command->callback([name, &exit_code] { guarded(exit_code, [&] { return runUnits(*name); }); });
}

}  // namespace tandem::cli
