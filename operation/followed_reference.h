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

/** The last one. Nothing allocates, locks or throws. */
class FollowedReference {
 public:
  explicit FollowedReference(const ControlSetup& setup);

  /// @param arrivals  references that have come so far, with this one; 0: nobody counts
  void take(const msg::PlanningReference& message, std::uint64_t arrivals = 0) noexcept {
    message_ = message;
    if (arrivals > 0)
      success_.note(0, message.sequence, message.stamp, arrivals);
  }
  /// Share of the last 100 references that came, 0 to 1.
  double success() const noexcept { return success_.value(); }
  /// The trajectory is over for good: it would lead back to where it was.
  void spend() noexcept { spent_ = message_.trajectory_id; }

  /// A trajectory is under way, running or paused. @param state  the present one
  bool underWay(const msg::ActuationState& state) const noexcept {
    return (phase() == planning::Phase::kRunning || phase() == planning::Phase::kPaused) && message_.task_count > 0 &&
           message_.state_session == state.session && message_.trajectory_id != spent_;
  }
  bool running(const msg::ActuationState& state) const noexcept {
    return underWay(state) && phase() == planning::Phase::kRunning;
  }
  std::uint64_t sequence() const noexcept { return message_.sequence; }
  std::uint64_t answersState() const noexcept { return message_.answers_state; }

  /** Whether it is too old to be followed; then it is not followed any more. A reference is as old as the status that
   * it had seen: judged on this process's clock alone.
   * @param statuses  when each status was sent  @return the fault; empty: none */
  safety::FaultRecord judge(const safety::StateStamps& statuses, std::int64_t now) noexcept;

  /// Its tasks. Planned joints are a preference, not a task: those that no limits allow are left out.
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
