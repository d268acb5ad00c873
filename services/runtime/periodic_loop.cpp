// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/periodic_loop.h"

#include <sched.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <ctime>
#include <stdexcept>

namespace tandem::runtime {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

double seconds(std::int64_t nanoseconds) { return static_cast<double>(nanoseconds) * 1e-9; }

void sleepUntil(std::int64_t when) {
  const timespec due{static_cast<time_t>(when / kSecond), static_cast<long>(when % kSecond)};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr) == EINTR) {
  }
}

}  // namespace

std::int64_t monotonicNow() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * kSecond + now.tv_nsec;
}

std::vector<std::string> enterRealtime(int priority, bool lock_memory) {
  std::vector<std::string> refused;
  if (lock_memory && mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    refused.push_back(std::string("memory is not locked: ") + std::strerror(errno) +
                      " (needs CAP_IPC_LOCK or a higher RLIMIT_MEMLOCK)");
  }
  if (priority != 0) {
    sched_param parameters{};
    parameters.sched_priority = priority;
    if (sched_setscheduler(0, SCHED_FIFO, &parameters) != 0) {
      refused.push_back("no real-time priority " + std::to_string(priority) + ": " + std::strerror(errno) +
                        " (1 to 99, needs CAP_SYS_NICE or a higher RLIMIT_RTPRIO)");
    }
  }
  return refused;
}

PeriodicLoop::PeriodicLoop(double period) : period_(0) {
  if (!(period >= 10e-6 && period <= 60.0)) {
    throw std::invalid_argument("period of a loop: " + std::to_string(period) + " s, expected 10e-6 to 60");
  }
  period_ = static_cast<std::int64_t>(std::llround(period * 1e9));
}

void PeriodicLoop::run(const std::function<bool(const Tick&)>& body) {
  statistics_ = {};
  Tick tick;
  tick.scheduled = monotonicNow();
  bool running = true;
  while (running) {
    ++tick.cycle;
    tick.now = monotonicNow();
    running = body(tick);
    const std::int64_t end = monotonicNow();
    account(tick, end);
    const std::int64_t passed = std::max<std::int64_t>(0, (end - tick.scheduled) / period_ - 1);
    tick.skipped = static_cast<std::uint64_t>(passed);
    tick.scheduled += (1 + passed) * period_;
    if (running) {
      statistics_.skipped += tick.skipped;
      sleepUntil(tick.scheduled);
    }
  }
}

void PeriodicLoop::account(const Tick& tick, std::int64_t end) {
  LoopStatistics& s = statistics_;
  ++s.cycles;
  s.overruns += end - tick.scheduled > period_ ? 1 : 0;
  const double lateness = seconds(tick.now - tick.scheduled);
  s.execution_last = seconds(end - tick.now);
  s.lateness_max = std::max(s.lateness_max, lateness);
  s.execution_max = std::max(s.execution_max, s.execution_last);
  const auto count = static_cast<double>(s.cycles);
  s.lateness_mean += (lateness - s.lateness_mean) / count;
  s.execution_mean += (s.execution_last - s.execution_mean) / count;
}

}  // namespace tandem::runtime
