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
      return stateCommand(order, reply, holds);
    case Kind::kMoveJp:
    case Kind::kJog:
    case Kind::kHome:
    case Kind::kHold:
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

OrderReply ControlCore::stateCommand(const ControlOrder& order, OrderReply reply, bool commander) noexcept {
  const int first = order.arm == dds::kAllArms ? 0 : order.arm;
  const int last = order.arm == dds::kAllArms ? arm_count_ - 1 : order.arm;
  const bool powers = order.command == safety::StateCommand::kEnable || order.command == safety::StateCommand::kResume;
  bool uncleared = false;
  // All arms or none: what the table forbids for one is refused before any other one changes.
  for (int k = first; k <= last; ++k) {
    const safety::OperatingState state = arm_[k].machine.state();
    if (powers && state_.sequence == 0)
      return refuse(reply, dds::ReplyCode::kWrongState, "no actuation/state yet");
    if (powers && driveState(k) == safety::OperatingState::kFault) {
      return refuse(reply, dds::ReplyCode::kWrongState, "the drives are in FAULT; disable first");
    }
    uncleared = uncleared || (!commander && inFault(k));
    if (!safety::transition(state, order.command)) {
      std::snprintf(reply.reason.data(), reply.reason.size(), "%s: '%s' is not allowed in %s%s",
                    setup_.robot.arms[static_cast<std::size_t>(k)].name.c_str(), safety::name(order.command).data(),
                    safety::name(state).data(),
                    state == safety::OperatingState::kFault ? "; only 'disable' clears a fault" : "");
      reply.code = dds::ReplyCode::kWrongState;
      return reply;
    }
  }
  for (int k = first; k <= last; ++k) {
    ArmControl& arm = arm_[k];
    if (!commander && inFault(k))
      continue;
    arm.machine.command(order.command);
    switch (order.command) {
      case safety::StateCommand::kEnable:
      case safety::StateCommand::kResume:
        arm.pending = true;
        arm.power_command = command_sequence_ + 1;
        break;
      case safety::StateCommand::kDisable:
        arm.deaf_until = command_sequence_ + 1;
        arm.record = {};
        spent_trajectory_ = reference_.trajectory_id;
        [[fallthrough]];
      case safety::StateCommand::kPause:
        arm.pending = false;
        arm.activity = Activity::kNone;
        break;
      case safety::StateCommand::kHome:
        arm.homing = startMotion(k, arm.home);
        break;
      case safety::StateCommand::kUnhome:
        arm.homed = false;
        break;
    }
  }
  if (uncleared)
    return refuse(reply, dds::ReplyCode::kNotLeaseHolder,
                  "power is off; who clears a fault has to hold the control lease");
  return reply;
}

bool ControlCore::startMotion(int k, const safety::ArmVector& goal) noexcept {
  ArmControl& arm = arm_[k];
  if (following() || operated() || shownState(k) != safety::OperatingState::kEnabled)
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
      default:
        arm.activity = Activity::kNone;
        break;
    }
  }
  return reply;
}

}  // namespace tandem::service
