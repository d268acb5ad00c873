// SPDX-License-Identifier: Apache-2.0
/** @file Measured tips for closed-loop control, with checks of their validity. */
#pragma once

#include "idl/messages.h"
#include "planning/reference.h"
#include "planning/tips.h"
#include "safety/command_monitor.h"

namespace tandem::operation {

/** Takes in sensing/tips. A measurement is as old as the newest of our commands that the robot had taken when it was
 * made, on our own clock; in lock-step, as the simulated time that has passed since. A tip that drops out stays in
 * force until it is too old; then the trajectory is held. Nothing allocates. */
class TipFeedback {
 public:
  /// @param budget  largest age of a measurement, s
  TipFeedback(bool lock_step, double budget) : lock_step_(lock_step), budget_(budget) {}

  void take(const msg::TipPoses& message) noexcept;
  /// The robot was put elsewhere, or is another one: what was measured before says nothing.
  void forget() noexcept;
  /// Lock-step: whether the tips that go with a state are here.
  bool knows(const msg::ActuationState& state) const noexcept {
    return last_.state_session == state.session && last_.answers_state >= state.sequence;
  }

  /// Whether the tips of all arms that the tasks name can be used, and if not, why.
  /// @param state  the present one; @param commands  when each command was sent; @param now  ns
  msg::HoldReason check(const planning::Reference& tasks,
                        const msg::ActuationState& state,
                        const safety::StateStamps& commands,
                        std::int64_t now) noexcept;

  const planning::MeasuredTips& tips() const noexcept { return tips_; }
  /// Of the oldest tip that the last check() looked at, s; infinite where there is none.
  double age() const noexcept { return age_; }

 private:
  bool lock_step_;
  double budget_;
  msg::TipPoses last_;
  planning::MeasuredTips tips_;
  double age_ = 0.0;
};

}  // namespace tandem::operation
