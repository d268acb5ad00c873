// SPDX-License-Identifier: Apache-2.0
/** @file Measured tips for closed-loop control, with checks of their validity. */
#pragma once

#include "idl/messages.h"
#include "planning/reference.h"
#include "planning/tips.h"
#include "safety/command_monitor.h"

namespace tandem::operation {

/** Checks the measurements of sensing/tips: positions, and orientations if tasks use them. A measurement that is marked
 * invalid, not finite, or an orientation that is not of unit norm, counts as none. The age of a measurement is the age,
 * on our own clock, of the newest of our commands that the robot had executed at its time; in lock-step, the simulated
 * time since then. A tip that drops out stays valid until it is too old; then the trajectory is held. Nothing
 * allocates. */
class TipFeedback {
 public:
  /// @param budget  largest age of a measurement, s
  /// @param orientations  whether tasks use measured orientations or the model's
  TipFeedback(bool lock_step, double budget, planning::Feedback orientations = planning::Feedback::kModel)
      : lock_step_(lock_step), budget_(budget) {
    tips_.orientations = orientations;
  }

  void take(const msg::TipPoses& message) noexcept;
  /// The joints were reset, or the robot is another one: older measurements are invalid.
  void forget() noexcept;
  /// Lock-step: whether the tips of a state have arrived.
  bool knows(const msg::ActuationState& state) const noexcept {
    return last_.state_session == state.session && last_.answers_state >= state.sequence;
  }

  /// Whether the tips of all arms in the tasks are usable; if not, the reason.
  /// @param state  the present one; @param commands  send time of each command; @param now  ns
  msg::HoldReason check(const planning::Reference& tasks,
                        const msg::ActuationState& state,
                        const safety::StateStamps& commands,
                        std::int64_t now) noexcept;

  const planning::MeasuredTips& tips() const noexcept { return tips_; }
  /// Age of the oldest tip in the last check(), s; infinite if there is none.
  double age() const noexcept { return age_; }

 private:
  bool lock_step_;
  double budget_;
  msg::TipPoses last_;
  planning::MeasuredTips tips_;
  double age_ = 0.0;
};

}  // namespace tandem::operation
