// SPDX-License-Identifier: Apache-2.0
/** @file tandem status: state of a running system. */
#include <unistd.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>

#include "config/robot_files.h"
#include "control/conflict.h"
#include "operation/convert.h"
#include "planning/follower.h"
#include "robots/limit_description.h"
#include "safety/operating_state.h"
#include "services/cli/legend.h"
#include "services/cli/robot/processes.h"
#include "services/cli/robot/status_print.h"
#include "services/cli/robot/status_table.h"
#include "services/cli/subcommand.h"
#include "services/client/diagnostic_details.h"
#include "services/client/lost_protections.h"
#include "services/client/motions.h"
#include "services/client/run_summary.h"
#include "services/client/unconfirmed_positions.h"
#include "services/runtime/diagnostics.h"
#include "services/runtime/method_library.h"
#include "services/runtime/process.h"
#include "services/runtime/stop_signal.h"

namespace tandem::cli {
namespace {

nlohmann::ordered_json armStatusJson(const config::Robot& robot, const client::Snapshot& s, std::size_t k) {
  nlohmann::ordered_json arm;
  const auto state = static_cast<safety::OperatingState>(s.status.operating_state[k]);
  arm["name"] = robot.arms[k].name;
  arm["operating_state"] = safety::name(state);
  arm["is_homed"] = s.status.homed[k] != 0;
  arm["is_busy"] = s.status.busy[k] != 0;
  arm["is_recovering"] = s.status.recovery[k] != 0;
  arm["without"] = client::jointNamesOf(robot.arms[k], s.state.lost[k]);
  arm["idle_s"] = s.status.idle[k];
  arm["idle_left_s"] = s.status.idle_left[k];
  arm["faults"] = safety::describeFaults(s.status.faults[k] | s.state.faults[k]);
  const safety::FaultRecord record = dds::faultRecordOf(s.hal, static_cast<int>(k));
  arm["drive_fault"] = record.faults == 0 ? "" : safety::describe(record, &robot.arms[k].limits);
  nlohmann::ordered_json joints = nlohmann::ordered_json::array();
  for (std::size_t j = 0; j < s.state.joint_count[k]; ++j) {
    joints.push_back(s.state.position[dds::jointIndex(static_cast<int>(k), static_cast<int>(j))]);
  }
  arm["joints"] = joints;
  arm["plant_snaps"] = s.hal.snaps[k];
  arm["plant_snap_energy_J"] = s.hal.snap_energy[k];
  arm["plant_snap_distance_m"] = s.hal.snap_distance[k];
  arm["model_snaps"] = s.status.snaps[k];
  return arm;
}

nlohmann::ordered_json limitsJson(const config::Robot& robot, const dds::ControlStatus& status) {
  constexpr const char* kHow[] = {"", "forbid the tasks", "hold the tasks back"};
  nlohmann::ordered_json json{{"how", kHow[std::min<std::size_t>(status.limited, 2)]},
                              {"limits", nlohmann::ordered_json::array()}};
  for (std::size_t i = 0; i < status.limit_count && status.limit_arm[i] < robot.arms.size(); ++i) {
    const control::NamedLimit limit{static_cast<control::LimitKind>(status.limit_kind[i]), status.limit_arm[i],
                                    status.limit_tube[i]};
    json["limits"].push_back({{"arm", robot.arms[status.limit_arm[i]].name},
                              {"tube", status.limit_tube[i]},
                              {"bound", status.limit_bound[i]},
                              {"description", robots::describeLimit(robot, limit)}});
  }
  return json;
}

nlohmann::ordered_json clearanceJson(const config::Robot& robot, const dds::Clearances& clearances) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const dds::BodyClearance& body : clearances.bodies) {
    const bool port = body.other_arm == dds::kPort;
    if (body.arm >= robot.arms.size() || (!port && body.other_arm >= robot.arms.size()))
      continue;
    json.push_back({{"arm", robot.arms[body.arm].name},
                    {"other", port ? "port" : robot.arms[body.other_arm].name},
                    {"distance_m", body.distance},
                    {"place_m", body.place},
                    {"other_place_m", body.other_place},
                    {"by_joints", body.by_joints},
                    {"by_other_joints", body.by_other_joints},
                    {"answers_state", clearances.answers_state}});
  }
  return json;
}

/// Method as control describes it; a foreign method with its name and library.
std::string methodText(const client::Snapshot& s) {
  const std::string method(control::name(static_cast<control::Method>(s.status.method)));
  const auto control = s.diagnostics.find(runtime::kControl);
  if (control == s.diagnostics.end())
    return method;
  const auto value = std::ranges::find(control->second.values, runtime::kMethodKey, &dds::KeyValue::key);
  return value != control->second.values.end() && value->value.starts_with(method + ":") ? value->value : method;
}

nlohmann::ordered_json statusJson(const config::Deployment& deployment,
                                  const config::Robot& robot,
                                  const client::Snapshot& s) {
  nlohmann::ordered_json json;
  json["deployment"] = deployment.name;
  json["robot"] = robot.name;
  // Age of the values; on one machine all processes share the clock.
  json["stamps_ns"] = {
      {"state", s.state.stamp}, {"status", s.status.stamp}, {"reference", s.reference.stamp}, {"hal", s.hal.stamp}};
  json["method"] = methodText(s);
  json["model"] = dds::name(static_cast<dds::Model>(s.status.model));
  json["feedback"] = planning::name(static_cast<planning::Feedback>(s.status.feedback));
  json["hold"] = dds::name(static_cast<dds::HoldReason>(s.status.hold));
  json["lease_owner"] = s.status.lease_owner;
  json["source"] = dds::name(static_cast<dds::Source>(s.status.source));
  json["emergency_stop"] = dds::name(static_cast<dds::EmergencyStop>(s.hal.emergency_stop));
  json["arms"] = nlohmann::ordered_json::array();
  for (std::size_t k = 0; k < std::min<std::size_t>(s.state.arm_count, robot.arms.size()); ++k) {
    json["arms"].push_back(armStatusJson(robot, s, k));
  }
  json["trajectory"] = {{"id", s.reference.trajectory_id},
                        {"phase", planning::name(static_cast<planning::Phase>(s.reference.phase))},
                        {"point", s.reference.point},
                        {"points", s.reference.point_count},
                        {"iterations", s.reference.total_iterations}};
  if (s.summaries > 0)
    json["last_run"] = client::summaryJson(s.summary, robot);
  json["errors_m"] = nlohmann::ordered_json::array();
  for (std::size_t k = 0; k < s.status.task_count; ++k)
    json["errors_m"].push_back(s.status.task_error[k]);
  json["control"] = {{"period_s", s.status.period},         {"cycles", s.status.cycles},
                     {"overruns", s.status.overruns},       {"jitter_max_s", s.status.jitter_max},
                     {"solve_time_s", s.status.solve_time}, {"cycle_time_max_s", s.status.cycle_time_max}};
  json["success"] = {{"commands", s.hal.command_success},
                     {"states", s.status.state_success},
                     {"references", s.status.reference_success}};
  for (std::size_t b = 0; b < s.hal.bus_count; ++b)
    json["success"]["bus " + std::to_string(b + 1)] = s.hal.bus_success[b];
  json["limits"] = limitsJson(robot, s.status);
  json["clearance_stamp_ns"] = s.clearances.stamp;
  json["clearance"] = clearanceJson(robot, s.clearances);
  nlohmann::ordered_json guards;
  for (int g = 0; g < safety::kGuardCount; ++g) {
    guards[std::string(safety::name(static_cast<safety::Guard>(g)))] = s.hal.guard_count[static_cast<std::size_t>(g)];
  }
  json["guards"] = guards;
  json["lost_protections"] = client::lostProtections(robot, s.hal);
  json["unconfirmed"] = client::unconfirmedPositions(robot, s.hal, s.state);
  json["failed"] = client::diagnosticDetails(s, runtime::kFailedKey);
  json["dropped"] = client::diagnosticDetails(s, runtime::kDroppedKey);
  json["diagnostics"] = diagnosticsJson(s);
  json["domain"] = deployment.domain;
  json["prefix"] = deployment.prefix;
  json["secured"] = !deployment.security.empty();
  if (const std::string warning = runtime::exposure(deployment); !warning.empty())
    json["warning"] = warning;
  return json;
}

/** Latest tip of each arm that control publishes. */
class Tips {
 public:
  Tips(client::Client& client, const config::Robot& robot)
      : tips_(robot.arms.size()), orientations_(robot.arms.size()) {
    for (std::size_t k = 0; k < tips_.size(); ++k) {
      readers_.push_back(
          client.bus().reader(dds::kMeasuredCp, robot.arms[k].name, [this, k](const dds::PoseStamped& pose) {
            const std::scoped_lock lock(mutex_);
            tips_[k] = pose.position;
            orientations_[k] = pose.orientation;
          }));
    }
  }
  /// Whether there is one of each arm.
  bool all() const {
    const std::scoped_lock lock(mutex_);
    return std::ranges::none_of(tips_, [](const auto& tip) { return tip.is_null(); });
  }
  /// Adds tip_m and tip_orientation (x y z w), in the robot base frame, to each arm of a status; null: not known.
  void addTo(nlohmann::ordered_json& json) const {
    const std::scoped_lock lock(mutex_);
    for (std::size_t k = 0; k < json["arms"].size(); ++k) {
      json["arms"][k]["tip_m"] = tips_[k];
      json["arms"][k]["tip_orientation"] = orientations_[k];
    }
  }

 private:
  mutable std::mutex mutex_;
  std::vector<nlohmann::ordered_json> tips_, orientations_;
  std::vector<dds::Reader> readers_;  // last: their callbacks use the others
};

/// Moves to the upper left corner of a terminal and clears it.
constexpr const char* kClear = "\x1b[H\x1b[J";

/** Services that have published nothing for a while. */
class Silence {
 public:
  /// @param timeout  s, longer than any period of publication
  explicit Silence(double timeout) : timeout_(timeout) {}

  /// Whether all have published since the last call of note().
  bool allNew(const client::Snapshot& s) const {
    const auto now = counts(s);
    for (std::size_t k = 0; k < now.size(); ++k) {
      if (now[k] == received_[k].count)
        return false;
    }
    return true;
  }
  void note(const client::Snapshot& s) {
    const auto now = counts(s);
    for (std::size_t k = 0; k < now.size(); ++k) {
      if (now[k] != received_[k].count)
        received_[k] = {now[k], std::chrono::steady_clock::now()};
    }
  }
  std::vector<std::string> names() const {
    std::vector<std::string> silent;
    for (std::size_t k = 0; k < received_.size(); ++k) {
      if (std::chrono::steady_clock::now() - received_[k].at > std::chrono::duration<double>(timeout_))
        silent.push_back(kNames[k]);
    }
    return silent;
  }

 private:
  static constexpr std::array kNames{"actuation/state", "hal/status", "control", "planning"};
  static std::array<std::uint64_t, kNames.size()> counts(const client::Snapshot& s) {
    return {s.states, s.hals, s.statuses, s.references};
  }
  struct Received {
    std::uint64_t count = 0;
    std::chrono::steady_clock::time_point at = std::chrono::steady_clock::now();
  };
  double timeout_;
  std::array<Received, kNames.size()> received_;
};

int run(const std::string& name, double wait, bool as_json, bool follow) {
  const config::Deployment deployment = runtime::loadDeployment(name);
  const config::Robot robot = config::loadAnyRobot(deployment);
  client::Client client(deployment);
  const bool several = deployment.hosts.size() > 1;
  const Tips tips(client, robot);
  client.connect(wait);
  client.waitFor(2.0, [&](const client::Snapshot& s) {
    return s.hals > 0 && s.clearance_count > 0 && tips.all() && !client::summaryIsDue(s);
  });
  if (!follow) {
    if (several)
      requestAll(client);
    auto json = statusJson(deployment, robot, client.snapshot());
    tips.addTo(json);
    json["clocks"] = clocksJson(client.clocks().offsets());
    json["processes"] = processesJson(client);
    if (as_json) {
      std::cout << json.dump(2) << '\n';
    } else {
      printStatus(json);
    }
    return kOk;
  }
  runtime::StopSignal stop;
  client.setInterrupt([&] { return stop.requested(); });
  TimeLeft time_left;
  const bool on_terminal = isatty(STDOUT_FILENO) != 0;
  const bool colours = on_terminal && std::getenv("NO_COLOR") == nullptr;
  const auto begin = std::chrono::steady_clock::now();
  Silence silence(std::max(1.0, 3.0 * deployment.control_period));
  while (!stop.requested()) {
    constexpr double kLook = 0.2;  // s: update interval, even while a service is silent
    client.waitFor(std::max(kLook, 2.0 * deployment.control_period),
                   [&](const client::Snapshot& s) { return silence.allNew(s); });
    if (several)
      client.clocks().requestTimes();
    const client::Snapshot now = client.snapshot();
    silence.note(now);
    auto json = statusJson(deployment, robot, now);
    tips.addTo(json);
    json["silent"] = silence.names();
    json["clocks"] = clocksJson(client.clocks().offsets());
    json["processes"] = processesJson(client);
    if (as_json) {
      std::cout << json.dump() << std::endl;
    } else if (on_terminal) {
      time_left.see(json, client::since(begin));
      std::cout << kClear << statusTable(json, time_left.text(), colours) << std::flush;
    } else {
      printStatus(json);
    }
  }
  return kOk;
}

/// Waits for those of the deployment's processes that run on this host, whatever other hosts they wait for themselves.
int runCheck(const std::string& name, double wait) {
  const std::map<std::string, std::uint64_t client::Snapshot::*> voices{
      {"tandem-sim", &client::Snapshot::states},
      {"tandem-hal", &client::Snapshot::states},
      {"tandem-control", &client::Snapshot::statuses},
      {"tandem-planning", &client::Snapshot::references}};
  const config::Deployment deployment = runtime::loadDeployment(name);
  const std::string host = runtime::hostName(deployment);
  client::Client client(deployment);
  std::string received, silent;
  const auto look = [&](const client::Snapshot& s) {
    received.clear();
    silent.clear();
    for (const config::Process& process : deployment.processes) {
      const auto voice = voices.find(process.executable);
      if (process.host == host && voice != voices.end())
        (s.*(voice->second) > 0 ? received : silent) += " " + process.name;
    }
    return silent.empty();
  };
  if (!client.waitFor(wait, look))
    throw Failure(kFailure, fmt::format("{}: no message from{} within {:g} s", deployment.file.string(), silent, wait));
  std::cout << deployment.name << (host.empty() ? "" : " on " + host) << ": received"
            << (received.empty() ? ": none of its processes runs here" : received) << '\n';
  return kOk;
}

}  // namespace

void registerStatus(CLI::App& app, int& exit_code) {
  auto follow = std::make_shared<bool>(false);
  auto check = std::make_shared<bool>(false);
  auto deployment = std::make_shared<std::string>(runtime::defaultDeployment());
  auto wait = std::make_shared<double>(5.0);
  auto as_json = std::make_shared<bool>(false);
  CLI::App* status = app.add_subcommand("status", "states, errors, loop statistics and guards of a running system");
  status->add_option("deployment,-d,--deployment", *deployment, "deployment file or preset")->capture_default_str();
  status->add_option("--wait", *wait, "how long the command waits for a running system, s")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 3600.0));
  status->add_flag("--json", *as_json, "JSON instead of text");
  status->callback([=, &exit_code] {
    guarded(exit_code,
            [&] { return *check ? runCheck(*deployment, *wait) : run(*deployment, *wait, *as_json, *follow); });
  });
  auto* again = status->add_flag("-f,--follow", *follow,
                                 "a table on a terminal, renewed until Ctrl-C; with --json one line per update");
  status
      ->add_flag(
          "--check", *check,
          "health check: exit code 0 if messages of all processes of this host are received within --wait, else 1")
      ->excludes(again);
  status->footer(legend({"gate", "guards", "restricted"}));
}

}  // namespace tandem::cli
