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

/** What a loop measured of itself since its start; constant memory. Times in s. */
struct LoopStatistics {
  std::uint64_t cycles = 0;    ///< bodies run
  std::uint64_t overruns = 0;  ///< cycles that ended after the next one was due
  std::uint64_t skipped = 0;   ///< periods left out for that
  double lateness_max = 0.0;   ///< wake-up after its scheduled time
  double lateness_mean = 0.0;
  double execution_last = 0.0;  ///< of the body
  double execution_max = 0.0;
  double execution_mean = 0.0;
};

/** One cycle, as the body sees it. */
struct Tick {
  std::uint64_t cycle = 0;     ///< counts from 1
  std::int64_t scheduled = 0;  ///< ns, when it was due
  std::int64_t now = 0;        ///< ns, when it began
  std::uint64_t skipped = 0;   ///< periods skipped since the cycle before
};

/** Asks the kernel for SCHED_FIFO at this priority for the calling thread (0: leaves it alone), and for the process's
 * memory to stay in RAM. Threads created later inherit the priority: create the others first.
 * @return what was refused, for people, with what would allow it; empty if all was granted. */
std::vector<std::string> enterRealtime(int priority, bool lock_memory);

/** Runs a body every period at start + k * period. After a cycle that ends late, periods that lie wholly in the past
 * are left out and counted: the grid never shifts, and no burst makes up for lost time. */
class PeriodicLoop {
 public:
  /// @param period s. @throw std::invalid_argument unless 10 us <= period <= 60 s.
  explicit PeriodicLoop(double period);

  /// Runs in the calling thread until the body returns false. The body must not throw.
  void run(const std::function<bool(const Tick&)>& body);

  /// Of the loop's own thread while it runs; complete up to the previous cycle.
  const LoopStatistics& statistics() const { return statistics_; }
  double period() const { return static_cast<double>(period_) * 1e-9; }

 private:
  void account(const Tick& tick, std::int64_t end);

  std::int64_t period_;  // ns
  LoopStatistics statistics_;
};

}  // namespace tandem::runtime
