// SPDX-License-Identifier: Apache-2.0
/** @file ControlCore: orders of clients. */
#include <algorithm>
#include <cstdio>

#include "services/control/control_core.h"

namespace tandem::service {
namespace {

OrderReply& refuse(OrderReply& reply, dds::ReplyCode code, const char* reason) noexcept {
  reply.code = code;
  std::snprintf(reply.reason.data(), reply.reason.size(), "%s", reason);
  return reply;
}

}  // namespace

OrderReply ControlCore::order(const ControlOrder& order, std::int64_t now) noexcept {
  OrderReply reply;
  reply.client = order.client;
  reply.request = order.request;
  reply.retired = order.tracker;
  reply.status = status_sequence_;
  using Kind = dds::ControlKind;
  if (order.kind == Kind::kAcquireLease || order.kind == Kind::kReleaseLease || order.kind == Kind::kKeepLease) {
    return leaseOrder(order, reply, now);
  }
  // Anybody may take power away; only the commander may give it, or clear a fault. CRTK's topic knows no clients: it
  // counts while nobody holds the lease.
  const bool stopping = order.kind == Kind::kStateCommand && (order.command == safety::StateCommand::kDisable ||
                                                              order.command == safety::StateCommand::kPause);
  const std::uint64_t holder = lease_.holder(now);
  const bool holds = order.from_topic ? holder == 0 || holder == dds::kCrtkClient : lease_.holds(order.client, now);
  if (!stopping && !holds) {
    return refuse(
        reply, dds::ReplyCode::kNotLeaseHolder,
        lease_.holder(now) == 0 ? "acquire the control lease first" : "another client holds the control lease");
  }
  switch (order.kind) {
    case Kind::kStateCommand:
      return stateCommand(order, reply, holds, now);
    case Kind::kMoveJp:
    case Kind::kJog:
    case Kind::kHome:
    case Kind::kHold:
    case Kind::kWithdraw:
      return motionOrder(order, reply, now);
    case Kind::kSetMethod:
    case Kind::kSetParameter:
      if (following())
        return refuse(reply, dds::ReplyCode::kBusy, "a trajectory is being followed; pause or stop it first");
      if (operated())
        return refuse(reply, dds::ReplyCode::kBusy, "an operator moves the robot; release the dead-man switch first");
      order.tracker->continueFrom(*tracker_);
      reply.retired = tracker_.release();
      tracker_.reset(order.tracker);
      reply.method_accepted = true;
      return reply;
    default:
      return refuse(reply, dds::ReplyCode::kUnknown, "unknown kind of request");
  }
}

OrderReply ControlCore::leaseOrder(const ControlOrder& order, OrderReply reply, std::int64_t now) noexcept {
  switch (order.kind) {
    case dds::ControlKind::kAcquireLease:
      if (lease_.acquire(order.client, now))
        return reply;
      return refuse(reply, dds::ReplyCode::kLeaseTaken, "another client holds the control lease");
    case dds::ControlKind::kReleaseLease:
      if (moving())
        return refuse(reply, dds::ReplyCode::kBusy, "the robot moves; pause or stop it first");
      if (lease_.release(order.client, now))
        return reply;
      break;
    default:
      if (lease_.keep(order.client, now))
        return reply;
      break;
  }
  return refuse(reply, dds::ReplyCode::kNotLeaseHolder, "this client does not hold the control lease");
}

bool ControlCore::inFault(int k) const noexcept {
  return arm_[k].machine.state() == safety::OperatingState::kFault || driveState(k) == safety::OperatingState::kFault;
}

/// After the state machine has left ENABLED or FAULT for DISABLED.
void ControlCore::disarm(int k) noexcept {
  ArmControl& arm = arm_[k];
  arm.deaf_until = command_sequence_ + 1;
  arm.record = {};
  arm.pending = false;
  arm.activity = Activity::kNone;
  spent_trajectory_ = reference_.trajectory_id;
}

/** Torque does not stay for ever: where nobody holds the lease and nothing moves, an arm that stays where it is without
 * power loses it. In lock-step there is no power, and time does not pass by itself. */
void ControlCore::watchIdle(std::int64_t now) noexcept {
  if (lock_step_)
    return;
  bool commanded = lease_.holder(now) != 0 || operated() || trajectoryRuns();
  for (int k = 0; k < arm_count_; ++k)
    commanded = commanded || arm_[k].activity != Activity::kNone;
  for (int k = 0; k < arm_count_; ++k) {
    safety::StateMachine& machine = arm_[k].machine;
    const bool powered =
        machine.state() == safety::OperatingState::kEnabled || machine.state() == safety::OperatingState::kPaused;
    const auto verdict = idle_.step(k, powered, commanded, state_.holds[static_cast<std::size_t>(k)] != 0, now);
    if (verdict == safety::IdlePower::Verdict::kNothing)
      continue;
    const bool off = verdict == safety::IdlePower::Verdict::kPowerOff;
    idle_reports_.push({k, idle_.idle(k), off});
    if (off && machine.command(safety::StateCommand::kDisable))
      disarm(k);
  }
}

bool ControlCore::refused(const ControlOrder& order, int k, OrderReply& reply) const noexcept {
  const auto i = static_cast<std::size_t>(k);
  const safety::OperatingState state = arm_[k].machine.state();
  const char* name = setup_.robot.arms[i].name.c_str();
  const bool recover = order.command == safety::StateCommand::kRecover;
  const bool enable = order.command == safety::StateCommand::kEnable;
  reply.code = dds::ReplyCode::kWrongState;
  if ((enable || recover || order.command == safety::StateCommand::kResume) && state_.sequence == 0) {
    refuse(reply, dds::ReplyCode::kWrongState, "no actuation/state yet");
  } else if (!recover && (enable || order.command == safety::StateCommand::kResume) &&
             driveState(k) == safety::OperatingState::kFault) {
    refuse(reply, dds::ReplyCode::kWrongState, "the drives are in FAULT; disable first");
  } else if (!safety::transition(state, order.command)) {
    std::snprintf(reply.reason.data(), reply.reason.size(), "%s: '%s' is not allowed in %s%s", name,
                  safety::name(order.command).data(), safety::name(state).data(),
                  state == safety::OperatingState::kFault ? "; only 'disable' clears a fault" : "");
  } else if (recovering(k) && (enable || order.command == safety::StateCommand::kHome ||
                               order.command == safety::StateCommand::kUnhome)) {
    refuse(reply, dds::ReplyCode::kWrongState,
           "the arm is being recovered: only jog and withdraw move it; disable it, then enable");
  } else if (recover && driveState(k) != safety::OperatingState::kDisabled &&
             driveState(k) != safety::OperatingState::kFault) {
    refuse(reply, dds::ReplyCode::kWrongState, "the drives are not DISABLED yet; ask again");
  } else if (enable && state == safety::OperatingState::kDisabled && state_.homed[i] == 0) {
    std::snprintf(reply.reason.data(), reply.reason.size(),
                  "%s: its joints do not know where they are yet; home it: tandem home", name);
  } else if (const safety::Excess outside =
                 safety::largestExcess(*robot_.limits()[i], dds::jointsOf(state_.position, k, robot_.size(k)));
             enable && state == safety::OperatingState::kDisabled && state_.valid[i] != 0 &&
             outside.amount > safety::kAtRest) {
    reply.code = dds::ReplyCode::kOutsideLimits;
    std::snprintf(
        reply.reason.data(), reply.reason.size(),
        "%s: joint %d is %.3g mm or mrad outside its limits; to bring it back: recover, jog it inwards, disable", name,
        outside.joint + 1, 1e3 * outside.amount);
  } else {
    reply.code = dds::ReplyCode::kOk;
    return false;
  }
  return true;
}

void ControlCore::obey(const ControlOrder& order, int k, std::int64_t now) noexcept {
  constexpr std::int64_t kPatience = 8'000'000'000;  // ns: limits are written, drives get power
  ArmControl& arm = arm_[k];
  arm.machine.command(order.command);
  switch (order.command) {
    case safety::StateCommand::kRecover:
      arm.record = {};
      arm.without = 0;
      for (int j = 0; j < order.joint_count; ++j)
        arm.without |= order.joints[static_cast<std::size_t>(j)] != 0.0 ? safety::jointBit(j) : safety::JointMask{0};
      [[fallthrough]];
    case safety::StateCommand::kEnable:
    case safety::StateCommand::kResume:
      if (order.command != safety::StateCommand::kResume)
        arm.recovering = order.command == safety::StateCommand::kRecover;
      arm.pending = true;
      arm.pending_until = now + kPatience;
      arm.power_command = command_sequence_ + 1;
      break;
    case safety::StateCommand::kDisable:
      disarm(k);
      break;
    case safety::StateCommand::kPause:
      arm.pending = false;
      arm.activity = Activity::kNone;
      break;
    case safety::StateCommand::kHome:
      arm.homing = startMotion(k, arm.home);
      break;
    case safety::StateCommand::kUnhome:
      arm.unhomed = true;
      break;
  }
}

OrderReply ControlCore::stateCommand(const ControlOrder& order,
                                     OrderReply reply,
                                     bool commander,
                                     std::int64_t now) noexcept {
  const int first = order.arm == dds::kAllArms ? 0 : order.arm;
  const int last = order.arm == dds::kAllArms ? arm_count_ - 1 : order.arm;
  bool uncleared = false;
  // All arms or none: what is forbidden for one is refused before any other one changes.
  for (int k = first; k <= last; ++k) {
    uncleared = uncleared || (!commander && inFault(k));
    if (refused(order, k, reply))
      return reply;
  }
  for (int k = first; k <= last; ++k) {
    if (commander || !inFault(k))
      obey(order, k, now);
  }
  if (uncleared)
    return refuse(reply, dds::ReplyCode::kNotLeaseHolder,
                  "power is off; who clears a fault has to hold the control lease");
  return reply;
}

/// Drives that do not give the power that was asked for shall not give it later, when nobody thinks of it any more.
void ControlCore::giveUpPending(std::int64_t now) noexcept {
  for (int k = 0; k < arm_count_; ++k) {
    if (arm_[k].pending && now > arm_[k].pending_until)
      latch(k, {bit(safety::Fault::kDrive), safety::FaultCause::kOff});
  }
}

void ControlCore::jog(int k, std::int64_t now) noexcept {
  const auto i = static_cast<std::size_t>(k);
  ArmControl& arm = arm_[k];
  if (now > arm.jog_until) {
    arm.activity = Activity::kNone;
    return;
  }
  auto velocity = velocity_.segment(robot_.offset(k), robot_.size(k));
  velocity = arm.jog_velocity;
  for (int j = 0; recovering(k) && j < robot_.size(k); ++j) {
    const double most = safety::recoveryVelocity(*robot_.limits()[i], state_.lost[i], j);
    velocity[j] = std::clamp(velocity[j], -most, most);
  }
  moves_[i] = true;
}

void ControlCore::withdraw(int k, std::int64_t now) noexcept {
  const auto i = static_cast<std::size_t>(k);
  velocity_.segment(robot_.offset(k), robot_.size(k)) =
      arm_[k].withdrawal.step(*robot_.limits()[i], base(k), state_.lost[i], period_, now);
  moves_[i] = !arm_[k].withdrawal.done();
  if (arm_[k].withdrawal.done())
    arm_[k].activity = Activity::kNone;
}

bool ControlCore::startMotion(int k, const safety::ArmVector& goal) noexcept {
  ArmControl& arm = arm_[k];
  if (following() || operated() || recovering(k) || shownState(k) != safety::OperatingState::kEnabled)
    return false;
  arm.motion = safety::JointMotion(*robot_.limits()[static_cast<std::size_t>(k)], base(k), goal);
  arm.motion_time = 0.0;
  arm.activity = Activity::kMotion;
  arm.motion_verb = CrtkMoment::kNone;
  return true;
}

OrderReply ControlCore::motionOrder(const ControlOrder& order, OrderReply reply, std::int64_t now) noexcept {
  const int first = order.arm == dds::kAllArms ? 0 : order.arm;
  const int last = order.arm == dds::kAllArms ? arm_count_ - 1 : order.arm;
  if (order.kind != dds::ControlKind::kHold) {
    if (following())
      return refuse(reply, dds::ReplyCode::kBusy, "a trajectory is being followed; pause or stop it first");
    if (operated())
      return refuse(reply, dds::ReplyCode::kBusy, "an operator moves the robot; release the dead-man switch first");
    for (int k = first; k <= last; ++k) {
      if (shownState(k) != safety::OperatingState::kEnabled) {
        return refuse(reply, dds::ReplyCode::kWrongState, "the arm is not ENABLED; enable it first");
      }
      if (order.kind == dds::ControlKind::kWithdraw && !recovering(k))
        return refuse(reply, dds::ReplyCode::kWrongState, "the arm is not being recovered; recover it first");
      if (order.kind != dds::ControlKind::kWithdraw && order.kind != dds::ControlKind::kJog && recovering(k))
        return refuse(reply, dds::ReplyCode::kWrongState,
                      "the arm is being recovered: only jog and withdraw move it; disable it, then enable");
    }
  }
  safety::ArmVector joints = Eigen::Map<const Eigen::VectorXd>(order.joints.data(), order.joint_count);
  if (order.kind == dds::ControlKind::kMoveJp &&
      safety::largestViolation(*robot_.limits()[static_cast<std::size_t>(order.arm)], joints) > 1e-9) {
    return refuse(reply, dds::ReplyCode::kOutsideLimits, "the goal lies outside the limits of the arm");
  }
  for (int k = first; k <= last; ++k) {
    ArmControl& arm = arm_[k];
    switch (order.kind) {
      case dds::ControlKind::kMoveJp:
        startMotion(k, joints);
        break;
      case dds::ControlKind::kHome:
        arm.homing = startMotion(k, arm.home);
        break;
      case dds::ControlKind::kJog:
        arm.activity = Activity::kJog;
        arm.jog_velocity = joints;
        arm.jog_until =
            now + static_cast<std::int64_t>(1e9 * std::max(setup_.deployment.budgets.teleoperation, 2.0 * period_));
        break;
      case dds::ControlKind::kWithdraw:
        arm.withdrawal.start();
        arm.activity = Activity::kWithdraw;
        break;
      default:
        arm.activity = Activity::kNone;
        break;
    }
  }
  return reply;
}

}  // namespace tandem::service
