// SPDX-License-Identifier: Apache-2.0
#include <sched.h>
#include <sys/resource.h>
#include <sys/timex.h>
#include <sys/utsname.h>
#include <time.h>

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <thread>

#include "services/cli/deployment/doctor_checks.h"
#include "services/runtime/periodic_loop.h"

namespace tandem::cli {
namespace {

using Level = Finding::Level;

/// First line of a kernel file; empty if the file does not exist.
std::string lineOf(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

/// Threads that load all cores.
class Load {
 public:
  Load() {
    for (unsigned k = 0; k < std::max(1u, std::thread::hardware_concurrency()); ++k) {
      threads_.emplace_back([this] {
        for (volatile double x = 1.0; !ended_.load(std::memory_order_relaxed);)
          x = x * 1.0000001;
      });
    }
  }
  ~Load() {
    ended_ = true;
    for (std::thread& thread : threads_)
      thread.join();
  }
  Load(const Load&) = delete;
  Load& operator=(const Load&) = delete;

 private:
  std::atomic<bool> ended_{false};
  std::vector<std::thread> threads_;
};

}  // namespace

std::vector<Finding> checkMachine(const config::Deployment& deployment) {
  std::vector<Finding> findings;
  utsname system{};
  uname(&system);
  const std::string version = system.version;
  const bool real_time = lineOf("/sys/kernel/realtime") == "1" || version.find("PREEMPT_RT") != std::string::npos;
  Finding kernel{"kernel", Level::kGood, fmt::format("{} {}", system.sysname, system.release), ""};
  kernel.found += real_time ? ", PREEMPT_RT" : ", not a PREEMPT_RT kernel";
  if (!real_time && deployment.realtime_priority > 0) {
    kernel.level = Level::kWarning;
    kernel.advice = "the deployment requests real-time scheduling: install linux-image-rt-amd64 where deadlines matter";
  }
  findings.push_back(kernel);

  const unsigned cores = std::thread::hardware_concurrency();
  findings.push_back({"cores", cores >= 2 ? Level::kGood : Level::kWarning, fmt::format("{}", cores),
                      cores >= 2 ? "" : "simulator, control and planning share one core: expect late cycles"});
  const std::string governor = lineOf("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
  if (!governor.empty()) {
    const bool steady = governor == "performance";
    findings.push_back({"frequency", steady ? Level::kGood : Level::kWarning, "governor " + governor,
                        steady ? "" : "cpupower frequency-set -g performance"});
  }
  return findings;
}

std::vector<Finding> checkRights(const config::Deployment& deployment) {
  if (deployment.realtime_priority == 0 && !deployment.lock_memory)
    return {{"rights", Level::kGood, "the deployment requests default scheduling and no locked memory", ""}};
  std::vector<std::string> refused;
  std::thread probe([&] { refused = runtime::enterRealtime(deployment.realtime_priority, deployment.lock_memory); });
  probe.join();
  if (refused.empty())
    return {{"rights", Level::kGood,
             fmt::format("SCHED_FIFO {}{}", deployment.realtime_priority,
                         deployment.lock_memory ? " and locked memory are granted" : " is granted"),
             ""}};
  std::vector<Finding> findings;
  for (const std::string& what : refused)
    findings.push_back({"rights", Level::kBad, what,
                        "as root: set rtprio and memlock for your user in /etc/security/limits.d, then log in again"});
  return findings;
}

std::vector<Finding> checkClock(const config::Deployment& deployment) {
  std::vector<Finding> findings;
  timespec resolution{};
  clock_getres(CLOCK_MONOTONIC, &resolution);
  const std::string source = lineOf("/sys/devices/system/clocksource/clocksource0/current_clocksource");
  const bool slow = source == "hpet" || source == "acpi_pm" || source == "jiffies";
  findings.push_back({"clock", slow ? Level::kWarning : Level::kGood,
                      fmt::format("source {}, resolution {} ns", source.empty() ? "unknown" : source,
                                  resolution.tv_nsec + 1'000'000'000 * resolution.tv_sec),
                      slow ? "reading this clock takes microseconds; dmesg says why the kernel does not use tsc" : ""});
  if (!deployment.hosts.empty()) {
    timex state{};
    const bool disciplined = adjtimex(&state) != TIME_ERROR;
    findings.push_back({"clock", disciplined ? Level::kGood : Level::kWarning,
                        disciplined ? "disciplined by NTP or PTP" : "not synchronised",
                        disciplined ? "" : "needed only to compare recordings of two hosts: install chrony"});
  }
  return findings;
}

TimerLatency measureTimer(double period, int priority, bool lock_memory, double seconds) {
  TimerLatency result;
  result.period = period;
  std::vector<double> lateness;
  lateness.reserve(static_cast<std::size_t>(seconds / period) + 2);
  const Load load;
  std::thread periodic([&] {
    runtime::enterRealtime(priority, lock_memory);
    const std::int64_t end = runtime::monotonicNow() + static_cast<std::int64_t>(1e9 * seconds);
    runtime::PeriodicLoop loop(period);
    loop.run([&](const runtime::Tick& tick) {
      if (lateness.size() < lateness.capacity())
        lateness.push_back(1e-9 * static_cast<double>(tick.now - tick.scheduled));
      return tick.now < end;
    });
  });
  periodic.join();
  std::sort(lateness.begin(), lateness.end());
  result.cycles = static_cast<int>(lateness.size());
  const auto at = [&](double part) { return lateness[static_cast<std::size_t>(part * (result.cycles - 1))]; };
  result.median = at(0.5);
  result.p99 = at(0.99);
  result.max = at(1.0);
  result.late =
      static_cast<int>(std::count_if(lateness.begin(), lateness.end(), [&](double value) { return value > period; }));
  return result;
}

Finding judgeTimer(const TimerLatency& latency, const config::Deployment& deployment) {
  Finding finding{
      "timer", Level::kGood,
      fmt::format("period {:g} ms, all cores busy: late by {:.0f} us (median), {:.0f} us (99 %), {:.0f} us "
                  "(largest of {})",
                  1e3 * latency.period, 1e6 * latency.median, 1e6 * latency.p99, 1e6 * latency.max, latency.cycles),
      ""};
  if (latency.late == 0 && latency.p99 <= 0.5 * latency.period)
    return finding;
  const bool many = latency.late > std::max(1, latency.cycles / 1000);
  finding.level = many && !deployment.hardware.empty() ? Level::kBad : Level::kWarning;
  finding.advice = deployment.realtime_priority == 0
                       ? "set realtime_priority and lock_memory in the deployment, or take a longer period"
                       : "use a PREEMPT_RT kernel, fewer other programs or isolcpus, or take a longer period";
  return finding;
}

}  // namespace tandem::cli
