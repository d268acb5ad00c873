// SPDX-License-Identifier: Apache-2.0
/** @file Percentiles of call durations. */
#pragma once

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <vector>

namespace tandem::bench {

/// Percentiles of times, us, as counters of a benchmark.
inline void reportPercentiles(benchmark::State& state, std::vector<double> times) {
  std::sort(times.begin(), times.end());
  const auto at = [&](double part) {
    return times[static_cast<std::size_t>(part * static_cast<double>(times.size() - 1))];
  };
  state.counters["p50"] = at(0.5);
  state.counters["p90"] = at(0.9);
  state.counters["p99"] = at(0.99);
  state.counters["p999"] = at(0.999);
  state.counters["max"] = at(1.0);
}

/// Processor time of this thread, s.
inline double processorTime() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Times every call separately. Passes repeat the same work, and the best time of each call counts, which excludes
/// other load of the machine. Percentiles are over the calls, us.
class Percentiles {
 public:
  explicit Percentiles(std::size_t calls) : times_(calls, std::numeric_limits<double>::infinity()) {}

  /// Times a call that computes without waiting: processor time counts if another process was scheduled in between.
  /// @return seconds
  template <class Call>
  double time(std::size_t index, const Call& call) {
    const double before = processorTime();
    const double elapsed = timeElapsed(index, call);
    const double seconds = std::min(elapsed, processorTime() - before);
    times_[index] = std::min(times_[index], 1e6 * seconds);
    return seconds;
  }

  /// Times a call that waits for other processes. @return seconds
  template <class Call>
  double timeElapsed(std::size_t index, const Call& call) {
    const auto begin = std::chrono::steady_clock::now();
    call();
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    times_[index] = std::min(times_[index], 1e6 * seconds);
    return seconds;
  }

  void report(benchmark::State& state) {
    std::erase_if(times_, [](double time) { return !std::isfinite(time); });  // starts of paths
    reportPercentiles(state, times_);
  }

 private:
  std::vector<double> times_;
};

}  // namespace tandem::bench
