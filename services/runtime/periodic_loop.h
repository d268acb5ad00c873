// SPDX-License-Identifier: Apache-2.0
/** @file The periodic loop: one thread on an absolute monotonic timer. */
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace tandem::runtime {

/// ns on CLOCK_MONOTONIC.
std::int64_t monotonicNow();

/** Timing statistics of a loop since its start; constant memory. Times in s. */
struct LoopStatistics {
  std::uint64_t cycles = 0;    ///< bodies run
  std::uint64_t overruns = 0;  ///< cycles that ended after the next one was due
  std::uint64_t skipped = 0;   ///< periods skipped because of overruns
  double lateness_max = 0.0;   ///< delay of the wake-up after its scheduled time
  double lateness_mean = 0.0;
  double execution_last = 0.0;  ///< of the body
  double execution_max = 0.0;
  double execution_mean = 0.0;
};

/** One cycle, argument of the loop body. */
struct Tick {
  std::uint64_t cycle = 0;     ///< counts from 1
  std::int64_t scheduled = 0;  ///< ns, scheduled start
  std::int64_t now = 0;        ///< ns, actual start
  std::uint64_t skipped = 0;   ///< periods skipped since the cycle before
};

/** Requests SCHED_FIFO with this priority for the calling thread (0: no change), and optionally locks the memory of the
 * process in RAM. Threads created later inherit the priority: create ordinary threads before.
 * @return descriptions of refused requests, each with the missing privilege; empty if all were granted. */
std::vector<std::string> enterRealtime(int priority, bool lock_memory);

/** Runs a body every period at start + k * period. After a cycle that ends late, periods that lie completely in the
 * past are skipped and counted: the time grid never shifts, and skipped periods are not caught up in a burst. */
class PeriodicLoop {
 public:
  /// @param period s. @throw std::invalid_argument unless 10 us <= period <= 60 s.
  explicit PeriodicLoop(double period);

  /// Runs in the calling thread until the body returns false. The body must not throw.
  void run(const std::function<bool(const Tick&)>& body);

  /// While the loop runs, only for its own thread; complete up to the previous cycle.
  const LoopStatistics& statistics() const { return statistics_; }
  double period() const { return static_cast<double>(period_) * 1e-9; }

 private:
  void account(const Tick& tick, std::int64_t end);

  std::int64_t period_;  // ns
  LoopStatistics statistics_;
};

}  // namespace tandem::runtime
