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

/** The loop, the threads that publish for it, the heartbeat, and the log of faults. What a service does in a cycle is
 * its own. */
class RealtimeShell {
 public:
  /// @param period  s
  RealtimeShell(const Setup& setup, double period);

  /// What the robot waits for; channels are opened before run().
  Outbox& outbox() noexcept { return outbox_; }
  /// What people wait for.
  Outbox& publisher() noexcept { return publisher_; }
  const PeriodicLoop& loop() const noexcept { return loop_; }
  /// Whether people learn of this cycle: once in a status_period.
  bool isStatusCycle(const Tick& tick) const noexcept { return tick.cycle % status_interval_ == 0; }

  /// Behind what a cycle has posted: the loop lives, and which arms have a new fault. `core` knows faultRecord(arm).
  template <class Core>
  void close(const Core& core, int arm_count) noexcept {
    beats_.post(loop_.statistics());
    watch_.look(core, arm_count, [this](FaultReport report) {
      report.late = late_;
      faults_.post(report);
    });
  }

  /** Runs cycles in the calling thread, as a real-time one, until one returns false. Readers, and all threads that
   * shall not be real-time ones, are there already. @param what  is ready, for the log */
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
  double late_ = 0.0;            ///< s, the most of the last seconds
  std::int64_t late_since_ = 0;  ///< ns
};

}  // namespace tandem::runtime
