// SPDX-License-Identifier: Apache-2.0
/** @file Control state machine and arbitration, one cycle at a time. */
#pragma once

#include "operation/arm_states.h"
#include "operation/followed_reference.h"
#include "operation/joint_motions.h"
#include "operation/manual_control.h"
#include "operation/requests.h"
#include "safety/control_lease.h"

namespace tandem::operation {

/** What one cycle says to the world. */
struct CycleOutput {
  msg::ActuationCommand command;
  msg::ControlStatus status;  ///< without the statistics of the loop that runs the cycles
  msg::ActuationLimits limits;
  msg::ControlPermissions permissions;
  CrtkEndings endings;
  /// Of arms that nobody commands; ControlStatus::idle says for how long.
  std::array<safety::IdlePower::Decision, safety::kMaxArms> idle{};
};

/** Brings the parts together: the lease, the states of the arms, and who moves them: an operator, CRTK clients,
 * planning's references, or motions of joints. No threads; nothing allocates after construction (a method change
 * apart), locks or throws. All times are ns on one monotonic clock. */
class ControlCore {
 public:
  /// @param object_control  of catheters, kept by reference; null for tubes
  ControlCore(const ControlSetup& setup,
              std::unique_ptr<planning::ReferenceTracker> tracker,
              ObjectControl* object_control = nullptr);
  ControlCore(const ControlCore&) = delete;  // parts keep one another by reference

  /// @param arrivals  states that have come so far, with this one; 0: nobody counts
  void onState(const msg::ActuationState& state, std::uint64_t arrivals = 0) noexcept;
  /// @param arrivals  likewise of references
  void onReference(const msg::PlanningReference& reference, std::uint64_t arrivals = 0) noexcept {
    reference_.take(reference, arrivals);
  }
  void onTips(const msg::TipPoses& tips) noexcept { loop_.onTips(tips); }
  void onInput(const msg::TeleopInput& input, std::int64_t now) noexcept { manual_.onInput(input, context(now)); }
  void stop() noexcept;  ///< the stop topic: every arm into FAULT
  /// Somebody who knows another robot or deployment commands or measures: arms that move stop, and for a second after
  /// it none begins to.
  void onMismatch(std::int64_t now) noexcept;
  ControlReply onRequest(const ParsedControlRequest& request, std::int64_t now) noexcept;
  CrtkOutcome crtk(const CrtkRequest& request, std::int64_t now) noexcept;

  /// One cycle. `advance`: lock-step, the plant shall take one step with the command.
  void cycle(std::int64_t now, bool advance, CycleOutput& output) noexcept;
  /// For the thread that publishes; after cycle().
  void fillMoments(std::int64_t now, OperatorSnapshot& operators, CrtkSnapshot& crtk) const noexcept;

  /// What led an arm into FAULT; empty in the other states.
  const safety::FaultRecord& faultRecord(int arm) const noexcept { return arms_.record(arm); }
  /// What judge() decides by now.
  RobotCondition condition() const noexcept;
  std::uint64_t leaseHolder(std::int64_t now) const noexcept { return lease_.holder(now); }
  /// Likewise for this order: with what its sender has seen.
  RobotCondition condition(const ParsedControlRequest& request) const noexcept;

  /// Lock-step: whether everything is there to answer the present state with motion.
  bool readyToAdvance() const noexcept;
  /// Lock-step: whether the drives have been asked for something that they do not yet show.
  bool drivesPending() const noexcept { return arms_.hasPendingDriveRequest(); }

 private:
  OperatorInputHandler::Context context(std::int64_t now) const noexcept {
    return {now, lease_.holder(now), &status_times_};
  }
  void apply(const ParsedControlRequest& request, int arm, Action action, std::int64_t now) noexcept;
  Reason againstEcho(const ParsedControlRequest& request, Action action, std::int64_t now) const noexcept;
  void updateStates() noexcept;
  void loseLease(std::int64_t now) noexcept;
  void watch(std::int64_t now) noexcept;
  void watchIdle(std::int64_t now, CycleOutput& output) noexcept;
  void keepCrtkLease(std::int64_t now) noexcept;
  msg::Source chooseSource(std::int64_t now, bool advance, CycleOutput& output) noexcept;
  void follow(std::int64_t now, Velocities& velocities) noexcept;
  void fillStatus(std::int64_t now, const Velocities& velocities, msg::ControlStatus& status) noexcept;

  ControlSetup setup_;
  safety::ControlLease lease_;
  DriveExchange drives_;
  ArmStates arms_;
  JointMotions motions_;
  FollowedReference reference_;
  TaskLoop loop_;
  ManualControl manual_;
  safety::StateStamps status_times_;  ///< when each was sent: echoes are judged on our own clock
  std::uint64_t status_sequence_ = 0;
  std::int64_t mismatch_until_ = 0;            ///< ns
  std::uint64_t paused_by_ = 0;                ///< client
  bool mismatch_ = false;                      ///< of this cycle
  msg::Source source_ = msg::Source::kNobody;  ///< of this cycle
  planning::Reference tasks_;                  ///< that were done last
};

}  // namespace tandem::operation
