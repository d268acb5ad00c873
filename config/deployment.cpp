// SPDX-License-Identifier: Apache-2.0
#include <arpa/inet.h>

#include <algorithm>

#include "config/cooperative.h"
#include "config/file_tables.h"
#include "config/loaders.h"

namespace tandem::config {
namespace {

safety::Budgets readBudgets(const Map& map) {
  const safety::Budgets defaults;
  const auto read = [&map](const std::string& key, double usual) {
    const double value = map.number(key);
    if (value > usual) {
      map.warn(key, "found " + map.inUnit(key, value) + ", expected at most the default of " + map.inUnit(key, usual) +
                        "; a larger budget needs a reason in docs/safety.md");
    }
    return value;
  };
  safety::Budgets budgets;
  budgets.minimum_age = read("minimum_age", defaults.minimum_age);
  budgets.age_periods = read("age_periods", defaults.age_periods);
  budgets.planning_reference = read("planning_reference", defaults.planning_reference);
  budgets.teleoperation = read("teleoperation", defaults.teleoperation);
  budgets.tip_measurement = read("tip_measurement", defaults.tip_measurement);
  budgets.drive_heartbeat = read("drive_heartbeat", defaults.drive_heartbeat);
  budgets.lease = read("lease", defaults.lease);
  return budgets;
}

std::vector<Host> readHosts(const Map& map) {
  std::vector<Host> hosts;
  if (!map.has("hosts"))
    return hosts;
  for (const char* key : {"interface_address", "peers"}) {
    if (map.has(key))
      map.fail(key, "found beside hosts, which say the same; expected one of them");
  }
  for (const Map& entry : map.maps("hosts")) {
    const Host host{entry.text("name"), entry.text("address")};
    entry.expectNew("name", host.name, hosts, &Host::name);
    for (const Host& other : hosts) {
      if (other.address == host.address)
        entry.fail("address",
                   "found " + host.address + ", which is host '" + other.name + "', expected another address");
    }
    if (host.address.starts_with("127."))
      entry.fail("address",
                 "found " + host.address + ", which other hosts cannot reach; expected an address on their network");
    hosts.push_back(host);
  }
  return hosts;
}

/// Credentials are not looked at here: only processes of the deployment need them.
std::filesystem::path readSecurity(const Map& map, const std::filesystem::path& file) {
  if (!map.has("security"))
    return {};
  const auto folder = (file.parent_path() / map.text("security")).lexically_normal();
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored))
    map.fail("security",
             "found '" + map.text("security") +
                 "', expected a folder relative to this file's, made by `tandem security init` and `issue`");
  return folder;
}

bool isIpv4(const std::string& text) {
  in_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1;
}

std::optional<DiscoveryServer> readDiscovery(const Map& map, const Deployment& deployment) {
  if (!map.has("discovery"))
    return std::nullopt;
  const Map entry = map.map("discovery");
  if (!deployment.security.empty())
    map.fail("discovery",
             "found beside security, which a discovery server of Fast DDS 2.9 does not survive; expected one of "
             "them: peers or hosts need no server");
  DiscoveryServer server{entry.text("server"), entry.integer("port")};
  std::string known;
  for (const Host& host : deployment.hosts) {
    known += (known.empty() ? "" : ", ") + host.name;
    if (host.name == server.address)
      return DiscoveryServer{host.address, server.port};
  }
  if (!isIpv4(server.address))
    entry.fail("server", "found '" + server.address + "', expected an IPv4 address" +
                             (known.empty() ? "" : " or one of the hosts " + known));
  return server;
}

/// Where a process runs: one of the hosts, if there are any.
std::string readHostOf(const Map& entry, const std::vector<Host>& hosts) {
  if (hosts.empty()) {
    if (entry.has("host"))
      entry.fail("host", "found '" + entry.text("host") + "' in a deployment without hosts");
    return {};
  }
  std::string known;
  const std::string name = entry.has("host") ? entry.text("host") : "";
  for (const Host& host : hosts) {
    if (host.name == name)
      return name;
    known += (known.empty() ? "" : ", ") + host.name;
  }
  entry.fail(
      entry.has("host") ? "host" : "name",
      (entry.has("host") ? "found '" + name + "'" : "found a process without host") + ", expected one of " + known);
}

std::vector<Process> readProcesses(const Map& map, const std::vector<Host>& hosts) {
  std::vector<Process> processes;
  for (const Map& entry : map.maps("processes")) {
    entry.expectNew("name", entry.text("name"), processes, &Process::name);
    processes.push_back({entry.text("name"), entry.text("executable"), entry.texts("arguments"), entry.flag("service"),
                         readHostOf(entry, hosts), entry.flag("essential")});
  }
  return processes;
}

BlackBox readBlackBox(const Map& map, const std::filesystem::path& file) {
  BlackBox box;
  box.before = map.number("before");
  box.after = map.number("after");
  box.memory = map.integer("memory_mb");
  if (map.has("directory"))
    box.directory = std::filesystem::absolute(file).parent_path() / map.text("directory");
  box.files = map.integer("files");
  if (map.has("topics"))
    box.topics = map.texts("topics");
  return box;
}

/// The files are not looked at here: only the host that the console runs on needs them.
Console readConsole(const Map& map, const std::filesystem::path& file) {
  Console console;
  console.address = map.text("address");
  console.port = map.integer("port");
  const auto path = [&](const char* key) {
    return map.has(key) ? (std::filesystem::absolute(file).parent_path() / map.text(key)).lexically_normal()
                        : std::filesystem::path();
  };
  console.certificate = path("certificate");
  console.key = path("key");
  console.operator_token = path("operator_token");
  console.viewer_token = path("viewer_token");
  if (map.has("origins"))
    console.origins = map.texts("origins");
  if (map.has("certificate") != map.has("key"))
    map.fail(map.has("key") ? "key" : "certificate", "found one of certificate and key; expected both, or none");
  if (!console.viewer_token.empty() && console.operator_token.empty())
    map.fail("viewer_token", "found without operator_token, by which everybody commands; expected both");
  if (console.loopback())
    return console;
  const std::string who = "found " + console.address + ", which other machines reach, ";
  if (!console.tls())
    map.fail("address", who + "without TLS; expected certificate and key");
  if (console.operator_token.empty())
    map.fail("address", who + "without tokens; expected operator_token");
  return console;
}

void readTiming(const Map& map, Deployment& deployment) {
  deployment.clock = map.text("clock") == "lock_step" ? ClockMode::kLockStep : ClockMode::kRealTime;
  deployment.control_period = map.number("control_period");
  deployment.sim_period = map.number("sim_period");
  deployment.sim_translation_acceleration = map.number("sim_translation_acceleration");
  deployment.sim_rotation_acceleration = map.number("sim_rotation_acceleration");
  deployment.status_period = map.number("status_period");
  deployment.emergency_stop_budget = map.has("emergency_stop_topic") ? map.number("emergency_stop_topic") : 0.0;
  if (deployment.emergency_stop_budget > 0.0 && deployment.clock == ClockMode::kLockStep)
    map.fail("emergency_stop_topic", "found in lock-step, where nobody waits for reports; expected clock: real_time");
  deployment.idle_power_off = map.number("idle_power_off");
  deployment.realtime_priority = map.integer("realtime_priority");
  deployment.lock_memory = map.flag("lock_memory");
  if (deployment.sim_period > deployment.control_period) {
    map.fail(map.has("sim_period") ? "sim_period" : "control_period",
             "found a sim_period of " + formatNumber(deployment.sim_period) + " s and a control_period of " +
                 formatNumber(deployment.control_period) + " s, expected a sim_period of at most the control_period");
  }
}

void readFeedback(const Map& map, Deployment& deployment) {
  deployment.model = map.text("model");
  deployment.feedback = planning::feedbackFromName(map.text("feedback")).value();
  deployment.plant = readPlant(map.map("plant"), deployment.robot);
  const bool needs_tracker =
      deployment.clock == ClockMode::kLockStep && deployment.feedback == planning::Feedback::kSensor;
  if (needs_tracker && !deployment.plant.tracker.present) {
    map.fail(
        "feedback",
        "found feedback: sensor in lock-step, where only the simulated tracker is in step; expected plant.tracker");
  }
}

/// What only concentric tubes can have.
void refuseForCatheters(const Map& map, const Deployment& deployment) {
  const auto refuse = [&](const char* key, const std::string& found, const std::string& expected) {
    map.fail(key, "found " + found + " for the catheters of " + deployment.robot.filename().string() + ", expected " +
                      expected);
  };
  if (map.has("hardware"))
    refuse("hardware", "drives", "none: catheters are simulated");
  if (map.has("port"))
    refuse("port", "a port", "none: distances are kept of concentric tubes alone");
  if (map.has("plant"))
    refuse("plant", "a plant that differs", "none: the simulated catheters are those of the robot file");
  if (map.text("model") != "rigid")
    refuse("model", "'" + map.text("model") + "'", "no such key: they have one model, which gives way");
  if (map.text("feedback") != "model")
    refuse("feedback", "'" + map.text("feedback") + "'", "model: no tracker sees what they move");
}

}  // namespace

const Host* hostAmong(const Deployment& deployment, const std::set<std::string>& addresses) {
  const auto found = std::find_if(deployment.hosts.begin(), deployment.hosts.end(),
                                  [&](const Host& host) { return addresses.contains(host.address); });
  return found == deployment.hosts.end() ? nullptr : &*found;
}

Deployment loadDeployment(const std::filesystem::path& file) {
  Document document(file.string(), readFile(file));
  const Map map = document.check(deploymentTable());
  map.text("tandem");
  Deployment deployment;
  deployment.file = file;
  deployment.name = map.text("name");
  deployment.robot = companionPath(map, "robot", file, "robot|cooperative");
  if (map.has("hardware"))
    deployment.hardware = companionPath(map, "hardware", file);
  deployment.prefix = map.text("prefix");
  deployment.domain = map.integer("domain");
  deployment.interface_address = map.text("interface_address");
  if (map.has("peers"))
    deployment.peers = map.texts("peers");
  readTiming(map, deployment);
  deployment.budgets = readBudgets(map.map("budgets"));
  deployment.method = control::methodFromName(map.text("method")).value();
  deployment.relative_gain = map.number("relative_gain");
  deployment.tip_gain = map.number("tip_gain");
  if (map.has("port")) {
    const Map port = map.map("port");
    deployment.port.emplace();
    deployment.port->radius = port.number("radius");
    deployment.port->depth = port.number("depth");
  }
  if (kindOf(deployment.robot) == "cooperative")
    refuseForCatheters(map, deployment);
  readFeedback(map, deployment);
  deployment.teleoperation = readTeleoperation(map.map("teleoperation"));
  deployment.black_box = readBlackBox(map.map("black_box"), file);
  deployment.console = readConsole(map.map("console"), file);
  deployment.hosts = readHosts(map);
  deployment.security = readSecurity(map, file);
  deployment.discovery = readDiscovery(map, deployment);
  deployment.processes = readProcesses(map, deployment.hosts);
  document.finish();
  deployment.warnings = document.warnings();
  return deployment;
}

}  // namespace tandem::config
