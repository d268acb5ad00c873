// SPDX-License-Identifier: Apache-2.0
/** @file Watchdog time-outs of all processes. */
#pragma once

#include <algorithm>

namespace tandem::safety {

/** Time budgets, s. Larger values than these defaults require a reason in docs/safety.md. */
struct Budgets {
  double minimum_age = 0.030;         ///< lower bound of the age budget of a command or a state
  double age_periods = 3.0;           ///< the same budget in control periods; the larger one applies
  double planning_reference = 0.250;  ///< age of planning's reference, checked by control
  double teleoperation = 0.100;       ///< age of an operator's stream, checked by control
  double tip_measurement = 0.100;     ///< age of a measured tip, checked by control
  double clearance = 0.500;           ///< age of the distance of bodies, checked by control with `least_clearance`
  double drive_heartbeat = 0.100;     ///< the drives' budget for hal's heartbeat
  double lease = 1.0;                 ///< time without heartbeat after which the control lease is lost
  double lost_samples = 0.05;         ///< share of the last 100 states, commands or frames of a drive that may be lost
  double lock_step = 60.0;  ///< lock-step: budget of the lease and least time-out of requests; no others apply

  /// Largest age of a command or of a state at this control period, s.
  double commandAge(double period) const { return std::max(minimum_age, age_periods * period); }
  /// Largest age of a measured tip at this control period, s.
  double tipAge(double period) const { return std::max(tip_measurement, age_periods * period); }
};

}  // namespace tandem::safety
