// SPDX-License-Identifier: Apache-2.0
/** @file Control state machine and arbitration, one cycle at a time. */
#pragma once

#include <cmath>

#include "operation/arm_states.h"
#include "operation/followed_reference.h"
#include "operation/joint_motions.h"
#include "operation/manual_control.h"
#include "operation/requests.h"
#include "safety/clearance_interlock.h"
#include "safety/control_lease.h"

namespace tandem::operation {

/** Output of one cycle. */
struct CycleOutput {
  msg::ActuationCommand command;
  msg::ControlStatus status;  ///< without the statistics of the loop that runs the cycles
  msg::ActuationLimits limits;
  msg::ControlPermissions permissions;
  CrtkEndings endings;
  /// Decisions on the power of arms without commands; ControlStatus::idle is their idle time.
  std::array<safety::IdlePower::Decision, safety::kMaxArms> idle{};
};

/** Control core: combines the lease, the states of the arms, and the sources of motion: an operator, CRTK clients,
 * planning's references, or joint motions. No threads; nothing allocates after construction (except a method change),
 * locks or throws. All times are ns on one monotonic clock. */
class ControlCore {
 public:
  /// @param object_control  of arms that move a common object, kept by reference; null for independent tips
  ControlCore(const ControlSetup& setup,
              std::unique_ptr<planning::ReferenceTracker> tracker,
              ObjectControl* object_control = nullptr);
  ControlCore(const ControlCore&) = delete;  // members keep references to one another

  /// @param arrivals  states received so far, this one included; 0: not counted
  void onState(const msg::ActuationState& state, std::uint64_t arrivals = 0) noexcept;
  /// @param arrivals  references received so far, likewise
  void onReference(const msg::PlanningReference& reference, std::uint64_t arrivals = 0) noexcept {
    reference_.take(reference, arrivals);
  }
  void onTips(const msg::TipPoses& tips) noexcept { loop_.onTips(tips); }
  void onInput(const msg::TeleopInput& input, std::int64_t now) noexcept { manual_.onInput(input, context(now)); }
  /// The newest measured distance of bodies; for the interlock.
  void onClearance(const safety::ClearanceSample& sample) noexcept { clearance_ = sample; }
  void stop() noexcept;  ///< the stop topic: all arms into FAULT
  /// A sender with another robot or deployment publishes commands or measurements: moving arms stop, and no motion
  /// starts until one second after it.
  void onMismatch(std::int64_t now) noexcept;
  ControlReply onRequest(const ParsedControlRequest& request, std::int64_t now) noexcept;
  CrtkOutcome crtk(const CrtkRequest& request, std::int64_t now) noexcept;

  /// Runs one cycle. `advance`: lock-step, the plant takes one step with the command.
  void cycle(std::int64_t now, bool advance, CycleOutput& output) noexcept;
  /// Snapshots for the publishing thread; call after cycle().
  void fillSnapshots(std::int64_t now, OperatorSnapshot& operators, CrtkSnapshot& crtk) const noexcept;

  /// First cause of the FAULT state of an arm; empty in the other states.
  const safety::FaultRecord& faultRecord(int arm) const noexcept { return arms_.record(arm); }
  /// Input of judge() now.
  RobotCondition condition() const noexcept;
  std::uint64_t leaseOwner(std::int64_t now) const noexcept { return lease_.owner(now); }
  /// Input of judge() for this request: with the faults that its sender has received.
  RobotCondition condition(const ParsedControlRequest& request) const noexcept;

  /// Lock-step: whether all data are present to answer the current state with motion.
  bool readyToAdvance() const noexcept;
  /// Lock-step: whether a request to the drives is not yet shown in their state.
  bool drivesPending() const noexcept { return arms_.hasPendingDriveRequest(); }

 private:
  OperatorInputHandler::Context context(std::int64_t now) const noexcept {
    return {now, lease_.owner(now), &status_times_};
  }
  void apply(const ParsedControlRequest& request, int arm, Action action, std::int64_t now) noexcept;
  /// When the status that a request answers was published; `now` in lock-step.
  std::int64_t timeOfAnswered(const ParsedControlRequest& request, std::int64_t now) const noexcept {
    return setup_.lockStep() ? now : now - std::llround(1e9 * status_times_.age(request.answers_control, now));
  }
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
  safety::ClearanceInterlock interlock_;
  safety::ClearanceSample clearance_;
  DriveExchange drives_;
  ArmStates arms_;
  JointMotions motions_;
  FollowedReference reference_;
  TaskLoop loop_;
  ManualControl manual_;
  safety::StateStamps status_times_;  ///< publication times, for the age of echoes on our own clock
  std::uint64_t status_sequence_ = 0;
  std::int64_t mismatch_until_ = 0;            ///< ns
  std::uint64_t paused_by_ = 0;                ///< client
  bool mismatch_ = false;                      ///< of this cycle
  msg::Source source_ = msg::Source::kNobody;  ///< of this cycle
  planning::Reference tasks_;                  ///< of the last cycle with tasks
};

}  // namespace tandem::operation
