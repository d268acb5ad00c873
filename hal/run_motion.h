// SPDX-License-Identifier: Apache-2.0
/** @file Motion check of a homing run: compares the travel of a joint with the speed of the run. */
#pragma once

#include <cmath>
#include <cstdint>

#include "hal/first_motion.h"

namespace tandem::hal {

/** FirstMotion of a run in which the drive chooses its way: its targets are all places that the run can have reached
 * since its start, from `slowest` to `fastest` times the time that has passed.
 *
 * A drive sets its position to 0 where it finds its reference, so the largest step between two samples does not count
 * as travel. Nothing allocates, locks or throws; positions in m or rad, times in ns. */
class RunMotion {
 public:
  /// A drive may round its speeds, and exceed them while it accelerates.
  static constexpr double kReserve = 1.5;

  /// @param slack  AxisConfig::first_motion
  explicit RunMotion(double slack) noexcept : motion_(slack) {}

  /// @param slowest,fastest  velocities of the run, m/s or rad/s
  void begin(double slowest, double fastest, double position, std::int64_t now) noexcept {
    slowest_ = kReserve * slowest;
    fastest_ = kReserve * fastest;
    from_ = last_ = position;
    largest_ = 0.0;
    since_ = now;
    runs_ = true;
    motion_.restart();
    motion_.begin(0.0, 0.0, 0.0);
  }
  void end() noexcept { runs_ = false; }
  void sample(double position, std::int64_t now) noexcept {
    if (!runs_)
      return;
    const double step = position - last_, elapsed = 1e-9 * static_cast<double>(now - since_);
    last_ = position;
    if (std::abs(step) > std::abs(largest_))
      largest_ = step;
    const double travel = position - from_ - largest_;
    motion_.sample(slowest_ * elapsed, fastest_ * elapsed, travel, travel);
  }

  /// The joint is beyond all places that the run can have reached; until the next begin().
  bool failed() const noexcept { return motion_.failed(); }
  double excess() const noexcept { return motion_.excess(); }

 private:
  FirstMotion motion_;
  double slowest_ = 0.0, fastest_ = 0.0;
  double from_ = 0.0, last_ = 0.0, largest_ = 0.0;
  std::int64_t since_ = 0;
  bool runs_ = false;
};

}  // namespace tandem::hal
