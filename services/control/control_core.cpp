// SPDX-License-Identifier: Apache-2.0
/** @file ControlCore: cycles. */
#include "services/control/control_core.h"

#include <algorithm>
#include <cmath>

#include "safety/joint_motion.h"
#include "services/common/periodic_loop.h"
#include "services/dds/convert.h"

namespace tandem::service {
namespace {

using safety::OperatingState;

/// How fast a motion makes up for commands that were lost, 1/s. Only what a new state shows is made up for: an old one
/// shows the way that was gone since as an error, too.
constexpr double kCatchUpRate = 20.0;
/// A motion whose joints do not arrive ends so long after it should have, s.
constexpr double kPatience = 10.0;

safety::FaultRecord tooOld(safety::Fault fault, double age, double allowed) noexcept {
  return {bit(fault), safety::FaultCause::kUnspecified, safety::FaultRecord::kNoJoint, age, allowed};
}

}  // namespace

ControlCore::ControlCore(const Setup& setup,
                         const experiments::RobotModel& robot,
                         std::unique_ptr<planning::ReferenceTracker> tracker)
    : setup_(setup),
      robot_(robot),
      lock_step_(setup.deployment.clock == config::ClockMode::kLockStep),
      period_(setup.deployment.control_period),
      tracker_(std::move(tracker)),
      lease_(setup.deployment.budgets.lease),
      idle_(setup.deployment.idle_power_off),
      arm_count_(robot.armCount()),
      sensor_(setup.deployment.feedback == planning::Feedback::kSensor),
      tips_(lock_step_, setup.deployment.budgets.tipAge(period_)),
      operator_(setup, arm_count_),
      crtk_(setup, robot) {
  if (setup.robot.catheters)
    frames_ = std::make_unique<FrameLoop>(setup);
  tip_places_.fill(Eigen::Vector3d::Zero());
  q_.setZero(robot.jointCount());
  velocity_.setZero(robot.jointCount());
  base_.setZero(robot.jointCount());
  sent_.fill(velocity_);
  for (int k = 0; k < arm_count_; ++k) {
    arm_[k].home = setup.robot.arms[static_cast<std::size_t>(k)].home;
    arm_[k].jog_velocity.setZero(robot.size(k));
  }
}

void ControlCore::onState(const dds::ActuationState& state) noexcept {
  if (state.arm_count != arm_count_)
    return;  // another robot's
  for (int k = 0; k < arm_count_; ++k) {
    if (state.joint_count[static_cast<std::size_t>(k)] != robot_.size(k))
      return;
  }
  const bool new_session = state_.session != 0 && state.session != state_.session;
  // Elastic arms remember their way; there is none to where somebody put them.
  if (new_session || state.placements != state_.placements) {
    tracker_->restart();
    if (frames_)
      frames_->restart();
  }
  fresh_state_ = fresh_state_ || new_session || state.sequence != state_.sequence;
  state_ = state;
  if (new_session)
    answered_state_ = 0;
  for (int k = 0; k < arm_count_; ++k) {
    ArmControl& arm = arm_[k];
    const auto i = static_cast<std::size_t>(k);
    // The drives started anew: whatever moved before does not move on.
    if (new_session && arm.machine.state() != OperatingState::kDisabled)
      latch(k, {bit(safety::Fault::kDrive), safety::FaultCause::kRestarted});
    // Until drives recover an arm they show what it is recovered from.
    const bool knows = !(arm.pending && arm.recovering);
    if (knows && state.faults[i] != 0 && state.answers_command >= arm.deaf_until)
      latch(k, {state.faults[i], safety::FaultCause::kReported});
    if (knows && state.valid[i] == 0 && arm.machine.mayMove())
      latch(k, {bit(safety::Fault::kSensor)});
    const bool as_asked = !(arm.pending && arm.recovering) || state.recovery[i] != 0;
    if (driveState(k) == OperatingState::kEnabled && arm.machine.mayMove() && as_asked) {
      // Drives that have not heard of the order may be on their way into the state of the order before it.
      arm.pending = arm.pending && state.answers_command < arm.power_command;
    } else if (arm.machine.mayMove() && !arm.pending) {
      latch(k, {bit(safety::Fault::kDrive), safety::FaultCause::kLeftEnabled});
    }
    if (!arm.machine.mayMove())
      arm.activity = Activity::kNone;
  }
}

void ControlCore::onReference(const dds::PlanningReference& reference) noexcept { reference_ = reference; }

void ControlCore::stop() noexcept {
  for (int k = 0; k < arm_count_; ++k)
    latch(k, {bit(safety::Fault::kStopRequested)});
}

void ControlCore::latch(int k, const safety::FaultRecord& record) noexcept {
  if (arm_[k].machine.state() != OperatingState::kFault)
    arm_[k].record = record;
  arm_[k].machine.latch(record.faults);
  spent_trajectory_ = reference_.trajectory_id;
}

std::array<safety::FaultRecord, safety::kMaxArms> ControlCore::faultRecords() const noexcept {
  std::array<safety::FaultRecord, safety::kMaxArms> records;
  for (std::size_t k = 0; k < records.size(); ++k)
    records[k] = arm_[k].record;
  return records;
}

OperatingState ControlCore::driveState(int k) const noexcept {
  return static_cast<OperatingState>(state_.operating_state[static_cast<std::size_t>(k)]);
}

OperatingState ControlCore::shownState(int k) const noexcept {
  const OperatingState wanted = arm_[k].machine.state();
  return wanted == OperatingState::kFault || state_.sequence == 0 ? wanted : driveState(k);
}

bool ControlCore::following() const noexcept {
  const auto phase = static_cast<planning::Phase>(reference_.phase);
  return (phase == planning::Phase::kRunning || phase == planning::Phase::kPaused) && reference_.task_count > 0 &&
         reference_.state_session == state_.session && reference_.trajectory_id != spent_trajectory_;
}

bool ControlCore::moving() const noexcept {
  if (operated())
    return true;
  for (int k = 0; k < arm_count_; ++k) {
    if (arm_[k].machine.mayMove() && (arm_[k].activity != Activity::kNone || following()))
      return true;
  }
  return false;
}

void ControlCore::latchMoving(const safety::FaultRecord& record) noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    if (arm_[k].machine.mayMove())
      latch(k, record);
  }
}

void ControlCore::watch(std::int64_t now) noexcept {
  if (first_cycle_ == 0)
    first_cycle_ = now;
  if (lease_.takeLoss(now) && moving())
    latchMoving({bit(safety::Fault::kLeaseLost)});
  if (lock_step_)
    return;  // stamps are simulated time there; a dead process stalls everything
  giveUpPending(now);
  const safety::Budgets& budgets = setup_.deployment.budgets;
  if (fresh_state_)
    state_seen_ = now;
  const double state_age = command_times_.age(state_.answers_command, now);
  const double state_budget = budgets.commandAge(period_);
  if (state_age > state_budget) {
    safety::FaultRecord record = tooOld(safety::Fault::kStateTimeout, state_age, state_budget);
    const bool silent = 1e-9 * static_cast<double>(now - state_seen_) > 0.5 * state_budget;
    record.cause = silent ? safety::FaultCause::kSilent : safety::FaultCause::kUnanswered;
    latchMoving(record);
  }
  // A reference is as old as the status that it had seen: judged on this process's clock alone.
  const double reference_budget = std::max(budgets.planning_reference, 2.5 * period_);
  const double reference_age = status_times_.age(reference_.answers_control, now);
  if (following() && reference_age > reference_budget) {
    latchMoving(tooOld(safety::Fault::kReferenceTimeout, reference_age, reference_budget));
    reference_.phase = static_cast<std::uint8_t>(planning::Phase::kIdle);
  }
}

void ControlCore::readPositions() noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    q_.segment(robot_.offset(k), robot_.size(k)) = dds::jointsOf(state_.position, k, robot_.size(k));
    base_.segment(robot_.offset(k), robot_.size(k)) = base(k);
  }
}

safety::ArmVector ControlCore::base(int k) const noexcept {
  // The last setpoint that the gate let through, and what has been sent since and is on its way.
  safety::ArmVector from = dds::jointsOf(state_.setpoint, k, robot_.size(k));
  const std::uint64_t in_flight = command_sequence_ - state_.answers_command;
  if (lock_step_)
    return from;
  // Some of them may be lost; to take them for done is the careful way where a limit is near.
  const std::uint64_t first = command_sequence_ - std::min<std::uint64_t>(in_flight, kSentVelocities) + 1;
  for (std::uint64_t i = first; i <= command_sequence_; ++i) {
    from += period_ * sent_[i % kSentVelocities].segment(robot_.offset(k), robot_.size(k));
  }
  return from;
}

/// Joints that somebody has planned are a wish, not a task: one that no limits allow is left out.
void ControlCore::takePosture() noexcept {
  constexpr double kOutside = 1e-6;  // m or rad: rounding
  tasks_.posture = dds::postureOf(reference_, arm_count_, state_.joint_count);
  for (int k = 0; k < arm_count_ && tasks_.posture.size() > 0; ++k) {
    const auto own = tasks_.posture.segment(robot_.offset(k), robot_.size(k));
    if (!(safety::largestViolation(*robot_.limits()[static_cast<std::size_t>(k)], own) <= kOutside))
      tasks_.posture.resize(0);
  }
}

void ControlCore::closeLoop(std::int64_t now) noexcept {
  if (source_ == dds::Source::kPlanning) {
    tasks_ = dds::tasksOf(reference_);
    takePosture();
  }
  if (frames_) {
    hold_ = frames_->step(now, base_, lastSent(), tasks_, *tracker_, track_);
    return;
  }
  hold_ = sensor_ ? tips_.check(tasks_, state_, command_times_, now) : dds::HoldReason::kNone;
  if (hold_ != dds::HoldReason::kNone) {
    tracker_->hold(q_, base_, planning::TrackStatus::kSensor, track_);
  } else {
    tracker_->step(q_, base_, tasks_, sensor_ ? &tips_.tips() : nullptr, track_);
  }
}

void ControlCore::follow(std::int64_t now) noexcept {
  const std::int64_t start = monotonicNow();
  closeLoop(now);
  if (hold_ != dds::HoldReason::kNone && source_ != dds::Source::kPlanning) {
    operator_.stop(OperatorReason::kTips);
    crtk_.endAll();
  }
  solve_time_ = 1e-9 * static_cast<double>(monotonicNow() - start);
  tracked_ = true;
  if (track_.status == planning::TrackStatus::kModel)
    latchMoving({bit(safety::Fault::kSolver), safety::FaultCause::kModel});
  // That the limits forbid a task is an answer, with a velocity. A solver that gives none, step after step, is broken.
  const bool no_rest = hold_ == dds::HoldReason::kNoRest;
  const bool unsolved = no_rest || track_.status == planning::TrackStatus::kSolver;
  unsolved_ = unsolved ? unsolved_ + period_ : 0.0;
  const double allowed = setup_.deployment.budgets.commandAge(period_);
  if (unsolved_ > allowed * (1.0 + 1e-9)) {
    latchMoving({bit(safety::Fault::kSolver), no_rest ? safety::FaultCause::kModel : safety::FaultCause::kNoSolution,
                 safety::FaultRecord::kNoJoint, unsolved_, allowed});
    unsolved_ = 0.0;
  }
  for (int k = 0; k < arm_count_; ++k) {
    moves_[static_cast<std::size_t>(k)] =
        hold_ == dds::HoldReason::kNone && arm_[k].machine.mayMove() && !arm_[k].pending;
    velocity_.segment(robot_.offset(k), robot_.size(k)) =
        track_.solution.velocity.segment(robot_.offset(k), robot_.size(k));
  }
  if (source_ != dds::Source::kPlanning)
    keepOut();
}

/// Not when the last setpoint has been sent or taken, for that one may have been lost, but when the joints are there
/// and the drives were last asked to stay: from a segment with a speed they go on beyond its end.
bool ControlCore::arrived(int k) const noexcept {
  constexpr double kThere = 1e-7;  // m or rad
  const int first = robot_.offset(k), n = robot_.size(k);
  const safety::ArmVector& goal = arm_[k].motion.goal();
  const double asked = (base_.segment(first, n) - goal).cwiseAbs().maxCoeff();
  const double measured = (q_.segment(first, n) - goal).cwiseAbs().maxCoeff();
  const double step = period_ * sent_[command_sequence_ % kSentVelocities].segment(first, n).cwiseAbs().maxCoeff();
  return std::max(asked, step) <= kThere && measured <= safety::kAtRest;
}

void ControlCore::moveJoints(int k, std::int64_t now) noexcept {
  ArmControl& arm = arm_[k];
  auto velocity = velocity_.segment(robot_.offset(k), robot_.size(k));
  if (crtk_.movesJoints(k)) {
    velocity = crtk_.jointVelocity(k, scene(now));
    moves_[static_cast<std::size_t>(k)] = true;
  } else if (arm.activity == Activity::kJog) {
    jog(k, now);
  } else if (arm.activity == Activity::kWithdraw) {
    withdraw(k, now);
  } else if (arm.activity == Activity::kMotion) {
    const auto from = base_.segment(robot_.offset(k), robot_.size(k));
    const safety::ArmVector before = arm.motion.position(arm.motion_time);
    arm.motion_time += period_;
    velocity = (arm.motion.position(arm.motion_time) - before) / period_;
    if (fresh_state_)
      velocity += std::min(1.0 / period_, kCatchUpRate) * (before - from);
    for (int j = 0; j < robot_.size(k); ++j) {
      const double limit = safety::moveVelocity(*robot_.limits()[static_cast<std::size_t>(k)], j);
      velocity[j] = std::clamp(velocity[j], -limit, limit);
    }
    moves_[static_cast<std::size_t>(k)] = true;
    const bool late = arm.motion.finished(arm.motion_time - kPatience);
    if (!arm.motion.finished(arm.motion_time - period_) || !(arrived(k) || late))
      return;
    arm.activity = Activity::kNone;
    arm.motion_verb = CrtkMoment::kNone;
    if (arm.homing)
      arm.unhomed = false;
    arm.homing = false;
  }
}

safety::DriveRequest ControlCore::requestFor(int k) const noexcept {
  const ArmControl& arm = arm_[k];
  const OperatingState drive = driveState(k);
  switch (arm.machine.state()) {
    case OperatingState::kEnabled:
      if (!arm.pending)
        return safety::DriveRequest::kKeep;
      if (arm.recovering && state_.recovery[static_cast<std::size_t>(k)] == 0 &&
          (drive == OperatingState::kEnabled || drive == OperatingState::kPaused))
        return safety::DriveRequest::kDisable;  // power that was given for something else
      if (drive == OperatingState::kPaused)
        return safety::DriveRequest::kResume;
      return arm.recovering ? safety::DriveRequest::kRecover : safety::DriveRequest::kEnable;
    case OperatingState::kPaused:
      return drive == OperatingState::kEnabled ? safety::DriveRequest::kPause : safety::DriveRequest::kKeep;
    case OperatingState::kFault:
      // Their own faults stay latched there until somebody disables; ours end in a stop with power off.
      return drive == OperatingState::kEnabled || drive == OperatingState::kPaused ? safety::DriveRequest::kDisable
                                                                                   : safety::DriveRequest::kKeep;
    case OperatingState::kDisabled:
      return drive == OperatingState::kDisabled ? safety::DriveRequest::kKeep : safety::DriveRequest::kDisable;
  }
  return safety::DriveRequest::kKeep;
}

/// Whose tasks are done in this cycle: an operator's before CRTK clients', and planning's where nobody else wants to.
dds::Source ControlCore::chooseSource(std::int64_t now, bool advance) noexcept {
  tips_known_ = !lock_step_ && findTips();
  if (operate(now)) {
    crtk_.endAll();
    return dds::Source::kTeleoperation;
  }
  if (obeyCrtk(now))
    return dds::Source::kCrtk;
  bool enabled = state_.sequence > 0 && (advance || !lock_step_);
  for (int k = 0; k < arm_count_; ++k) {
    enabled = enabled && arm_[k].machine.mayMove() && !arm_[k].pending && !recovering(k) &&
              arm_[k].activity == Activity::kNone && !crtk_.movesJoints(k);
  }
  return enabled && following() ? dds::Source::kPlanning : dds::Source::kNobody;
}

void ControlCore::cycle(std::int64_t now, bool advance, CycleOutput& output) noexcept {
  watch(now);
  watchIdle(now);
  readPositions();
  velocity_.setZero();
  moves_.fill(false);
  tracked_ = false;
  hold_ = dds::HoldReason::kNone;
  kept_out_of_ = -1;
  source_ = chooseSource(now, advance);
  if (source_ != dds::Source::kNobody) {
    follow(now);
  } else if (state_.sequence > 0) {
    tracker_->observe(q_, base_);
  }
  for (int k = 0; k < arm_count_; ++k) {
    if (arm_[k].machine.mayMove() && !arm_[k].pending && (advance || !lock_step_))
      moveJoints(k, now);
  }
  fillCommand(now, advance, output.command);
  if (frames_ && state_.sequence > 0)
    frames_->ask(now, base_, lastSent(), *tracker_);
  fillLimits(output.limits);
  fillStatus(now, output.status);
  fresh_state_ = false;
  if (advance)
    answered_state_ = state_.sequence;
}

bool ControlCore::readyToAdvance() const noexcept {
  if (state_.sequence == 0 || state_.sequence == answered_state_)
    return false;
  bool motion = false;
  for (int k = 0; k < arm_count_; ++k) {
    if (!arm_[k].machine.mayMove() || arm_[k].pending)
      return false;
    motion = motion || arm_[k].activity != Activity::kNone;
  }
  if (motion)
    return true;
  return following() && static_cast<planning::Phase>(reference_.phase) == planning::Phase::kRunning &&
         reference_.answers_state == state_.sequence && (!sensor_ || tips_.knows(state_));
}

bool ControlCore::drivesPending() const noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    if (requestFor(k) != safety::DriveRequest::kKeep)
      return true;
  }
  return false;
}

}  // namespace tandem::service
