// SPDX-License-Identifier: Apache-2.0
#include "operation/permission.h"

#include <algorithm>

#include "operation/convert.h"
#include "robots/capability.h"

namespace tandem::operation {
namespace {

using safety::OperatingState;
using safety::StateCommand;

/// Reply code of a reason, for programs.
constexpr msg::ReplyCode codeOf(Reason reason) noexcept {
  using enum idl::RefusalReason;
  switch (reason) {
    case kNone:
      return msg::ReplyCode::kOk;
    case kNoLease:
    case kOtherLease:
    case kNotHolder:
    case kFaultIsTheHolders:
    case kNotCommander:
      return msg::ReplyCode::kNotLeaseOwner;
    case kLeaseTaken:
      return msg::ReplyCode::kLeaseTaken;
    case kMoving:
    case kFollowed:
    case kOperated:
    case kTrajectory:
    case kJoints:
    case kTooFast:
      return msg::ReplyCode::kBusy;
    case kOutsideLimits:
    case kGoalOutside:
      return msg::ReplyCode::kOutsideLimits;
    case kOtherControl:
    case kOutOfSequence:
    case kLate:
    case kNotFinite:
    case kDevice:
    case kKind:
    case kFrame:
    case kView:
    case kMode:
    case kArm:
    case kScale:
      return msg::ReplyCode::kMalformed;
    case Reason::kMismatch:
      return msg::ReplyCode::kMismatch;
    default:
      return msg::ReplyCode::kWrongState;
  }
}

/// Every client may remove power, or request a free lease.
Reason againstRequester(Action action, Requester requester) noexcept {
  if (requester == Requester::kLeaseOwner || action == Action::kDisable || action == Action::kPause)
    return Reason::kNone;
  if (action == Action::kAcquireLease)
    return requester == Requester::kOtherClient ? Reason::kLeaseTaken : Reason::kNone;
  if (action == Action::kKeepLease || action == Action::kReleaseLease)
    return Reason::kNotHolder;
  return requester == Requester::kOtherClient ? Reason::kOtherLease : Reason::kNoLease;
}

/// Objection from the state of the robot as a whole.
Reason againstRobot(Action action, const RobotCondition& now) noexcept {
  if (now.mismatch && !isHarmless(action))
    return Reason::kMismatch;
  switch (action) {
    case Action::kHome:
    case Action::kMoveJp:
    case Action::kJog:
    case Action::kWithdraw:
    case Action::kSetMethod:
    case Action::kStart:
      return now.followed ? Reason::kFollowed : now.operated ? Reason::kOperated : Reason::kNone;
    case Action::kReleaseLease:
      return now.moving ? Reason::kMoving : Reason::kNone;
    case Action::kEnable:
    case Action::kResume:
    case Action::kRecover:
      return now.received ? Reason::kNone : Reason::kNoState;
    case Action::kTeleoperate:
    case Action::kCrtkTip:
      if (now.lock_step)
        return Reason::kLockStep;
      return !now.tip_tasks ? Reason::kCommonObject : now.running ? Reason::kTrajectory : Reason::kNone;
    case Action::kCrtkMove:
    case Action::kCrtkJoints:
      if (now.lock_step && action == Action::kCrtkJoints)
        return Reason::kLockStep;
      return now.running ? Reason::kTrajectory : Reason::kNone;
    case Action::kCrtkHold:
      return now.lock_step ? Reason::kLockStep : Reason::kNone;
    case Action::kDisable:
    case Action::kPause:
    case Action::kUnhome:
    case Action::kHold:
    case Action::kSteer:
    case Action::kAcquireLease:
    case Action::kKeepLease:
    case Action::kHomeDrives:
      break;
  }
  return Reason::kNone;
}

/// Objection of an arm to a command of CRTK's state table.
Reason againstCommand(StateCommand command, Requester requester, const ArmCondition& arm) noexcept {
  const bool enable = command == StateCommand::kEnable;
  if ((enable || command == StateCommand::kResume) && arm.drives == OperatingState::kFault)
    return Reason::kDrivesInFault;
  if (!safety::transition(arm.wanted, command))
    return Reason::kWrongState;
  if (arm.recovering && (enable || command == StateCommand::kUnhome))
    return Reason::kRecovering;
  if (command == StateCommand::kRecover && arm.drives != OperatingState::kDisabled &&
      arm.drives != OperatingState::kFault)
    return Reason::kDrivesNotDisabled;
  if (enable && arm.wanted == OperatingState::kDisabled) {
    if (!arm.located)
      return Reason::kJointsUnknown;
    if (arm.valid && arm.outside.amount > 0.0)
      return Reason::kOutsideLimits;
  }
  if (requester != Requester::kLeaseOwner && arm.faulty())
    return Reason::kFaultIsTheHolders;
  return command == StateCommand::kDisable && arm.unseen ? Reason::kFaultNotSeen : Reason::kNone;
}

Reason againstArm(Action action, Requester requester, const RobotCondition& now, const ArmCondition& arm) noexcept {
  switch (action) {
    case Action::kHome:
    case Action::kMoveJp:
    case Action::kStart:
      return !arm.enabled() ? Reason::kNotEnabled : arm.recovering ? Reason::kRecovering : Reason::kNone;
    case Action::kJog:
      return arm.enabled() ? Reason::kNone : Reason::kNotEnabled;
    case Action::kWithdraw:
      return !arm.recovering ? Reason::kNotRecovering : arm.enabled() ? Reason::kNone : Reason::kNotEnabled;
    case Action::kTeleoperate:
      if (!arm.ready())
        return Reason::kNotEnabled;
      return arm.joints_move ? Reason::kJoints : now.tips_known ? Reason::kNone : Reason::kTips;
    case Action::kHomeDrives:
      return arm.wanted == OperatingState::kDisabled && arm.drives == OperatingState::kDisabled ? Reason::kNone
                                                                                                : Reason::kNotDisabled;
    case Action::kCrtkMove:
    case Action::kCrtkJoints:
    case Action::kCrtkTip:
      return !arm.ready() ? Reason::kNotEnabled : arm.homed ? Reason::kNone : Reason::kNotHomed;
    case Action::kEnable:
    case Action::kDisable:
    case Action::kPause:
    case Action::kResume:
    case Action::kUnhome:
    case Action::kRecover:
      return againstCommand(static_cast<StateCommand>(action), requester, arm);
    case Action::kHold:
    case Action::kSetMethod:
    case Action::kSteer:
    case Action::kAcquireLease:
    case Action::kKeepLease:
    case Action::kReleaseLease:
    case Action::kCrtkHold:
      break;
  }
  return Reason::kNone;
}

/// The state of an arm that is not ENABLED, and the command that leads out of it; empty for the other states.
std::string wayToEnabled(OperatingState state) {
  switch (state) {
    case OperatingState::kPaused:
      return "the arm is PAUSED, not ENABLED; 'resume' continues, 'disable' ends the motion";
    case OperatingState::kFault:
      return "the arm is in FAULT, not ENABLED; 'disable' clears the fault, then 'enable'";
    default:
      return {};
  }
}

}  // namespace

bool isHarmless(Action action) noexcept {
  switch (action) {
    case Action::kDisable:
    case Action::kPause:
    case Action::kUnhome:
    case Action::kHold:
    case Action::kSteer:
    case Action::kAcquireLease:
    case Action::kKeepLease:
    case Action::kReleaseLease:
    case Action::kCrtkHold:
      return true;
    default:
      return false;
  }
}

bool isOfOneArm(const Refusal& refusal) noexcept {
  return refusal.reason == Reason::kFaultIsTheHolders || refusal.reason == Reason::kFaultNotSeen;
}

Requester requesterOf(std::uint64_t client, std::uint64_t owner) noexcept {
  if (owner == 0)
    return Requester::kNoLeaseOwner;
  return client == owner && client != msg::kCrtkClient ? Requester::kLeaseOwner : Requester::kOtherClient;
}

Requester crtkRequester(std::uint64_t owner) noexcept {
  return owner == 0 || owner == msg::kCrtkClient ? Requester::kLeaseOwner : Requester::kOtherClient;
}

Refusal judge(Action action, Requester requester, const RobotCondition& now, int arm) noexcept {
  Refusal refusal{againstRequester(action, requester), action};
  if (!refusal)
    refusal.reason = againstRobot(action, now);
  const int first = arm == msg::kAllArms ? 0 : arm, last = arm == msg::kAllArms ? now.arm_count - 1 : arm;
  for (int k = first; k <= last && (!refusal || isOfOneArm(refusal)); ++k) {
    const ArmCondition& of = now.arm[static_cast<std::size_t>(k)];
    if (const Reason reason = againstArm(action, requester, now, of); reason != Reason::kNone)
      refusal = {reason, action, of.wanted, static_cast<std::int8_t>(k), of.outside};
  }
  return refusal;
}

void fill(const RobotCondition& now, msg::ControlPermissions& permissions) noexcept {
  static_assert(kActions <= msg::kActionsPerArm);
  permissions.arm_count = static_cast<std::uint8_t>(now.arm_count);
  for (int k = 0; k < now.arm_count; ++k) {
    for (int action = 0; action < kActions; ++action) {
      const auto asked = static_cast<Action>(action);
      permissions.reason[permissionIndex(asked, k)] =
          static_cast<std::uint8_t>(judge(asked, Requester::kLeaseOwner, now, k).reason);
    }
  }
}

RobotCondition conditionOf(const config::Robot& robot,
                           const msg::ActuationState& state,
                           const msg::ControlStatus& status,
                           planning::Phase phase) noexcept {
  RobotCondition now;
  const auto source = static_cast<msg::Source>(status.source);
  now.lock_step = state.lock_step != 0;
  now.tip_tasks = has(robot, robots::Capability::kTips);
  now.received = state.sequence > 0;
  now.running = phase == planning::Phase::kRunning;
  now.followed = now.running || phase == planning::Phase::kPaused;
  now.operated = source == msg::Source::kTeleoperation || source == msg::Source::kCrtk;
  now.moving = now.operated;
  now.tips_known = now.received;
  now.arm_count = std::min<int>(status.arm_count, static_cast<int>(robot.arms.size()));
  for (int k = 0; k < now.arm_count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const safety::ArmLimits& limits = robot.arms[i].limits;
    ArmCondition& arm = now.arm[i];
    arm.wanted = static_cast<OperatingState>(status.operating_state[i]);
    arm.drives = static_cast<OperatingState>(state.operating_state[i]);
    arm.valid = state.valid[i] != 0;
    arm.located = state.homed[i] != 0;
    arm.homed = status.homed[i] != 0;
    arm.recovering = status.recovery[i] != 0;
    arm.joints_move = status.busy[i] != 0;
    now.moving = now.moving || (arm.enabled() && (now.followed || arm.joints_move));
    arm.outside = safety::readOutside(limits, msg::jointsOf(state.position, k, limits.jointCount()));
  }
  return now;
}

msg::ReplyCode Refusal::code() const noexcept { return codeOf(reason); }

std::string describe(const Refusal& refusal, const config::Robot& robot) {
  const bool named = refusal.arm >= 0 && static_cast<std::size_t>(refusal.arm) < robot.arms.size();
  const std::string arm = named ? robot.arms[static_cast<std::size_t>(refusal.arm)].name + ": " : "";
  const auto outside = [&] {
    const config::Arm& of = robot.arms[static_cast<std::size_t>(named ? refusal.arm : 0)];
    return safety::describe(refusal.outside, of.limits,
                            of.joint_names[static_cast<std::size_t>(refusal.outside.joint)]) +
           " ";
  };
  const std::string reason(name(refusal.reason));
  switch (refusal.reason) {
    case Reason::kWrongState:
      return arm + "'" + std::string(idl::name(refusal.action)) + "' is not allowed in " +
             std::string(safety::name(refusal.state)) +
             (refusal.state == OperatingState::kFault      ? "; only 'disable' clears a fault"
              : refusal.state == OperatingState::kDisabled ? "; 'enable' comes first"
                                                           : "");
    case Reason::kNotEnabled: {
      const std::string way = wayToEnabled(refusal.state);
      return arm + (way.empty() ? reason : way);
    }
    case Reason::kOutsideLimits:
      return arm + outside() + reason;
    case Reason::kGoalOutside:
      return arm + reason + ": there " + outside() + "outside";
    default:
      return arm + reason;
  }
}

}  // namespace tandem::operation
