// SPDX-License-Identifier: Apache-2.0
/** @file Checks of `tandem doctor`: each examines one property of the PC and gives advice. */
#pragma once

#include <string>
#include <vector>

#include "config/config.h"

namespace tandem::cli {

/** Result of one check. */
struct Finding {
  enum class Level { kGood, kWarning, kBad };
  std::string subject;  ///< kernel, timer, network, ...
  Level level = Level::kGood;
  std::string found;
  std::string advice;  ///< remedy; empty if none is needed
};

/// Kernel and processor: preemption, cores, frequency governor.
std::vector<Finding> checkMachine(const config::Deployment& deployment);

/// Scheduler and memory rights that the deployment requires, and whether this user has them.
std::vector<Finding> checkRights(const config::Deployment& deployment);

/// Resolution, source and, with several hosts, discipline of the clocks.
std::vector<Finding> checkClock(const config::Deployment& deployment);

/** Lateness of the wake-ups of a periodic thread, s. */
struct TimerLatency {
  double period = 0.0;  ///< s
  double median = 0.0, p99 = 0.0, max = 0.0;
  int cycles = 0;
  int late = 0;  ///< wake-ups late by more than a period
};

/// Shortest period of this deployment, s: of control, the simulator or the hardware.
double shortestPeriod(const config::Deployment& deployment);

/// Wakes up every period for some seconds, with the deployment's scheduling, while all cores are loaded.
TimerLatency measureTimer(double period, int priority, bool lock_memory, double seconds);
/// With a simulated robot, late wake-ups are a warning at most: the simulator catches up with missed periods.
Finding judgeTimer(const TimerLatency& latency, const config::Deployment& deployment);

/// Addresses, socket buffers, and a round trip between two participants of this process.
std::vector<Finding> checkNetwork(const config::Deployment& deployment);

/// Credentials of the deployment, or the consequences of having none.
std::vector<Finding> checkSecurity(const config::Deployment& deployment);

/// CAN interfaces of the hardware file; without one, whether this PC could have any.
std::vector<Finding> checkCan(const config::Deployment& deployment);

}  // namespace tandem::cli
