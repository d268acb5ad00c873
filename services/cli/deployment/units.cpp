// SPDX-License-Identifier: Apache-2.0
/** @file tandem units: systemd units of a deployment on this host. */
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <set>
#include <vector>

#include "config/robot_files.h"
#include "services/cli/subcommand.h"
#include "services/runtime/process.h"

namespace tandem::cli {
namespace {

/// Units look their deployment up by name: the name must be one that the lookup finds and that systemd does not escape.
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

/// Addresses with which the services exchange packets: this host's and those of the deployment.
std::string addressesOf(const config::Deployment& deployment) {
  const std::vector<std::string> peers = runtime::peersOf(deployment);
  std::set<std::string> addresses(peers.begin(), peers.end());
  if (deployment.hosts.empty())
    addresses.insert(deployment.interface_address);
  if (deployment.discovery)
    addresses.insert(deployment.discovery->address);
  std::string text = "localhost";
  for (const std::string& address : addresses)
    text += " " + address;
  return text;
}

/// Drop-ins that make systemd drop all other packets. @param folder  of the units
void restrict(const std::vector<std::string>& units,
              const std::string& name,
              const config::Deployment& deployment,
              const std::string& folder) {
  std::vector<std::string> files;
  for (const std::string& unit : units) {
    if (unit.starts_with("tandem-console@") && !deployment.console.loopback()) {
      std::cerr << unit << ": not restricted, since browsers of other PCs reach it at " << deployment.console.address
                << "; `systemctl edit " << unit << "` can name their network\n";
      continue;
    }
    const std::filesystem::path file = std::filesystem::path(folder) / (unit + ".d") / "50-addresses.conf";
    std::filesystem::create_directories(file.parent_path());
    std::ofstream out(file);
    out << "# By `tandem units " << name << " --restrict`: to be repeated when hosts change.\n"
        << "[Service]\nIPAddressDeny=any\nIPAddressAllow=" << addressesOf(deployment) << "\n";
    if (!out.flush())
      throw Failure(kFailure, file.string() + ": cannot be written; as root, or with another folder behind --restrict");
    files.push_back(file.string());
  }
  answer(fmt::format("{}", fmt::join(files, "\n")), files);
  std::cerr << "active after `systemctl daemon-reload` and a restart of the running units\n";
}

int runUnits(const std::string& name, const std::optional<std::string>& restrict_in) {
  const std::string instance = instanceOf(name);
  const config::Deployment deployment = runtime::loadDeployment(name);
  config::loadAnyRobot(deployment);
  const auto fail = [&](const std::string& text) { throw Failure(kUsage, deployment.file.string() + ": " + text); };
  if (deployment.clock == config::ClockMode::kLockStep)
    fail("clock: found lock_step, expected real_time: units are for robots, `tandem experiment` runs in lock-step");
  const std::string host = runtime::hostName(deployment);
  std::vector<std::string> units;
  for (const config::Process& process : deployment.processes) {
    if (process.host != host)
      continue;
    if (!process.is_service || !process.arguments.empty())
      fail("processes: found '" + process.name +
           "' with arguments of its own, expected services alone; `tandem up` starts it");
    if (process.executable.find('/') != std::string::npos)
      fail("processes: found '" + process.name + "' with the executable " + process.executable +
           ", expected a program of Tandem, which has a unit; `tandem up` starts it");
    units.push_back(process.executable + "@" + instance + ".service");
  }
  if (units.empty())
    fail("processes: none of them runs on this host ('" + host + "')");
  if (restrict_in) {
    restrict(units, instance, deployment, *restrict_in);
    return kOk;
  }
  answer(fmt::format("{}", fmt::join(units, "\n")), units);
  return kOk;
}

}  // namespace

void registerUnits(CLI::App& app, int& exit_code) {
  auto name = std::make_shared<std::string>();
  auto folder = std::make_shared<std::string>("/etc/systemd/system");
  CLI::App* command = app.add_subcommand("units", "print the systemd units of a deployment on this host, one per line");
  command->add_option("deployment,-d,--deployment", *name, "name of a deployment")->required();
  CLI::Option* restricted = command->add_option(
      "--restrict", *folder,
      "write systemd drop-ins that block all packets except those of this host and of the deployment's hosts");
  restricted->expected(0, 1)->type_name("FOLDER")->capture_default_str();
  command->callback([name, folder, restricted, &exit_code] {
    const auto where = restricted->count() > 0 ? std::optional(*folder) : std::nullopt;
    guarded(exit_code, [&] { return runUnits(*name, where); });
  });
}

}  // namespace tandem::cli
