// SPDX-License-Identifier: Apache-2.0
/** @file Threads of a real-time service: a periodic thread without DDS calls, and publisher threads. */
#pragma once

#include <algorithm>
#include <functional>
#include <string>

#include "services/runtime/fault_log.h"
#include "services/runtime/outbox.h"
#include "services/runtime/periodic_loop.h"
#include "services/runtime/process.h"

namespace tandem::runtime {

/** The periodic loop, its publisher threads, the heartbeat, and the fault log. The service supplies the body of a
 * cycle. */
class RealtimeShell {
 public:
  /// @param period  s
  RealtimeShell(const Setup& setup, double period);

  /// Publisher thread for messages between services; channels are opened before run().
  Outbox& outbox() noexcept { return outbox_; }
  /// Publisher thread for status messages and the log.
  Outbox& publisher() noexcept { return publisher_; }
  const PeriodicLoop& loop() const noexcept { return loop_; }
  /// Whether this cycle publishes status messages: once per status_period.
  bool isStatusCycle(const Tick& tick) const noexcept { return tick.cycle % status_interval_ == 0; }

  /// Posts heartbeat and new arm faults, after all other messages of a cycle. `core` has a function faultRecord(arm).
  template <class Core>
  void close(const Core& core, int arm_count) noexcept {
    beats_.post(loop_.statistics());
    watch_.look(core, arm_count, [this](FaultReport report) {
      report.late = late_;
      faults_.post(report);
    });
  }

  /** Runs cycles in the calling thread with real-time priority until one returns false. Create readers and all ordinary
   * threads before. @param what  description of the service, for the log */
  void run(const std::string& what, const std::function<bool(const Tick&)>& cycle);

 private:
  void noteLateness(const Tick& tick) noexcept;

  const Setup& setup_;
  PeriodicLoop loop_;
  std::uint64_t status_interval_;
  Outbox outbox_, publisher_;
  Outbox::Latest<LoopStatistics>& beats_;
  Outbox::Queue<FaultReport>& faults_;
  FaultWatch watch_;
  double late_ = 0.0;            ///< s, maximum of the last seconds
  std::int64_t late_since_ = 0;  ///< ns
};

}  // namespace tandem::runtime
