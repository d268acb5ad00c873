// SPDX-License-Identifier: Apache-2.0
/** @file ControlCore: cycles. */
#include "services/control/control_core.h"

#include <algorithm>
#include <cmath>

#include "services/common/periodic_loop.h"

namespace tandem::service {
namespace {

std::size_t index(int arm, int joint) { return static_cast<std::size_t>(arm * safety::kMaxJointsPerArm + joint); }

using safety::OperatingState;

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
      arm_count_(robot.armCount()) {
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
  state_ = state;
  if (new_session)
    answered_state_ = 0;
  for (int k = 0; k < arm_count_; ++k) {
    ArmControl& arm = arm_[k];
    const auto i = static_cast<std::size_t>(k);
    // The drives started anew: whatever moved before does not move on.
    if (new_session && arm.machine.state() != OperatingState::kDisabled)
      latch(k, bit(safety::Fault::kDrive));
    if (state.faults[i] != 0 && state.answers_command >= arm.deaf_until)
      latch(k, state.faults[i]);
    if (state.valid[i] == 0 && arm.machine.mayMove())
      latch(k, bit(safety::Fault::kSensor));
    if (driveState(k) == OperatingState::kEnabled && arm.machine.mayMove()) {
      arm.pending = false;
    } else if (arm.machine.mayMove() && !arm.pending) {
      latch(k, bit(safety::Fault::kDrive));  // they left ENABLED by themselves
    }
    if (!arm.machine.mayMove())
      arm.activity = Activity::kNone;
  }
}

void ControlCore::onReference(const dds::PlanningReference& reference) noexcept { reference_ = reference; }

void ControlCore::stop() noexcept {
  for (int k = 0; k < arm_count_; ++k)
    latch(k, bit(safety::Fault::kStopRequested));
}

void ControlCore::latch(int k, safety::FaultMask faults) noexcept {
  arm_[k].machine.latch(faults);
  spent_trajectory_ = reference_.trajectory_id;
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
  for (int k = 0; k < arm_count_; ++k) {
    if (arm_[k].machine.mayMove() && (arm_[k].activity != Activity::kNone || following()))
      return true;
  }
  return false;
}

void ControlCore::latchMoving(safety::Fault fault) noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    if (arm_[k].machine.mayMove())
      latch(k, bit(fault));
  }
}

void ControlCore::watch(std::int64_t now) noexcept {
  if (first_cycle_ == 0)
    first_cycle_ = now;
  if (lease_.takeLoss(now) && moving())
    latchMoving(safety::Fault::kLeaseLost);
  if (lock_step_)
    return;  // stamps are simulated time there; a dead process stalls everything
  const safety::Budgets& budgets = setup_.deployment.budgets;
  if (command_times_.age(state_.answers_command, now) > budgets.commandAge(period_))
    latchMoving(safety::Fault::kStateTimeout);
  // A reference is as old as the status that it had seen: judged on this process's clock alone.
  const double reference_budget = std::max(budgets.planning_reference, 2.5 * period_);
  if (following() && status_times_.age(reference_.answers_control, now) > reference_budget) {
    latchMoving(safety::Fault::kReferenceTimeout);
    reference_.phase = static_cast<std::uint8_t>(planning::Phase::kIdle);
  }
}

void ControlCore::readPositions() noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    for (int j = 0; j < robot_.size(k); ++j)
      q_[robot_.offset(k) + j] = state_.position[index(k, j)];
    base_.segment(robot_.offset(k), robot_.size(k)) = base(k);
  }
}

safety::ArmVector ControlCore::base(int k) const noexcept {
  // The last setpoint that the gate let through, and what has been sent since and is on its way.
  safety::ArmVector from(robot_.size(k));
  for (int j = 0; j < robot_.size(k); ++j)
    from[j] = state_.setpoint[index(k, j)];
  const std::uint64_t in_flight = command_sequence_ - state_.answers_command;
  if (lock_step_)
    return from;
  // No more than two can be: older ones that are not answered have been lost, and must not come back as one long step.
  const std::uint64_t first = command_sequence_ - std::min<std::uint64_t>(in_flight, 2) + 1;
  for (std::uint64_t i = first; i <= command_sequence_; ++i) {
    from += period_ * sent_[i % kSentVelocities].segment(robot_.offset(k), robot_.size(k));
  }
  return from;
}

void ControlCore::follow() noexcept {
  tasks_ = planning::Reference{};
  tasks_.task_count = std::min<int>(reference_.task_count, planning::kMaxTasks);
  for (int k = 0; k < tasks_.task_count; ++k) {
    const dds::TaskReference& from = reference_.tasks[static_cast<std::size_t>(k)];
    planning::TaskReference& to = tasks_.tasks[static_cast<std::size_t>(k)];
    to.kind = static_cast<planning::TaskKind>(from.kind);
    to.arm = from.arm;
    to.other_arm = from.other_arm;
    to.position = Eigen::Vector3d(from.position[0], from.position[1], from.position[2]);
    to.feed_forward = Eigen::Vector3d(from.feed_forward[0], from.feed_forward[1], from.feed_forward[2]);
  }
  const std::int64_t start = monotonicNow();
  tracker_->step(q_, base_, tasks_, track_);
  solve_time_ = 1e-9 * static_cast<double>(monotonicNow() - start);
  tracked_ = true;
  if (track_.status == planning::TrackStatus::kModel)
    latchMoving(safety::Fault::kSolver);
  for (int k = 0; k < arm_count_; ++k) {
    moves_[static_cast<std::size_t>(k)] = arm_[k].machine.mayMove();
    velocity_.segment(robot_.offset(k), robot_.size(k)) =
        track_.solution.velocity.segment(robot_.offset(k), robot_.size(k));
  }
}

void ControlCore::moveJoints(int k, std::int64_t now) noexcept {
  ArmControl& arm = arm_[k];
  auto velocity = velocity_.segment(robot_.offset(k), robot_.size(k));
  if (arm.activity == Activity::kJog) {
    if (now > arm.jog_until) {
      arm.activity = Activity::kNone;
      return;
    }
    velocity = arm.jog_velocity;
    moves_[static_cast<std::size_t>(k)] = true;
  } else if (arm.activity == Activity::kMotion) {
    const auto from = base_.segment(robot_.offset(k), robot_.size(k));
    arm.motion_time += period_;
    velocity = (arm.motion.position(arm.motion_time) - from) / period_;
    moves_[static_cast<std::size_t>(k)] = true;
    // Over when the joints are there, not when the last setpoint has been sent or taken: that one may have been lost,
    // and a hold before its end would leave the joints short of it.
    constexpr double kThere = 1e-7, kPatience = 2.0;  // m or rad; s
    double distance = 0.0;
    for (int j = 0; j < robot_.size(k); ++j) {
      const double goal = arm.motion.goal()[j];
      distance = std::max({distance, std::abs(from[j] - goal), std::abs(q_[robot_.offset(k) + j] - goal)});
    }
    const bool there = distance <= kThere;
    const bool late = arm.motion.finished(arm.motion_time - kPatience);
    if (!arm.motion.finished(arm.motion_time - period_) || !(there || late))
      return;
    arm.activity = Activity::kNone;
    if (arm.homing)
      arm.homed = true;
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
      return drive == OperatingState::kPaused ? safety::DriveRequest::kResume : safety::DriveRequest::kEnable;
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

void ControlCore::cycle(std::int64_t now, bool advance, CycleOutput& output) noexcept {
  watch(now);
  readPositions();
  velocity_.setZero();
  moves_.fill(false);
  tracked_ = false;
  const bool enabled = [this] {
    for (int k = 0; k < arm_count_; ++k) {
      if (!arm_[k].machine.mayMove() || arm_[k].pending || arm_[k].activity != Activity::kNone)
        return false;
    }
    return state_.sequence > 0;
  }();
  if (following() && enabled && (advance || !lock_step_)) {
    follow();
  } else if (state_.sequence > 0) {
    tracker_->observe(base_);
  }
  for (int k = 0; k < arm_count_; ++k) {
    if (arm_[k].machine.mayMove() && !arm_[k].pending && (advance || !lock_step_))
      moveJoints(k, now);
  }
  fillCommand(now, advance, output.command);
  fillLimits(output.limits);
  fillStatus(now, output.status);
  if (advance)
    answered_state_ = state_.sequence;
}

void ControlCore::fillCommand(std::int64_t now, bool advance, dds::ActuationCommand& command) noexcept {
  command = dds::ActuationCommand{};
  command.control_session = setup_.session;
  command.sequence = ++command_sequence_;
  command.state_session = state_.session;
  command.answers_state = state_.sequence;
  command.stamp = lock_step_ ? state_.stamp : now;
  command.advance = advance ? 1 : 0;
  command.arm_count = static_cast<std::uint8_t>(arm_count_);
  command_times_.record(command.sequence, now);
  for (int k = 0; k < arm_count_; ++k) {
    const ArmControl& arm = arm_[k];
    const auto i = static_cast<std::size_t>(k);
    command.request[i] = static_cast<std::uint8_t>(requestFor(k));
    command.moving[i] = moves_[i] && arm.machine.mayMove() ? 1 : 0;
    const auto from = base_.segment(robot_.offset(k), robot_.size(k));
    for (int j = 0; j < robot_.size(k); ++j) {
      const double velocity = command.moving[i] != 0 ? velocity_[robot_.offset(k) + j] : 0.0;
      command.velocity[index(k, j)] = velocity;
      command.position[index(k, j)] = from[j] + period_ * velocity;
      sent_[command.sequence % kSentVelocities][robot_.offset(k) + j] = velocity;
    }
  }
}

void ControlCore::fillLimits(dds::ActuationLimits& limits) const noexcept {
  limits.sequence = command_sequence_;
  limits.answers_state = state_.sequence;
  limits.stamp = state_.stamp;
  limits.arm_count = static_cast<std::uint8_t>(arm_count_);
  const control::StepProblem& problem = tracker_->problem();
  for (int k = 0; k < arm_count_; ++k) {
    limits.joint_count[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(robot_.size(k));
    for (int j = 0; j < robot_.size(k); ++j) {
      const int joint = robot_.offset(k) + j;
      const std::size_t i = index(k, j);
      limits.lower[i] = problem.joint[static_cast<std::size_t>(joint)].moving_lower;
      limits.upper[i] = problem.joint[static_cast<std::size_t>(joint)].moving_upper;
      const bool solved = tracked_ && track_.solution.bounds.lower.size() > joint;
      limits.velocity_lower[i] = solved ? track_.solution.bounds.lower[joint] : 0.0;
      limits.velocity_upper[i] = solved ? track_.solution.bounds.upper[joint] : 0.0;
      limits.active[i] = solved ? track_.solution.joint_active[static_cast<std::size_t>(joint)] : 0;
    }
  }
}

void ControlCore::fillStatus(std::int64_t now, dds::ControlStatus& status) noexcept {
  status = dds::ControlStatus{};
  status.session = setup_.session;
  status.sequence = ++status_sequence_;
  status_times_.record(status.sequence, now);
  status.answers_state = state_.sequence;
  status.answers_reference = reference_.sequence;
  status.stamp = lock_step_ ? state_.stamp : now;
  status.method = static_cast<std::uint8_t>(tracker_->method());
  status.arm_count = static_cast<std::uint8_t>(arm_count_);
  status.lease_holder = lease_.holder(now);
  for (int k = 0; k < arm_count_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    status.operating_state[i] = static_cast<std::uint8_t>(shownState(k));
    status.homed[i] = arm_[k].homed ? 1 : 0;
    status.busy[i] = arm_[k].pending || arm_[k].activity == Activity::kMotion ? 1 : 0;
    status.faults[i] = arm_[k].machine.faults();
  }
  if (tracked_) {
    const control::Solution& solution = track_.solution;
    status.solve_status = static_cast<std::uint8_t>(solution.status);
    status.task_count = static_cast<std::uint8_t>(tasks_.task_count);
    for (std::size_t k = 0; k < status.task_count; ++k) {
      status.task_error[k] = track_.error[k];
      status.task_scale[k] = solution.scale[k];
      status.task_residual[k] = solution.residual[k];
    }
    status.iterations = static_cast<std::uint32_t>(solution.iterations);
    status.kkt_residual = solution.kkt_residual;
    status.active_limits = static_cast<std::uint32_t>(solution.active_count);
    status.solve_time = solve_time_;
  }
  status.period = period_;
  status.cycle_time = timing_.cycle_time;
  status.cycle_time_max = timing_.cycle_time_max;
  status.jitter_max = timing_.jitter_max;
  status.cycles = timing_.cycles;
  status.overruns = timing_.overruns;
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
         reference_.answers_state == state_.sequence;
}

bool ControlCore::drivesPending() const noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    if (requestFor(k) != safety::DriveRequest::kKeep)
      return true;
  }
  return false;
}

}  // namespace tandem::service
