// SPDX-License-Identifier: Apache-2.0
/** @file Homing of the axes of one arm, group after group.
 *
 * The axes of a group start in the same cycle and run at one speed (config checks this for the carriages of an arm). So
 * the distance of two carriages is constant while both move, and changes monotonically to its final value while one of
 * them still moves: from one value that satisfies equation (1) to another, never beyond either. One axis that fails
 * stops its whole group. */
#pragma once

#include <vector>

#include "hal/axis.h"
#include "hal/hard_stop_search.h"

namespace tandem::hal {

/** State machine over the axes of an arm. Nothing after construction allocates, locks or throws. */
class HomingRun {
 public:
  enum class Phase : std::uint8_t { kIdle, kPrepare, kPower, kRun, kPowerOff, kPrepareBack, kLimits, kAborting };

  /// @param axes of an arm; axes that need no homing do not move. @param period  of step(), s
  HomingRun(std::vector<Axis*> axes, double period);

  /// At least one axis needs a homing run.
  bool needed() const noexcept;
  bool running() const noexcept { return phase_ != Phase::kIdle; }
  Phase phase() const noexcept { return phase_; }

  void start(std::int64_t now) noexcept;
  /// Stops all axes with their quick stop, which ends before torque goes off, and ends the run.
  void abort(std::int64_t now) noexcept;
  /// Advances the run. An axis that fails its homing gets HardwareGuard::kHoming.
  void step(std::int64_t now) noexcept;

 private:
  bool member(const Axis& axis) const noexcept;
  void enter(Phase phase, std::int64_t now) noexcept;
  void nextGroup(std::int64_t now) noexcept;
  bool anyBad() const noexcept;
  void stepPrepare(Phase next, std::int64_t now) noexcept;
  void stepRun(std::int64_t now) noexcept;
  void enterOf(std::size_t index, Phase phase, std::int64_t now) noexcept;
  void start(std::size_t index, std::int64_t now) noexcept;
  void stepStop(std::size_t index, bool late, std::int64_t now) noexcept;
  void stepDrive(Axis& axis, bool late) noexcept;
  template <class Condition>
  bool all(Condition&& condition) const noexcept;

  std::vector<Axis*> axes_;
  std::vector<HardStopSearch> searches_;  ///< of all axes; used by those with a mechanical stop
  Phase phase_ = Phase::kIdle;
  int order_ = 0;
  double budget_ = 0.0;
  std::int64_t entered_ = 0;
};

}  // namespace tandem::hal
