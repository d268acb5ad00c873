// SPDX-License-Identifier: Apache-2.0
/** @file Homing of the axes of one arm, group after group.
 *
 * The axes of a group start in the same cycle and run at one speed (config sees to that for the carriages of an arm).
 * So the distance of two carriages stays what it is while both move, and goes straight from there to its final value
 * while one still does: from one good value of equation (1) to another, never beyond either. One axis that fails stops
 * its whole group. */
#pragma once

#include <vector>

#include "hal/axis.h"

namespace tandem::hal {

/** State machine over the axes of an arm. Nothing after construction allocates, locks or throws. */
class HomingRun {
 public:
  enum class Phase : std::uint8_t { kIdle, kMode, kPower, kRun, kPowerOff, kModeBack, kLimits, kAborting };

  /// The axes of an arm; those that need no homing are left alone.
  explicit HomingRun(std::vector<Axis*> axes) : axes_(std::move(axes)) {}

  /// Some axis waits for a homing run.
  bool needed() const noexcept;
  bool running() const noexcept { return phase_ != Phase::kIdle; }
  Phase phase() const noexcept { return phase_; }

  void start(std::int64_t now) noexcept;
  /// Stops all axes by their quick stop, which ends before torque goes, and gives the run up.
  void abort(std::int64_t now) noexcept;
  /// Goes on. Axes that spoil the run are failed with HardwareGuard::kHoming.
  void step(std::int64_t now) noexcept;

 private:
  bool member(const Axis& axis) const noexcept;
  void enter(Phase phase, std::int64_t now) noexcept;
  void nextGroup(std::int64_t now) noexcept;
  bool anyBad() const noexcept;
  void stepJobs(Phase next, std::int64_t now) noexcept;
  void stepRun(std::int64_t now) noexcept;
  template <class Condition>
  bool all(Condition&& condition) const noexcept;

  std::vector<Axis*> axes_;
  Phase phase_ = Phase::kIdle;
  int order_ = 0;
  double budget_ = 0.0;
  std::int64_t entered_ = 0;
};

}  // namespace tandem::hal
