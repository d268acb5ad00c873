// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/drive_shell.h"

#include <spdlog/spdlog.h>

#include "operation/convert.h"
#include "services/runtime/clock_request_handler.h"

namespace tandem::runtime {

void diagnose(Diagnostics& diagnostics, const config::Robot& robot, const dds::HalStatus& status, const Details& more) {
  std::string faults;
  std::uint64_t actions = 0;
  for (int k = 0; k < status.arm_count; ++k) {
    if (status.faults[static_cast<std::size_t>(k)] != 0)
      faults += (faults.empty() ? "" : "; ") + describe(robot, {k, dds::faultRecordOf(status, k)});
  }
  for (const std::uint64_t count : status.guard_count)
    actions += count;
  Details values{{"gate_actions", std::to_string(actions)},
                 {"command_success", fmt::format("{:.2f}", status.command_success)},
                 {"overruns", std::to_string(status.overruns)},
                 {"periods_caught_up", std::to_string(status.caught_up)},
                 {"periods_left_out", std::to_string(status.left_out)}};
  values.insert(values.end(), more.begin(), more.end());
  using Level = Diagnostics::Level;
  diagnostics.publish(status.stamp, faults.empty() ? Level::kOk : Level::kError,
                      faults.empty() ? "ok" : "FAULT of " + faults, std::move(values));
}

DriveShell::DriveShell(const Setup& setup, double period, std::function<Details(const dds::HalStatus&)> details)
    : RealtimeShell(setup, period),
      setup_(setup),
      bus_(busOptions(setup.deployment, setup.name)),
      states_(bus_.writer(dds::kActuationState)),
      statuses_(bus_.writer(dds::kHalStatus)),
      diagnostics_(bus_, setup),
      cycle_log_(setup),
      details_(std::move(details)),
      state_out_(outbox().latest<dds::ActuationState>([this](const auto& m) { states_.write(m); })),
      status_out_(publisher().latest<dds::HalStatus>([this](const auto& m) {
        statuses_.write(m);
        diagnose(diagnostics_, setup_.robot, m, details_(m));
      })) {}

void DriveShell::refuseMismatches(std::function<void(const dds::Reply&)> answer) {
  mismatches_.emplace(bus_, std::move(answer), [this] { mismatch_ = true; });
}

void DriveShell::run(const std::string& what, const std::function<bool(const Tick&)>& cycle) {
  const auto commands =
      bus_.reader(dds::kActuationCommand, [this](const dds::ActuationCommand& m) { commands_.store(m); });
  const auto stops = bus_.reader(dds::kStop, [this](const dds::Stop& m) {
    spdlog::error("stop: {}", m.reason);
    stop_requested_ = true;
  });
  std::optional<dds::Reader> emergencies;
  if (setup_.deployment.emergency_stop_budget > 0.0)
    emergencies = bus_.reader(dds::kEmergencyStop, [this](const dds::Bool& m) { onEmergencyStop(m.data); });
  const ClockRequestHandler clock(bus_, setup_);
  RealtimeShell::run(what, cycle);
}

void DriveShell::onEmergencyStop(bool pressed) noexcept {
  if (pressed) {
    emergency_ = EmergencyReport::kPressed;
    return;
  }
  EmergencyReport nothing = EmergencyReport::kNone;
  emergency_.compare_exchange_strong(nothing, EmergencyReport::kReleased);  // keeps a press not taken yet
}

void DriveShell::logCycle(const Tick& tick) noexcept {
  cycle_.tick = tick;
  cycle_.command = commands_.value();
  cycle_.state = state_;
  cycle_log_.post(cycle_);
}

void DriveShell::writeLoop() noexcept {
  const LoopStatistics& measured = loop().statistics();
  status_.period = loop().period();
  status_.jitter_max = measured.lateness_max;
  status_.cycles = measured.cycles;
  status_.overruns = measured.overruns;
  status_.left_out = measured.skipped;  // overwritten by a core that catches up on missed periods
}

}  // namespace tandem::runtime
