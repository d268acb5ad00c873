// SPDX-License-Identifier: Apache-2.0
/** @file Checks of `tandem doctor`: each examines one property of the PC and advises. */
#pragma once

#include <string>
#include <vector>

#include "config/config.h"

namespace tandem::cli {

/** What a check found. */
struct Finding {
  enum class Level { kGood, kWarning, kBad };
  std::string subject;  ///< kernel, timer, network, ...
  Level level = Level::kGood;
  std::string found;
  std::string advice;  ///< what to do about it; empty where nothing is
};

/// Kernel and processor: preemption, cores, frequency governor.
std::vector<Finding> checkMachine(const config::Deployment& deployment);

/// What the deployment asks of the scheduler and of memory, and whether this user gets it.
std::vector<Finding> checkRights(const config::Deployment& deployment);

/// Resolution, source and, with several hosts, discipline of the clocks.
std::vector<Finding> checkClock(const config::Deployment& deployment);

/** How late wake-ups of a periodic thread were, s. */
struct TimerLatency {
  double period = 0.0;  ///< s
  double median = 0.0, p99 = 0.0, max = 0.0;
  int cycles = 0;
  int late = 0;  ///< by more than a period
};

/// The shortest period of this deployment, s: control's, the simulator's or the hardware's.
double shortestPeriod(const config::Deployment& deployment);

/// Wakes up every period for some seconds, under the deployment's scheduling, while every core is kept busy.
TimerLatency measureTimer(double period, int priority, bool lock_memory, double seconds);
/// A simulated robot catches up with periods that it missed: late wake-ups are no more than a warning there.
Finding judgeTimer(const TimerLatency& latency, const config::Deployment& deployment);

/// Addresses, socket buffers, and a round trip between two participants of our own.
std::vector<Finding> checkNetwork(const config::Deployment& deployment);

/// The credentials of the deployment, or what it means that there are none.
std::vector<Finding> checkSecurity(const config::Deployment& deployment);

/// The CAN interfaces of the hardware file, or whether there could be any.
std::vector<Finding> checkCan(const config::Deployment& deployment);

}  // namespace tandem::cli
