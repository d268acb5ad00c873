// SPDX-License-Identifier: Apache-2.0
/** @file tandem can monitor: the axes of a running tandem-hal, live. */
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "config/arm_names.h"
#include "config/robot_files.h"
#include "hal/arm_hardware.h"
#include "safety/operating_state.h"
#include "services/cli/can/can.h"
#include "services/client/client.h"
#include "services/client/diagnostic_details.h"
#include "services/client/lost_protections.h"
#include "services/runtime/diagnostics.h"
#include "services/runtime/process.h"
#include "services/runtime/stop_signal.h"

namespace tandem::cli {
namespace {

struct MonitorCommand {
  std::string deployment = runtime::defaultDeployment();
  bool json = false, once = false;
};

using Json = nlohmann::ordered_json;

std::string stateText(const dds::HalStatus& hal, std::size_t i) {
  const auto phase = static_cast<hal::AxisPhase>(hal.axis_phase[i]);
  return phase == hal::AxisPhase::kReady ? std::string(name(static_cast<hal::DriveState>(hal.axis_state[i])))
                                         : std::string(name(phase));
}

Json axisJson(const client::Snapshot& s, const config::Arm& arm, std::size_t k, std::size_t j) {
  const std::size_t i = dds::jointIndex(static_cast<int>(k), static_cast<int>(j));
  Json json{{"arm", arm.name},
            {"joint", arm.joint_names[j]},
            {"unit", arm.limits.isTranslation(static_cast<int>(j)) ? "m" : "rad"},
            {"state", stateText(s.hal, i)},
            {"position", s.state.position[i]},
            {"velocity", s.state.velocity[i]},
            {"setpoint", s.state.setpoint[i]},
            {"following_error", s.hal.following_error[i]},
            {"encoder_difference", s.hal.encoder_difference[i]}};
  json["temperature"] = std::isfinite(s.hal.axis_temperature[i]) ? Json(s.hal.axis_temperature[i]) : Json();
  json["limit_switch"] = name(static_cast<hal::LimitSwitch>(s.hal.axis_limit_switch[i]));
  json["guards"] = hal::describeGuards(s.hal.axis_guards[i]);
  // A node whose boot was refused has sent no error.
  const bool failed = static_cast<hal::AxisPhase>(s.hal.axis_phase[i]) == hal::AxisPhase::kFailed;
  json["operational"] = !failed;
  json["last_error"] = failed && s.hal.axis_error[i] == 0 ? "not operational: its boot was refused, or it was lost"
                                                          : hal::describeErrorCode(s.hal.axis_error[i]);
  return json;
}

/// `diagnostics` come once a second: those of a robot with a failed node are not there yet.
bool misses(const client::Snapshot& s) {
  const auto failed = [](auto phase) { return static_cast<hal::AxisPhase>(phase) == hal::AxisPhase::kFailed; };
  return std::ranges::any_of(s.hal.axis_phase, failed) && client::diagnosticDetails(s, runtime::kFailedKey).empty();
}

Json monitorJson(const config::Robot& robot, const client::Snapshot& s) {
  Json json{{"arms", Json::array()}, {"axes", Json::array()}, {"buses", Json::array()}, {"guards", Json::object()}};
  for (std::size_t k = 0; k < std::min<std::size_t>(s.hal.arm_count, robot.arms.size()); ++k) {
    json["arms"].push_back({{"name", robot.arms[k].name},
                            {"state", safety::name(static_cast<safety::OperatingState>(s.hal.operating_state[k]))},
                            {"faults", safety::describeFaults(s.hal.faults[k])},
                            {"homed", s.hal.homed[k] != 0},
                            {"power", hal::name(static_cast<hal::ArmPower>(s.hal.power[k]))}});
    for (std::size_t j = 0; j < s.state.joint_count[k]; ++j)
      json["axes"].push_back(axisJson(s, robot.arms[k], k, j));
  }
  for (std::size_t b = 0; b < s.hal.bus_count; ++b) {
    json["buses"].push_back({{"state", name(static_cast<hal::can::BusState>(s.hal.bus_state[b]))},
                             {"load", s.hal.bus_loads[b]},
                             {"success", s.hal.bus_success[b]},
                             {"dropped", s.hal.bus_dropped[b]},
                             {"overflow", s.hal.bus_overflow[b]}});
  }
  for (int g = 0; g < hal::kHardwareGuardCount; ++g) {
    const auto i = static_cast<std::size_t>(g);
    json["guards"][std::string(hal::name(static_cast<hal::HardwareGuard>(g)))] = s.hal.hardware_count[i];
  }
  json["failed"] = client::diagnosticDetails(s, runtime::kFailedKey);
  json["lost_protections"] = client::lostProtections(robot, s.hal);
  json["period_s"] = s.hal.period;
  json["jitter_max_s"] = s.hal.jitter_max;
  json["overruns"] = s.hal.overruns;
  return json;
}

std::string line(const char* format, auto... values) {
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

std::string monitorText(const Json& json) {
  std::string text;
  for (const Json& arm : json["arms"]) {
    text += arm["name"].get<std::string>() + ": " + arm["state"].get<std::string>() + ", drives " +
            arm["power"].get<std::string>() + (arm["homed"].get<bool>() ? "" : ", NOT HOMED") +
            ", faults: " + arm["faults"].get<std::string>() + "\n";
  }
  text += line("%-8s %-8s %-22s %13s %10s %10s %6s %-6s  %s\n", "arm", "joint", "state", "position", "follow",
               "encoder", "deg C", "switch", "guards; last error");
  for (const Json& axis : json["axes"]) {
    const bool translation = axis["unit"] == "m";
    const double scale = translation ? 1e3 : 180.0 / std::numbers::pi;
    const std::string temperature =
        axis["temperature"].is_null() ? "" : line("%.0f", axis["temperature"].get<double>());
    text += line("%-8s %-8s %-22s %9.4f %-3s %10.4f %10.4f %6s %-6s  %s; %s\n", axis["arm"].get<std::string>().c_str(),
                 axis["joint"].get<std::string>().c_str(), axis["state"].get<std::string>().c_str(),
                 scale * axis["position"].get<double>(), translation ? "mm" : "deg",
                 scale * axis["following_error"].get<double>(), scale * axis["encoder_difference"].get<double>(),
                 temperature.c_str(), axis["limit_switch"].get<std::string>().c_str(),
                 axis["guards"].get<std::string>().c_str(), axis["last_error"].get<std::string>().c_str());
  }
  int number = 0;
  for (const Json& bus : json["buses"]) {
    text += line(
        "bus %d: %s, load %.1f %% (frames of the last second, most stuff bits), arrived of the last 100 %.0f, dropped "
        "%llu, overflow %llu\n",
        ++number, bus["state"].get<std::string>().c_str(), 100.0 * bus["load"].get<double>(),
        100.0 * bus["success"].get<double>(), static_cast<unsigned long long>(bus["dropped"].get<std::uint64_t>()),
        static_cast<unsigned long long>(bus["overflow"].get<std::uint64_t>()));
  }
  text += client::describeFailed(json["failed"], "");
  text += "guards since start:";
  for (const auto& [guard, count] : json["guards"].items()) {
    if (count.get<std::uint64_t>() > 0)
      text += " " + guard + " " + std::to_string(count.get<std::uint64_t>());
  }
  return text + "\n" + client::describeLost(json["lost_protections"], "");
}

int monitor(const MonitorCommand& options) {
  runtime::StopSignal stop;
  const config::Deployment deployment = runtime::loadDeployment(options.deployment);
  const config::Robot robot = config::loadAnyRobot(deployment);
  client::Client client(deployment);
  client.setInterrupt([&] { return stop.requested(); });
  const bool live = !options.once && !options.json && isatty(STDOUT_FILENO) != 0;
  if (!client.waitFor(5.0, [](const client::Snapshot& s) { return s.states > 0 && s.hals > 0; })) {
    if (stop.requested())
      return kOk;
    throw Failure(kFailure, "no messages from tandem-hal; check that `tandem up` is running");
  }
  if (client.snapshot().hal.bus_count == 0)
    throw Failure(kFailure, "no CAN buses: tandem-sim is running, not tandem-hal; use `tandem status`");
  constexpr double kRefresh = 0.2, kDiagnostics = 2.5;  // s
  client.waitFor(kDiagnostics, [](const client::Snapshot& s) { return !misses(s); });
  do {
    const Json json = monitorJson(robot, client.snapshot());
    if (live)
      std::cout << "\x1b[H\x1b[J";
    std::cout << (options.json ? json.dump() + "\n" : monitorText(json)) << std::flush;
  } while (!options.once && !stop.waitFor(kRefresh));
  return kOk;
}

}  // namespace

void registerCanMonitor(CLI::App& can, int& exit_code) {
  auto options = std::make_shared<MonitorCommand>();
  CLI::App* command =
      can.add_subcommand("monitor", "axes of a running tandem-hal: states, positions, temperatures, faults");
  command->add_option("deployment,-d,--deployment", options->deployment, "deployment file or preset")
      ->capture_default_str();
  command->add_flag("--json", options->json, "one JSON object per line");
  command->add_flag("--once", options->once, "print once and exit");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return monitor(*options); }); });
}

}  // namespace tandem::cli
