// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/process.h"

#include <sched.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <map>
#include <random>
#include <regex>
#include <stdexcept>

#include "config/robot_files.h"
#include "services/dds/host_addresses.h"
#include "services/runtime/identity.h"
#include "services/runtime/log.h"
#include "services/runtime/method_library.h"
#include "services/runtime/periodic_loop.h"
#include "services/security/verify.h"

namespace tandem::runtime {

namespace {

constexpr const char* kDomain = "TANDEM_DOMAIN";
constexpr const char* kPrefix = "TANDEM_PREFIX";

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

/// Replaces domain and prefix of a deployment by the values of the environment.
void placeByEnvironment(config::Deployment& deployment) {
  if (const std::string text = environment(kDomain); !text.empty()) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), deployment.domain);
    if (error != std::errc() || end != text.data() + text.size() || deployment.domain < 0 || deployment.domain > 232)
      throw config::Error(kDomain, 0, 0, "domain", "found '" + text + "', expected a number from 0 to 232");
  }
  if (const std::string text = environment(kPrefix); !text.empty()) {
    if (!std::regex_match(text, std::regex("[a-z][a-z0-9_]*")))
      throw config::Error(
          kPrefix, 0, 0, "prefix",
          "found '" + text + "', expected a name of lower-case letters, digits and _, starting with a letter");
    deployment.prefix = text;
  }
}

}  // namespace

std::string defaultDeployment() {
  const std::string usual = environment("TANDEM_DEPLOYMENT");
  return usual.empty() ? "laptop" : usual;
}

config::Deployment loadDeployment(const std::string& name) {
  config::Deployment deployment = config::loadDeployment(config::findFile(name, "deployment"));
  placeByEnvironment(deployment);
  return deployment;
}

void addPlaceOptions(CLI::App& app) {
  const auto add = [&app](const char* option, const char* variable, const char* what) {
    app.add_option_function<std::string>(
           option, [variable](const std::string& value) { ::setenv(variable, value.c_str(), 1); },
           std::string(what) + "; overrides the deployment (environment variable: " + variable + ")")
        ->trigger_on_parse();
  };
  add("--domain", kDomain, "DDS domain");
  add("--prefix", kPrefix, "topic prefix");
}

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
  throw std::invalid_argument("process '" + service + "' has no security role");
}

std::string exposure(const config::Deployment& deployment) {
  const bool alone = deployment.hosts.empty() && deployment.interface_address.starts_with("127.");
  if (alone || !deployment.security.empty())
    return {};
  return deployment.file.string() +
         ": NOT SECURED: every program on this network can command the robot; set `security` (docs/security.md)";
}

namespace {

dds::Credentials goodCredentials(const config::Deployment& deployment, dds::Role role) {
  security::VerificationTarget target;
  target.prefix = deployment.prefix;
  target.domain = deployment.domain;
  const std::string obstacle = security::obstacle(deployment.security, role, target);
  if (!obstacle.empty())
    throw std::invalid_argument(deployment.file.string() + ": security, role " + dds::name(role) + ": " + obstacle);
  return dds::credentialsOf(deployment.security, role);
}

}  // namespace

std::vector<std::string> peersOf(const config::Deployment& deployment) {
  if (deployment.hosts.empty())
    return deployment.peers;
  std::vector<std::string> addresses;
  for (const config::Host& host : deployment.hosts)
    addresses.push_back(host.address);
  return addresses;
}

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
  options.interface_address = deployment.hosts.empty() ? deployment.interface_address : thisHost(deployment).address;
  options.peers = peersOf(deployment);
  options.deterministic = deployment.clock == config::ClockMode::kLockStep;
  options.command_age = deployment.budgets.commandAge(deployment.control_period);
  options.identity = identityOf(deployment, process);
  return options;
}

dds::BusOptions ofAnyRobot(dds::BusOptions options) {
  options.identity = {};
  return options;
}

namespace {

/// Sets real-time priority for threads that transport references, commands, states and stops: all that are created from
/// now on. No change if the starter of the process has chosen another policy, or in lock-step, which has no deadlines.
void takePriority(const Setup& setup) {
  // SCHED_FIFO, as in the systemd units
  static const std::map<std::string, int> priorities{{"hal", 30}, {"sim", 30}, {"control", 20}, {"planning", 10}};
  const auto found = priorities.find(setup.name);
  if (found == priorities.end() || setup.deployment.clock == config::ClockMode::kLockStep ||
      ::sched_getscheduler(0) != SCHED_OTHER)
    return;
  for (const std::string& refusal : enterRealtime(found->second, false))
    spdlog::info("{}; on a loaded PC missed deadlines can stop the robot", refusal);
}

/// Allocations beyond this limit fail, which ends this process before the kernel runs out of memory and ends any
/// process. A process that already uses more, as with a sanitizer, gets no limit.
void limitMemory(int megabytes) {
  std::ifstream status("/proc/self/status");
  std::uint64_t kilobytes = 0;
  for (std::string word; status >> word;) {
    if (word == "VmData:")
      status >> kilobytes;
  }
  const rlim_t limit = static_cast<rlim_t>(megabytes) << 20;
  if (limit == 0 || kilobytes << 10 >= limit)
    return;
  rlimit both{};
  ::getrlimit(RLIMIT_DATA, &both);
  both.rlim_cur = std::min(both.rlim_cur, limit);
  if (::setrlimit(RLIMIT_DATA, &both) != 0)
    spdlog::warn("memory_limit_mb: a limit of {} MB cannot be set ({}); the memory of this process has no limit",
                 megabytes, std::strerror(errno));
}

}  // namespace

int runService(int argc,
               char** argv,
               const std::string& name,
               const std::string& description,
               const std::function<void(const Setup&, StopSignal& stop)>& body,
               const std::function<void(CLI::App&)>& more_options) {
  CLI::App app(description, "tandem-" + name);
  std::string deployment = defaultDeployment(), level;
  app.add_option("-d,--deployment", deployment, "deployment file or preset")->capture_default_str();
  addPlaceOptions(app);
  app.add_option("--log", level, "trace, debug, info, warn, error or off (default: TANDEM_LOG, else info)");
  if (more_options)
    more_options(app);
  app.footer("Usually started by `tandem up`; start it directly only for debugging.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  StopSignal stop;
  int code = 0;
  try {
    startLog(name, level);
    Setup setup;
    setup.name = name;
    setup.heartbeat = std::make_shared<Heartbeat>(stop);
    setup.deployment = loadDeployment(deployment);
    setup.robot = config::loadAnyRobot(setup.deployment);
    setup.session = randomIdentity();
    if (name == "control" || name == "planning") {  // the services that run methods
      if (const std::string found = loadMethod(setup.deployment, setup.robot); !found.empty())
        spdlog::info("{}", found);
    }
    takePriority(setup);
    limitMemory(setup.deployment.memory_limit);
    for (const std::string& warning : setup.robot.warnings)
      spdlog::debug("{}", warning);
    if (const std::string warning = exposure(setup.deployment); !warning.empty())
      spdlog::warn("{}", warning);
    body(setup, stop);
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    code = dynamic_cast<const config::Error*>(&error) != nullptr   ? 2
           : dynamic_cast<const ResourceInUse*>(&error) != nullptr ? 3
                                                                   : 1;
  }
  stopLog();
  return code;
}

}  // namespace tandem::runtime
