// SPDX-License-Identifier: Apache-2.0
/** @file Threads of hal and sim in real time: transfer of the actuation topics between DDS and the periodic thread. */
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>

#include "services/dds/bus.h"
#include "services/runtime/cycle_log.h"
#include "services/runtime/diagnostics.h"
#include "services/runtime/identity.h"
#include "services/runtime/latest_value.h"
#include "services/runtime/realtime_shell.h"

namespace tandem::runtime {

/// Publishes the service's status on `diagnostics`, with the additional values `more`. For publisher threads.
void diagnose(Diagnostics& diagnostics, const config::Robot& robot, const dds::HalStatus& status, const Details& more);

/** Passes commands and stops to the core of hal or sim, and publishes its state. A cycle calls take() before and show()
 * after it moves the drives. */
class DriveShell : public RealtimeShell {
 public:
  /// @param period  s
  /// @param details  additional values for `diagnostics`, called with each published status on the publisher's thread
  DriveShell(const Setup& setup, double period, std::function<Details(const dds::HalStatus&)> details);

  /// For further topics of the service.
  dds::Bus& bus() noexcept { return bus_; }
  /// Refuses messages of other robots or deployments; to be called before the first reader of requests is created.
  /// @param answer  sends the reply to such a request, on DDS threads
  void refuseMismatches(std::function<void(const dds::Reply&)> answer);

  /// Passes the messages received since the last cycle to the core.
  template <class Core>
  void take(Core& core, std::int64_t now) noexcept {
    cycle_.taken = commands_.take();
    if (cycle_.taken)
      core.onCommand(commands_.value(), now, commands_.arrivals());
    cycle_.stop = stop_requested_.exchange(false, std::memory_order_relaxed);
    if (cycle_.stop)
      core.onStop();
    if (mismatch_.exchange(false, std::memory_order_relaxed))
      core.onMismatch();
    if (const EmergencyReport reported = emergency_.exchange(EmergencyReport::kNone, std::memory_order_relaxed);
        reported != EmergencyReport::kNone)
      core.onEmergencyStop(reported == EmergencyReport::kPressed, now);
  }

  /// Publishes the result of the cycle.
  template <class Core>
  void show(Core& core, const Tick& tick) noexcept {
    core.state(tick.now, state_);
    state_out_.post(state_);
    if (cycle_log_.on())
      logCycle(tick);
    close(core, core.armCount());
    if (!isStatusCycle(tick))
      return;
    writeLoop();
    core.status(status_);
    status_out_.post(status_);
  }

  /// Creates the readers of commands and stops, then as RealtimeShell::run().
  void run(const std::string& what, const std::function<bool(const Tick&)>& cycle);

 private:
  /// Last report on topic emergency_stop, from its reader to the periodic thread.
  enum class EmergencyReport : std::uint8_t { kNone = 0, kReleased, kPressed };

  void onEmergencyStop(bool pressed) noexcept;
  void writeLoop() noexcept;
  void logCycle(const Tick& tick) noexcept;

  const Setup& setup_;
  dds::Bus bus_;
  dds::Writer<dds::ActuationState> states_;
  dds::Writer<dds::HalStatus> statuses_;
  Diagnostics diagnostics_;
  CycleLog<DriveCycle> cycle_log_;
  std::function<Details(const dds::HalStatus&)> details_;
  std::optional<MismatchHandler> mismatches_;
  Outbox::Latest<dds::ActuationState>& state_out_;
  Outbox::Latest<dds::HalStatus>& status_out_;
  LatestSample<dds::ActuationCommand> commands_;
  std::atomic<bool> stop_requested_{false}, mismatch_{false};
  std::atomic<EmergencyReport> emergency_{EmergencyReport::kNone};
  dds::ActuationState state_;
  dds::HalStatus status_;
  DriveCycle cycle_;
};

}  // namespace tandem::runtime
