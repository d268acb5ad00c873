// SPDX-License-Identifier: Apache-2.0
#include "services/setup/process.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <random>
#include <stdexcept>

#include "config/any_robot.h"
#include "services/common/log.h"
#include "services/dds/host_addresses.h"
#include "services/security/verify.h"

namespace tandem::service {

std::uint64_t randomIdentity() {
  std::random_device device;
  std::uint64_t value = 0;
  while (value == 0)
    value = (static_cast<std::uint64_t>(device()) << 32) | device();
  return value;
}

const config::Host& thisHost(const config::Deployment& deployment) {
  const std::set<std::string> here = dds::hostAddresses();
  if (const config::Host* host = config::hostAmong(deployment, here))
    return *host;
  std::string hosts, addresses;
  for (const config::Host& host : deployment.hosts)
    hosts += (hosts.empty() ? "" : ", ") + host.name + " " + host.address;
  for (const std::string& address : here)
    addresses += (addresses.empty() ? "" : ", ") + address;
  throw std::invalid_argument(deployment.file.string() + ": hosts: found " + hosts +
                              ", expected one with an address of this machine (" + addresses + ")");
}

std::string hostName(const config::Deployment& deployment) {
  return deployment.hosts.empty() ? "" : thisHost(deployment).name;
}

dds::Role roleOf(const std::string& service) {
  if (service == "sim")
    return dds::Role::kHal;
  if (const auto role = dds::roleFromName(service))
    return *role;
  throw std::invalid_argument("process '" + service + "' stands for no role");
}

std::string exposure(const config::Deployment& deployment) {
  const bool alone = deployment.hosts.empty() && deployment.interface_address.starts_with("127.");
  if (alone || !deployment.security.empty())
    return {};
  return deployment.file.string() +
         ": NOT SECURED: whoever is on this network can command the robot; set `security` (docs/security.md)";
}

namespace {

dds::Credentials goodCredentials(const config::Deployment& deployment, dds::Role role) {
  security::Purpose purpose;
  purpose.prefix = deployment.prefix;
  purpose.domain = deployment.domain;
  const std::string obstacle = security::obstacle(deployment.security, role, purpose);
  if (!obstacle.empty())
    throw std::invalid_argument(deployment.file.string() + ": security, role " + dds::name(role) + ": " + obstacle);
  return dds::credentialsOf(deployment.security, role);
}

}  // namespace

dds::BusOptions busOptions(const config::Deployment& deployment,
                           const std::string& process,
                           std::optional<dds::Role> role) {
  dds::BusOptions options;
  if (!deployment.security.empty())
    options.credentials = goodCredentials(deployment, role ? *role : roleOf(process));
  if (deployment.discovery)
    options.discovery = dds::DiscoveryServer{deployment.discovery->address, deployment.discovery->port};
  options.name = "tandem-" + process;
  options.domain = deployment.domain;
  options.prefix = deployment.prefix;
  if (deployment.hosts.empty()) {
    options.interface_address = deployment.interface_address;
    options.peers = deployment.peers;
  } else {
    options.interface_address = thisHost(deployment).address;
    options.peers.clear();
    for (const config::Host& host : deployment.hosts)
      options.peers.push_back(host.address);
  }
  options.deterministic = deployment.clock == config::ClockMode::kLockStep;
  options.command_age = deployment.budgets.commandAge(deployment.control_period);
  return options;
}

std::vector<std::string> armNames(const config::Robot& robot) {
  std::vector<std::string> names;
  for (const config::Arm& arm : robot.arms)
    names.push_back(arm.name);
  return names;
}

std::vector<std::string> shortArmNames(const config::Robot& robot) {
  std::vector<std::string> names = armNames(robot);
  for (std::string& name : names)
    name = name.starts_with("arm_") ? name.substr(4) : name;
  return names;
}

int runService(int argc,
               char** argv,
               const std::string& name,
               const std::string& description,
               const std::function<void(const Setup&, StopSignal& stop)>& body,
               const std::function<void(CLI::App&)>& more_options) {
  CLI::App app(description, "tandem-" + name);
  std::string deployment = "laptop", level;
  app.add_option("-d,--deployment", deployment, "deployment file, or the name of a preset")->capture_default_str();
  app.add_option("--log", level, "trace, debug, info, warn, error or off (default: TANDEM_LOG, else info)");
  if (more_options)
    more_options(app);
  app.footer("Started by hand only for debugging; `tandem up` starts all processes of a deployment.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  StopSignal stop;
  try {
    startLog(name, level);
    Setup setup;
    setup.name = name;
    setup.heartbeat = std::make_shared<Heartbeat>(stop);
    setup.deployment = config::loadDeployment(config::findFile(deployment, "deployment"));
    setup.robot = config::loadAnyRobot(setup.deployment.robot);
    setup.session = randomIdentity();
    for (const std::string& warning : setup.robot.warnings)
      spdlog::debug("{}", warning);
    if (const std::string warning = exposure(setup.deployment); !warning.empty())
      spdlog::warn("{}", warning);
    body(setup, stop);
    stopLog();
    return 0;
  } catch (const config::Error& error) {
    spdlog::error("{}", error.what());
    stopLog();
    return 2;
  } catch (const Occupied& error) {
    spdlog::error("{}", error.what());
    stopLog();
    return 3;
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    stopLog();
    return 1;
  }
}

}  // namespace tandem::service
