// SPDX-License-Identifier: Apache-2.0
/** @file Reference of planning: whether it is being followed, its age, its tasks. */
#pragma once

#include "idl/messages.h"
#include "operation/control_setup.h"
#include "planning/follower.h"
#include "planning/reference.h"
#include "safety/command_monitor.h"
#include "safety/faults.h"

namespace tandem::operation {

/** The last reference. Nothing allocates, locks or throws. */
class FollowedReference {
 public:
  explicit FollowedReference(const ControlSetup& setup);

  /// @param arrivals  references received so far, this one included; 0: not counted
  void take(const msg::PlanningReference& message, std::uint64_t arrivals = 0) noexcept {
    message_ = message;
    if (arrivals > 0)
      success_.note(0, message.sequence, message.stamp, arrivals);
  }
  /// Share of the last 100 references that have arrived, 0 to 1.
  double success() const noexcept { return success_.value(); }
  /// Ends the trajectory for good: resuming it would lead back to its old position.
  void spend() noexcept { spent_ = message_.trajectory_id; }

  /// A trajectory is active, running or paused. @param state  the present one
  bool underWay(const msg::ActuationState& state) const noexcept {
    return (phase() == planning::Phase::kRunning || phase() == planning::Phase::kPaused) && message_.task_count > 0 &&
           message_.state_session == state.session && message_.trajectory_id != spent_;
  }
  bool running(const msg::ActuationState& state) const noexcept {
    return underWay(state) && phase() == planning::Phase::kRunning;
  }
  std::uint64_t sequence() const noexcept { return message_.sequence; }
  std::uint64_t answersState() const noexcept { return message_.answers_state; }

  /** Checks the age; a reference that is too old is not followed any more. Its age is that of the status that it
   * answers, measured on this process's clock alone.
   * @param statuses  send time of each status @return the fault; empty: none */
  safety::FaultRecord judge(const safety::StateStamps& statuses, std::int64_t now) noexcept;

  /// Its tasks. Planned joints are a preference, not a task: they are left out if they violate the limits.
  planning::Reference tasks(const msg::ActuationState& state) const noexcept;

 private:
  planning::Phase phase() const noexcept { return static_cast<planning::Phase>(message_.phase); }

  ControlSetup setup_;
  double budget_;  ///< s
  msg::PlanningReference message_;
  std::uint32_t spent_ = 0;
  safety::StreamSuccess success_;
};

}  // namespace tandem::operation
