// SPDX-License-Identifier: Apache-2.0
/** @file What control does with what it hears, cycle by cycle; no DDS, no threads, no allocation after construction. */
#pragma once

#include <array>
#include <memory>

#include "control/conflict.h"
#include "planning/follower.h"
#include "safety/command_monitor.h"
#include "safety/control_lease.h"
#include "safety/idle_power.h"
#include "safety/joint_motion.h"
#include "services/common/spsc_queue.h"
#include "services/control/crtk_motion.h"
#include "services/control/frame_loop.h"
#include "services/control/operator_desk.h"
#include "services/control/orders.h"
#include "services/control/tip_feedback.h"
#include "services/control/withdrawal.h"

namespace tandem::service {

/** What one cycle says to the world. */
struct CycleOutput {
  dds::ActuationCommand command;
  dds::ControlStatus status;
  dds::ActuationLimits limits;
};

/** An arm that nobody commands, for the thread that logs. */
struct IdleReport {
  int arm = 0;
  double idle = 0.0;        ///< s
  bool powered_off = true;  ///< otherwise it keeps its power, because it would not hold without
};

/** The controller of all arms: operating states, control lease, and who moves the robot: planning's references, a joint
 * motion, a jog, an operator, CRTK clients, or nobody. All times are ns on one monotonic clock. */
class ControlCore {
 public:
  ControlCore(const Setup& setup,
              const experiments::RobotModel& robot,
              std::unique_ptr<planning::ReferenceTracker> tracker);

  void onState(const dds::ActuationState& state) noexcept;
  void onReference(const dds::PlanningReference& reference) noexcept;
  void onTips(const dds::TipPoses& tips) noexcept { tips_.take(tips); }
  OrderReply order(const ControlOrder& order, std::int64_t now) noexcept;
  void onInput(const dds::TeleopInput& input, std::int64_t now) noexcept;
  CrtkOutcome crtk(const CrtkOrder& order, std::int64_t now) noexcept;
  /// How motions of CRTK clients ended, one by one.
  bool takeEnded(CrtkOutcome& outcome) noexcept { return crtk_ended_.pop(outcome); }
  /// Arms that have been without a commander for too long, one by one.
  bool takeIdle(IdleReport& report) noexcept { return idle_reports_.pop(report); }
  /// For the thread that publishes; after cycle().
  void fillMoments(std::int64_t now, OperatorMoment& operators, CrtkMoment& crtk) const noexcept;
  void stop() noexcept;  ///< the stop topic: every arm into FAULT

  /// Of catheters, whose thread is started and stopped by whoever runs the loop; null for tubes.
  FrameLoop* frames() noexcept { return frames_.get(); }

  /// One cycle. `advance`: lock-step, the plant shall take one step with the command.
  void cycle(std::int64_t now, bool advance, CycleOutput& output) noexcept;

  /// What led an arm into FAULT; empty in the other states.
  const safety::FaultRecord& faultRecord(int arm) const noexcept { return arm_[arm].record; }
  std::array<safety::FaultRecord, safety::kMaxArms> faultRecords() const noexcept;

  /// Lock-step: whether everything is there to answer the present state with motion.
  bool readyToAdvance() const noexcept;
  /// Lock-step: whether the drives have been asked for something that they do not yet show.
  bool drivesPending() const noexcept;

  /// The last cycle's statistics, filled in by whoever runs the loop.
  struct Timing {
    double cycle_time = 0.0, cycle_time_max = 0.0, jitter_max = 0.0;
    std::uint64_t cycles = 0, overruns = 0;
  };
  void setTiming(const Timing& timing) noexcept { timing_ = timing; }

 private:
  enum class Activity : std::uint8_t { kNone, kMotion, kJog, kWithdraw };
  struct ArmControl {
    safety::StateMachine machine;
    safety::FaultRecord record;      ///< what led into FAULT
    bool pending = false;            ///< enable or resume was asked for and the drives do not show it yet
    bool recovering = false;         ///< power was asked for to recover the arm
    safety::JointMask without = 0;   ///< recovering: joints that shall not be used
    std::int64_t pending_until = 0;  ///< given up then: power does not come because somebody once asked, ns
    WithdrawalRun withdrawal;
    bool unhomed = false;  ///< by CRTK's unhome, until the next home
    bool homing = false;
    std::uint64_t deaf_until = 0;     ///< faults in states older than the answer to this command are history
    std::uint64_t power_command = 0;  ///< the first command that asks for what is pending
    Activity activity = Activity::kNone;
    safety::JointMotion motion;
    double motion_time = 0.0;  ///< s since its start
    safety::ArmVector jog_velocity;
    std::int64_t jog_until = 0;
    safety::ArmVector home;
    // Of a motion by a CRTK command: the verb, and the group that it was for.
    std::uint8_t motion_verb = CrtkMoment::kNone, motion_group = 0;
  };

  // Orders.
  /// @param commander  holds the lease
  OrderReply stateCommand(const ControlOrder& order, OrderReply reply, bool commander, std::int64_t now) noexcept;
  /// What forbids a state command to arm k. False: nothing.
  bool refused(const ControlOrder& order, int k, OrderReply& reply) const noexcept;
  void obey(const ControlOrder& order, int k, std::int64_t now) noexcept;
  bool inFault(int k) const noexcept;
  void disarm(int arm) noexcept;
  void watchIdle(std::int64_t now) noexcept;
  void giveUpPending(std::int64_t now) noexcept;
  OrderReply motionOrder(const ControlOrder& order, OrderReply reply, std::int64_t now) noexcept;
  OrderReply leaseOrder(const ControlOrder& order, OrderReply reply, std::int64_t now) noexcept;
  bool startMotion(int arm, const safety::ArmVector& goal) noexcept;

  // Operators and CRTK clients.
  OperatorDesk::Context operatorContext(std::int64_t now) const noexcept;
  OperatorReason againstOperator() const noexcept;
  const char* againstCrtk(const CrtkOrder& order, std::int64_t now) const noexcept;
  CrtkMotion::Scene scene(std::int64_t now) const noexcept;
  bool moveByCrtk(const CrtkOrder& order, CrtkOutcome& outcome) noexcept;
  bool operate(std::int64_t now) noexcept;
  bool obeyCrtk(std::int64_t now) noexcept;
  bool findTips() noexcept;
  void keepOut() noexcept;
  bool ready(int arm) const noexcept;
  /// All joints know where they are, and nobody has asked to forget it.
  bool homed(int arm) const noexcept { return !arm_[arm].unhomed && state_.homed[static_cast<std::size_t>(arm)] != 0; }
  /// The arm has, or is about to have, power to be recovered.
  bool recovering(int arm) const noexcept {
    const bool wished = arm_[arm].recovering && arm_[arm].machine.state() != safety::OperatingState::kDisabled &&
                        arm_[arm].machine.state() != safety::OperatingState::kFault;
    return wished || state_.recovery[static_cast<std::size_t>(arm)] != 0;
  }
  bool trajectoryRuns() const noexcept;
  bool operated() const noexcept { return operator_.engaged() || crtk_.active(); }

  // Cycle.
  dds::Source chooseSource(std::int64_t now, bool advance) noexcept;
  void watch(std::int64_t now) noexcept;
  bool following() const noexcept;
  bool moving() const noexcept;
  void latchMoving(const safety::FaultRecord& record) noexcept;
  void latch(int arm, const safety::FaultRecord& record) noexcept;
  void readPositions() noexcept;
  void follow(std::int64_t now) noexcept;
  void closeLoop(std::int64_t now) noexcept;
  void takePosture() noexcept;
  bool arrived(int arm) const noexcept;
  void moveJoints(int arm, std::int64_t now) noexcept;
  void jog(int arm, std::int64_t now) noexcept;
  void withdraw(int arm, std::int64_t now) noexcept;
  void fillCommand(std::int64_t now, bool advance, dds::ActuationCommand& command) noexcept;
  void fillStatus(std::int64_t now, dds::ControlStatus& status) noexcept;
  void fillLimits(dds::ActuationLimits& limits) const noexcept;
  void fillConflict(dds::ControlStatus& status) noexcept;
  safety::DriveRequest requestFor(int arm) const noexcept;
  safety::OperatingState driveState(int arm) const noexcept;
  safety::OperatingState shownState(int arm) const noexcept;
  safety::ArmVector base(int arm) const noexcept;

  const Setup& setup_;
  const experiments::RobotModel& robot_;
  bool lock_step_;
  double period_;
  std::unique_ptr<planning::ReferenceTracker> tracker_;
  safety::ControlLease lease_;
  safety::IdlePower idle_;
  SpscQueue<IdleReport> idle_reports_{32};
  std::array<ArmControl, safety::kMaxArms> arm_;
  int arm_count_;

  dds::ActuationState state_;
  bool fresh_state_ = false;     ///< state_ came since the last cycle
  std::int64_t state_seen_ = 0;  ///< when the last new state was there, ns
  dds::PlanningReference reference_;
  std::unique_ptr<FrameLoop> frames_;  ///< of catheters
  bool sensor_;                        ///< errors are those of measured tips
  TipFeedback tips_;
  dds::HoldReason hold_ = dds::HoldReason::kNone;  ///< of this cycle
  static constexpr std::size_t kSentVelocities = 16;
  std::array<safety::RobotVector, kSentVelocities> sent_;  ///< velocities of the last commands, by sequence
  const safety::RobotVector& lastSent() const noexcept { return sent_[command_sequence_ % kSentVelocities]; }
  std::uint32_t spent_trajectory_ = 0;                ///< was running when an arm lost power: never followed again
  safety::StateStamps command_times_, status_times_;  ///< when each was sent: echoes are judged on our own clock
  std::uint64_t command_sequence_ = 0, status_sequence_ = 0, answered_state_ = 0;
  std::int64_t first_cycle_ = 0;
  safety::RobotVector q_;     ///< measured
  safety::RobotVector base_;  ///< the setpoints from which this cycle goes on
  safety::RobotVector velocity_;
  std::array<bool, safety::kMaxArms> moves_{};
  planning::Reference tasks_;
  planning::TrackResult track_;
  control::Conflict standing_;  ///< limits at which the velocity stands
  bool tracked_ = false;        ///< track_ holds a solution of this cycle
  double solve_time_ = 0.0;
  double unsolved_ = 0.0;  ///< s for which the resolver has failed without a break
  Timing timing_;
  OperatorDesk operator_;
  CrtkMotion crtk_;
  SpscQueue<CrtkOutcome> crtk_ended_{64};
  dds::Source source_ = dds::Source::kNobody;  ///< of this cycle
  bool tips_known_ = false;
  int kept_out_of_ = -1;  ///< the forbidden region that held this cycle's motion back
  planning::teleoperation::TipPlaces tip_places_{};
};

}  // namespace tandem::service
