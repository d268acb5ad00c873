// SPDX-License-Identifier: Apache-2.0
#include "services/setup/actuation.h"

#include "services/common/periodic_loop.h"

namespace tandem::service {

void readCommand(const dds::ActuationCommand& from, double age, safety::RobotCommand& command) noexcept {
  command.head.session = from.control_session;
  command.head.sequence = from.sequence;
  command.head.arm_count = from.arm_count;
  command.head.age = age;
  for (std::size_t k = 0; k < safety::kMaxArms; ++k) {
    const bool known = from.request[k] <= static_cast<std::uint8_t>(safety::DriveRequest::kRecover);
    command.request[k] = known ? static_cast<safety::DriveRequest>(from.request[k]) : safety::DriveRequest::kKeep;
    command.without[k] = from.without[k];
    command.unseen[k] = false;
    command.moving[k] = from.moving[k] != 0;
  }
  command.velocity = from.velocity;
  command.position = from.position;
}

std::optional<dds::Reader> listenForEmergencyStop(dds::Bus& bus, const Setup& setup, std::atomic<std::uint8_t>& told) {
  if (setup.deployment.emergency_stop_budget <= 0.0)
    return std::nullopt;
  return bus.reader(dds::kEmergencyStop, [&told](const dds::Bool& m) {
    if (m.data) {
      told = kPressedReport;
      return;
    }
    std::uint8_t nothing = 0;
    told.compare_exchange_strong(nothing, kReleasedReport);  // a press that nobody has taken yet is not lost
  });
}

void writeLoop(const PeriodicLoop& loop, dds::HalStatus& status) noexcept {
  const LoopStatistics& measured = loop.statistics();
  status.period = loop.period();
  status.jitter_max = measured.lateness_max;
  status.cycles = measured.cycles;
  status.overruns = measured.overruns;
}

void diagnose(Diagnostics& diagnostics,
              const config::Robot& robot,
              const dds::HalStatus& status,
              std::vector<std::pair<std::string, std::string>> more) {
  std::string faults;
  std::uint64_t actions = 0;
  for (int k = 0; k < status.arm_count; ++k) {
    if (status.faults[static_cast<std::size_t>(k)] != 0)
      faults += (faults.empty() ? "" : "; ") + describe(robot, {k, dds::faultRecordOf(status, k)});
  }
  for (const std::uint64_t count : status.guard_count)
    actions += count;
  std::vector<std::pair<std::string, std::string>> values{{"gate_actions", std::to_string(actions)},
                                                          {"overruns", std::to_string(status.overruns)},
                                                          {"periods_caught_up", std::to_string(status.caught_up)},
                                                          {"periods_left_out", std::to_string(status.left_out)}};
  values.insert(values.end(), more.begin(), more.end());
  using Level = Diagnostics::Level;
  diagnostics.publish(monotonicNow(), status.stamp, faults.empty() ? Level::kOk : Level::kError,
                      faults.empty() ? "ok" : "FAULT of " + faults, std::move(values));
}

}  // namespace tandem::service
