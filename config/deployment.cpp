// SPDX-License-Identifier: Apache-2.0
#include <arpa/inet.h>

#include <algorithm>

#include "config/deployment_copy.h"
#include "config/detail/loaders.h"
#include "config/file_tables.h"
#include "config/robot_files.h"
#include "config/values.h"

namespace tandem::config {
namespace {

void warnOfBudgets(const Map& map) {
  for (const Field& budget : map.table().fields) {
    const std::string& key = budget.name;
    if (const double value = map.number(key); value > *budget.default_number)
      map.warn(key, "found " + map.inUnit(key, value) + ", expected at most the default of " +
                        map.inUnit(key, *budget.default_number) + "; a larger budget needs a reason in docs/safety.md");
  }
}

void checkHosts(const Map& map, const std::vector<Host>& hosts) {
  for (const char* key : {"interface_address", "peers"}) {
    if (!hosts.empty() && map.has(key))
      map.fail(key, "found together with `hosts`; expected either `hosts` or `interface_address` and `peers`");
  }
  map.expectDistinct("hosts", "name");
  const std::vector<Map> entries = map.maps("hosts");
  for (std::size_t k = 0; k < hosts.size(); ++k) {
    const std::string& address = hosts[k].address;
    const auto same = std::ranges::find(hosts, address, &Host::address);
    if (same != hosts.begin() + static_cast<std::ptrdiff_t>(k))
      entries[k].fail("address", "found " + address + ", which is host '" + same->name + "', expected another address");
    if (address.starts_with("127."))
      entries[k].fail("address",
                      "found " + address + ", which other hosts cannot reach; expected an address on their network");
  }
}

std::vector<std::string> namesOf(const std::vector<Host>& hosts) {
  std::vector<std::string> names;
  for (const Host& host : hosts)
    names.push_back(host.name);
  return names;
}

/// Empty: none.
std::filesystem::path securityFolder(const Map& map, const std::filesystem::path& file) {
  return map.has("security") ? (file.parent_path() / map.text("security")).lexically_normal() : std::filesystem::path();
}

/// Does not check the credentials: only processes of the deployment need them.
std::filesystem::path readSecurity(const Map& map, const std::filesystem::path& file) {
  auto folder = securityFolder(map, file);
  std::error_code ignored;
  if (!folder.empty() && !std::filesystem::is_directory(folder, ignored))
    map.fail("security",
             "found '" + map.text("security") +
                 "', expected a folder relative to this file's, made by `tandem security init` and `issue`");
  return folder;
}

bool isIpv4(const std::string& text) {
  in_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1;
}

/// Replaces the name of a host by its address.
void resolveDiscovery(const Map& map, Deployment& deployment) {
  if (!deployment.discovery)
    return;
  if (!deployment.security.empty())
    map.fail(
        "discovery",
        "found both `security` and `discovery`: discovery servers of Fast DDS 2.9 crash with secured participants; "
        "expected one of them. Without `discovery`, use `peers` or `hosts`");
  std::string& address = deployment.discovery->address;
  const auto host = std::ranges::find(deployment.hosts, address, &Host::name);
  if (host != deployment.hosts.end())
    address = host->address;
  else if (!isIpv4(address))
    map.map("discovery")
        .fail("server",
              "found '" + address + "', expected an IPv4 address" +
                  (deployment.hosts.empty() ? "" : " or one of the hosts " + join(namesOf(deployment.hosts))));
}

/// Checks that every process runs on one of the hosts, if there are any.
void checkProcesses(const Map& map, const std::vector<Host>& hosts) {
  map.expectDistinct("processes", "name");
  map.each("processes", [&](const Map& entry) {
    if (hosts.empty() && entry.has("host"))
      entry.fail("host", "found '" + entry.text("host") +
                             "', but the deployment has no `hosts`; add `hosts`, or remove this key");
    if (hosts.empty())
      return;
    const std::string expected = "one of " + join(namesOf(hosts));
    if (!entry.has("host"))
      entry.fail("name", "found a process without host, expected " + expected);
    entry.indexAmong("host", namesOf(hosts), expected);
  });
}

/// Does not read the files: only the host of the console needs them.
void checkConsole(const Map& map, const Console& console) {
  if (map.has("certificate") != map.has("key"))
    map.fail(map.has("key") ? "key" : "certificate", "found only one of certificate and key; expected both, or none");
  if (!console.viewer_token.empty() && console.operator_token.empty())
    map.fail("viewer_token",
             "found viewer_token without operator_token, with which every client could send commands; expected both");
  if (console.loopback())
    return;
  const std::string who = "found " + console.address + ", which other machines reach, ";
  if (!console.tls())
    map.fail("address", who + "without TLS; expected certificate and key");
  if (console.operator_token.empty())
    map.fail("address", who + "without tokens; expected operator_token");
}

void checkMemory(const Map& map, const Deployment& deployment) {
  if (deployment.memory_limit > 0 && deployment.black_box.memory > deployment.memory_limit / 2)
    map.map("black_box")
        .fail("memory_mb", "found " + std::to_string(deployment.black_box.memory) +
                               ", expected at most half of memory_limit_mb, which is " +
                               std::to_string(deployment.memory_limit));
}

void checkTiming(const Map& map, const Deployment& deployment) {
  if (map.has("least_clearance") && deployment.clock == ClockMode::kLockStep)
    map.fail("least_clearance",
             "found together with clock: lock_step, where the clearance is not monitored; expected clock: real_time");
  if (deployment.emergency_stop_budget > 0.0 && deployment.clock == ClockMode::kLockStep)
    map.fail("emergency_stop_topic",
             "found together with clock: lock_step, where this topic is not monitored; expected clock: real_time");
  if (deployment.sim_period > deployment.control_period) {
    map.fail(map.has("sim_period") ? "sim_period" : "control_period",
             "found a sim_period of " + formatNumber(deployment.sim_period) + " s and a control_period of " +
                 formatNumber(deployment.control_period) + " s, expected a sim_period of at most the control_period");
  }
}

void readFeedback(const Map& map, Deployment& deployment) {
  deployment.plant = readPlant(map.map("plant"), [&] { return loadAnyRobot(deployment.robot); });
  if (deployment.orientation_feedback == planning::Feedback::kSensor &&
      deployment.feedback != planning::Feedback::kSensor)
    map.fail("orientation_feedback",
             "found orientation_feedback: sensor with feedback: model, expected feedback: sensor, too");
  const bool needs_tracker =
      deployment.clock == ClockMode::kLockStep && deployment.feedback == planning::Feedback::kSensor;
  if (needs_tracker && !deployment.plant.tracker.present) {
    map.fail("feedback", "found feedback: sensor in lock-step without a simulated tracker; expected plant.tracker");
  }
}

}  // namespace

const Host* hostAmong(const Deployment& deployment, const std::set<std::string>& addresses) {
  const auto found = std::find_if(deployment.hosts.begin(), deployment.hosts.end(),
                                  [&](const Host& host) { return addresses.contains(host.address); });
  return found == deployment.hosts.end() ? nullptr : &*found;
}

namespace {

/// @param companions  null: those that the file names
Deployment load(const std::filesystem::path& file, const CompanionFiles* companions) {
  Document document(file.string(), readFile(file));
  const Map map = document.check(deploymentTable());
  auto deployment = map.read<Deployment>();
  deployment.file = file;
  warnOfBudgets(map.map("budgets"));
  map.together(
      [&] {
        deployment.robot =
            companions && map.has("robot") ? companions->robot : companionPath(map, "robot", file, robotKinds());
        map.together([&] { robotFileOf(deployment.robot).check_deployment(map, deployment); },
                     [&] { readFeedback(map, deployment); });
      },
      [&] {
        if (map.has("hardware"))
          deployment.hardware = companions ? companions->hardware : companionPath(map, "hardware", file);
      },
      [&] {
        const bool foreign = deployment.method == control::Method::kForeign;
        deployment.method_library = methodLibrary(map, file, foreign, "method");
      },
      [&] { checkTiming(map, deployment); }, [&] { checkMemory(map, deployment); },
      [&] { deployment.teleoperation = readTeleoperation(map.map("teleoperation")); },
      [&] { checkConsole(map.map("console"), deployment.console); }, [&] { checkHosts(map, deployment.hosts); },
      [&] {
        deployment.security = companions ? securityFolder(map, file) : readSecurity(map, file);
        resolveDiscovery(map, deployment);
      },
      [&] { checkProcesses(map, deployment.hosts); });
  document.finish();
  deployment.warnings = document.warnings();
  deployment.values = valuesOf(map) + valuesOfFiles(deployment);
  return deployment;
}

}  // namespace

Deployment loadDeployment(const std::filesystem::path& file) { return load(file, nullptr); }
Deployment loadDeployment(const std::filesystem::path& copy, const CompanionFiles& companions) {
  return load(copy, &companions);
}

}  // namespace tandem::config
