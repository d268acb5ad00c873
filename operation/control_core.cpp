// SPDX-License-Identifier: Apache-2.0
#include "operation/control_core.h"

#include <algorithm>

#include "robots/capability.h"

namespace tandem::operation {

using msg::Source;
using safety::Fault;

ControlCore::ControlCore(const ControlSetup& setup,
                         std::unique_ptr<planning::ReferenceTracker> tracker,
                         ObjectControl* object_control)
    : setup_(setup),
      lease_(setup.lockStep() ? setup.deployment.budgets.lock_step : setup.deployment.budgets.lease),
      interlock_(setup.deployment.least_clearance, setup.deployment.budgets.clearance),
      drives_(setup),
      arms_(setup, drives_),
      motions_(setup, drives_),
      reference_(setup),
      loop_(setup, drives_, std::move(tracker), object_control),
      manual_(setup, drives_) {}

void ControlCore::onState(const msg::ActuationState& state, std::uint64_t arrivals) noexcept {
  const DriveExchange::StateUpdate update = drives_.take(state, arrivals);
  if (!update.ours)
    return;
  if (update.displaced)
    loop_.restart();
  arms_.onState(update.restarted);
  updateStates();
}

void ControlCore::stop() noexcept {
  arms_.stop();
  updateStates();
}

void ControlCore::onMismatch(std::int64_t now) noexcept {
  constexpr std::int64_t kLasts = 1'000'000'000;  // ns
  mismatch_until_ = now + kLasts;
  mismatch_ = true;
  arms_.latchMoving({bit(Fault::kMismatch)});
  updateStates();
}

/// Ends the motion of arms that may not move; ends the trajectory if any arm is without power.
void ControlCore::updateStates() noexcept {
  arms_.resolveGroupEnable();
  for (int k = 0; k < setup_.arms(); ++k) {
    if (!arms_.mayMove(k))
      motions_.end(k);
  }
  if (arms_.anyWithoutPower())
    reference_.spend();
}

RobotCondition ControlCore::condition() const noexcept {
  RobotCondition now;
  now.lock_step = setup_.lockStep();
  now.tip_tasks = has(setup_.robot, robots::Capability::kTips);
  now.received = drives_.received();
  now.mismatch = mismatch_;
  now.followed = reference_.underWay(drives_.state());
  now.running = reference_.running(drives_.state());
  now.operated = now.moving = manual_.active();
  now.tips_known = manual_.tipsKnown();
  now.arm_count = setup_.arms();
  for (int k = 0; k < setup_.arms(); ++k) {
    ArmCondition& arm = now.arm[static_cast<std::size_t>(k)];
    arms_.fill(k, arm);
    arm.homed = motions_.homed(k) && !motions_.homing(k);
    arm.joints_move = motions_.active(k);
    arm.outside = safety::readOutside(setup_.limits(k), setup_.of(k, drives_.measured()));
    now.moving = now.moving || (arms_.mayMove(k) && (arm.joints_move || now.followed));
  }
  return now;
}

RobotCondition ControlCore::condition(const ParsedControlRequest& request) const noexcept {
  RobotCondition now = condition();
  const std::uint64_t answers = request.control_session == setup_.session ? request.answers_control : 0;
  for (int k = 0; k < setup_.arms(); ++k)
    now.arm[static_cast<std::size_t>(k)].unseen = !arms_.faultsSeen(k, answers);
  return now;
}

/// A jog, a heartbeat of the lease, or a request of a CRTK client without lease, is as old as the status that its
/// sender has received: links delay messages that they do not lose.
Reason ControlCore::againstEcho(const ParsedControlRequest& request, Action action, std::int64_t now) const noexcept {
  if (setup_.lockStep())
    return Reason::kNone;
  if (request.from_topic && !isHarmless(action)) {
    const bool fresh = status_times_.age(request.answers_control, now) <= setup_.deployment.budgets.lease;
    return fresh ? Reason::kNone : Reason::kNoEcho;
  }
  if (action != Action::kJog && !isOfLease(action))
    return Reason::kNone;
  if (request.control_session != setup_.session)
    return Reason::kOtherControl;
  const double longest = isOfLease(action) ? setup_.deployment.budgets.lease : motions_.jogTime();
  return status_times_.age(request.answers_control, now) > longest ? Reason::kLate : Reason::kNone;
}

ControlReply ControlCore::onRequest(const ParsedControlRequest& request, std::int64_t now) noexcept {
  ControlReply reply;
  reply.client = request.client;
  reply.request = request.request;
  reply.retired = request.tracker;
  reply.status = status_sequence_;
  drives_.readJoints();
  loseLease(now);
  const RobotCondition before = condition(request);
  const Action action = actionOf(request);
  const std::uint64_t owner = reply.owner = lease_.owner(now);
  const Requester requester = request.from_topic ? crtkRequester(owner) : requesterOf(request.client, owner);
  reply.refusal = judge(action, requester, before, request.arm);
  if (!reply.refusal)
    reply.refusal = {againstEcho(request, action, now), action};
  if (reply.refusal && !isOfOneArm(reply.refusal))
    return reply;
  const int first = request.arm == msg::kAllArms ? 0 : request.arm;
  const int last = request.arm == msg::kAllArms ? setup_.arms() - 1 : request.arm;
  if (action == Action::kMoveJp) {
    const safety::ArmVector goal = safety::ArmVector::Map(request.joints.data(), request.joint_count);
    const safety::LimitViolation outside = safety::worstLimitViolation(setup_.limits(request.arm), goal);
    if (outside.amount > kGoalOutside) {
      reply.refusal = {Reason::kGoalOutside, action, {}, static_cast<std::int8_t>(request.arm), outside};
      return reply;
    }
  }
  if (action == Action::kSetMethod) {
    reply.retired = loop_.exchange(request.tracker);
    reply.method_accepted = true;
  }
  if (action == Action::kReleaseLease)
    lease_.release(request.client, now);
  else if (isOfLease(action))
    lease_.acquire(request.client, now, timeOfAnswered(request, now));
  for (int k = first; k <= last; ++k) {
    if (!judge(action, requester, before, k))
      apply(request, k, action, now);
  }
  if (action == Action::kEnable)
    arms_.enabledTogether(first, last);
  if (action == Action::kPause)
    paused_by_ = request.from_topic ? msg::kCrtkClient : request.client;
  updateStates();
  return reply;
}

void ControlCore::apply(const ParsedControlRequest& request, int k, Action action, std::int64_t now) noexcept {
  const safety::ArmVector joints = safety::ArmVector::Map(request.joints.data(), request.joint_count);
  switch (action) {
    case Action::kEnable:
    case Action::kDisable:
    case Action::kPause:
    case Action::kResume:
    case Action::kRecover: {
      safety::JointMask without = 0;
      for (int j = 0; j < joints.size(); ++j)
        without |= joints[j] != 0.0 ? safety::jointBit(j) : safety::JointMask{0};
      return arms_.apply(request.command, k, without, now);
    }
    case Action::kUnhome:
      return motions_.unhome(k);
    case Action::kHome:
      return motions_.home(k);
    case Action::kMoveJp:
      return motions_.moveTo(k, joints);
    case Action::kJog:
      return motions_.jog(k, joints, now);
    case Action::kWithdraw:
      return motions_.withdraw(k);
    case Action::kHold:
      return motions_.end(k);
    case Action::kSetMethod:
    case Action::kStart:
    case Action::kSteer:
    case Action::kAcquireLease:
    case Action::kKeepLease:
    case Action::kReleaseLease:
    case Action::kTeleoperate:
    case Action::kCrtkMove:
    case Action::kCrtkJoints:
    case Action::kCrtkTip:
    case Action::kCrtkHold:
    case Action::kHomeDrives:
      return;
  }
}

CrtkOutcome ControlCore::crtk(const CrtkRequest& request, std::int64_t now) noexcept {
  CrtkOutcome outcome;
  outcome.verb = request.verb;
  outcome.group = request.group;
  drives_.readJoints();
  loseLease(now);
  const RobotCondition before = condition();
  const Action action = actionOf(verbOf(request.verb));
  for (int k = request.firstArm(); k <= request.lastArm(); ++k) {
    if (const Refusal refusal = judge(action, crtkRequester(lease_.owner(now)), before, k))
      return outcome.refuse("%s", name(refusal.reason).data());
  }
  manual_.locate(loop_);
  outcome.accepted =
      action == Action::kCrtkMove ? motions_.take(request, outcome) : manual_.onCrtk(request, now, outcome);
  if (!outcome.accepted)
    return outcome;
  for (int k = request.firstArm(); k <= request.lastArm(); ++k) {
    if (action == Action::kCrtkMove)
      manual_.endCrtk(k);
    else
      motions_.end(k);
  }
  reference_.spend();
  if (action != Action::kCrtkHold)
    lease_.acquire(msg::kCrtkClient, now);
  return outcome;
}

/// A client's motions end with its lease, before another client acquires it.
void ControlCore::loseLease(std::int64_t now) noexcept {
  if (!lease_.takeLoss(now) || !condition().moving)
    return;
  arms_.latchMoving({bit(Fault::kLeaseLost)});
  updateStates();
}

void ControlCore::watch(std::int64_t now) noexcept {
  loseLease(now);
  mismatch_ = now < mismatch_until_;
  if (setup_.lockStep())
    return;  // stamps are simulated time there; a dead process stalls the simulation
  arms_.giveUpPending(now);
  if (const safety::FaultRecord record = drives_.judge(now); record.faults != 0)
    arms_.latchMoving(record);
  bool moving = false;
  for (int k = 0; k < setup_.arms(); ++k)
    moving = moving || arms_.powered(k);
  if (const safety::FaultRecord record = interlock_.judge(clearance_, moving, now); record.faults != 0)
    arms_.latchMoving(record);
  if (!reference_.underWay(drives_.state()))
    return;
  if (const safety::FaultRecord record = reference_.judge(status_times_, now); record.faults != 0)
    arms_.latchMoving(record);
}

/// In lock-step there is no power, and time advances only with the simulation.
void ControlCore::watchIdle(std::int64_t now, CycleOutput& output) noexcept {
  if (setup_.lockStep())
    return;
  const bool commanded =
      lease_.owner(now) != 0 || manual_.active() || motions_.anyActive() || reference_.running(drives_.state());
  arms_.watchIdle(commanded, now, output.idle);
}

/// Source of the tasks of this cycle: an operator before CRTK clients, and planning if there is neither.
Source ControlCore::chooseSource(std::int64_t now, bool advance, CycleOutput& output) noexcept {
  if (setup_.lockStep())
    manual_.forgetTips();
  else
    manual_.locate(loop_);
  if (manual_.engaged())
    reference_.spend();  // never resumed afterwards: it would lead back to its old position
  const Source by_hand = manual_.choose(context(now), condition(), loop_.gains(), tasks_, output.endings);
  if (by_hand == Source::kTeleoperation)
    reference_.spend();
  keepCrtkLease(now);
  if (by_hand != Source::kNobody)
    return by_hand;
  bool enabled = drives_.received() && (advance || !setup_.lockStep());
  for (int k = 0; k < setup_.arms(); ++k)
    enabled =
        enabled && arms_.powered(k) && !arms_.recovering(k) && !motions_.active(k) && !manual_.crtk().movesJoints(k);
  if (!enabled || !reference_.underWay(drives_.state()))
    return Source::kNobody;
  tasks_ = reference_.tasks(drives_.state());
  return Source::kPlanning;
}

/// CRTK clients have the lease only while they move something: their protocol has none.
void ControlCore::keepCrtkLease(std::int64_t now) noexcept {
  bool moving = manual_.crtk().active();
  for (int k = 0; k < setup_.arms(); ++k)
    moving = moving || motions_.byCrtk(k);
  if (moving)
    lease_.acquire(msg::kCrtkClient, now);
  else
    lease_.release(msg::kCrtkClient, now);
}

void ControlCore::follow(std::int64_t now, Velocities& velocities) noexcept {
  if (const safety::FaultRecord record = loop_.follow(tasks_, now); record.faults != 0)
    arms_.latchMoving(record);
  const bool held = loop_.hold() != msg::HoldReason::kNone;
  if (held && source_ != Source::kPlanning)
    manual_.invalidateTips();
  for (int k = 0; k < setup_.arms(); ++k)
    velocities.moves[static_cast<std::size_t>(k)] = !held && arms_.powered(k);
  velocities.value = loop_.result().solution.velocity;
  if (source_ != Source::kPlanning)
    manual_.keepOut(loop_.result(), velocities.value);
}

void ControlCore::cycle(std::int64_t now, bool advance, CycleOutput& output) noexcept {
  drives_.begin(now);
  loop_.begin();
  watch(now);
  watchIdle(now, output);
  updateStates();
  Velocities velocities;
  velocities.value.setZero(setup_.model.jointCount());
  source_ = chooseSource(now, advance, output);
  if (source_ != Source::kNobody)
    follow(now, velocities);
  else if (drives_.received())
    loop_.observe();
  for (int k = 0; k < setup_.arms(); ++k) {
    if (!arms_.powered(k) || (setup_.lockStep() && !advance))
      continue;
    if (manual_.crtk().movesJoints(k)) {
      setup_.of(k, velocities.value) = manual_.jointVelocity(k, now);
      velocities.moves[static_cast<std::size_t>(k)] = true;
    } else {
      motions_.step(k, arms_.recovering(k), now, velocities);
    }
  }
  drives_.send(now, advance, velocities, output.command);
  arms_.fill(output.command);
  loop_.prepareNext(now);
  loop_.fill(output.limits);
  fillStatus(now, velocities, output.status);
  output.permissions.session = output.status.session;
  output.permissions.sequence = output.status.sequence;
  output.permissions.stamp = output.status.stamp;
  fill(condition(), output.permissions);
  output.command.commander = lease_.owner(now);
  for (int k = 0; k < setup_.arms(); ++k)
    output.command.may_home[static_cast<std::size_t>(k)] = allows(output.permissions, Action::kHomeDrives, k) ? 1 : 0;
}

void ControlCore::fillStatus(std::int64_t now, const Velocities& velocities, msg::ControlStatus& status) noexcept {
  status = msg::ControlStatus{};
  status.session = setup_.session;
  status.sequence = ++status_sequence_;
  status_times_.record(status.sequence, now);
  status.answers_state = drives_.state().sequence;
  status.answers_reference = reference_.sequence();
  status.stamp = setup_.lockStep() ? drives_.state().stamp : now;
  status.arm_count = static_cast<std::uint8_t>(setup_.arms());
  status.lease_owner = lease_.owner(now);
  status.model = static_cast<std::uint8_t>(setup_.model.kind());
  status.period = setup_.period();
  status.state_success = drives_.success();
  status.reference_success = reference_.success();
  arms_.fill(status);
  loop_.fill(status);
  bool moves = false;
  for (int k = 0; k < setup_.arms(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    status.homed[i] = motions_.homed(k) ? 1 : 0;
    status.busy[i] = status.busy[i] != 0 || motions_.busy(k) || manual_.crtk().busy(k) ? 1 : 0;
    moves = moves || velocities.moves[i];
    if (static_cast<safety::OperatingState>(status.operating_state[i]) == safety::OperatingState::kPaused)
      status.paused_by = paused_by_;
  }
  const bool nobody = source_ == Source::kNobody;
  status.source = static_cast<std::uint8_t>(nobody && manual_.crtk().active() ? Source::kCrtk
                                            : nobody && moves                 ? Source::kJoints
                                                                              : source_);
}

void ControlCore::fillSnapshots(std::int64_t now, OperatorSnapshot& operators, CrtkSnapshot& crtk) const noexcept {
  const bool by_hand = source_ == Source::kTeleoperation || source_ == Source::kCrtk;
  const bool tasks = by_hand || reference_.underWay(drives_.state());
  manual_.fill(context(now), source_, tasks ? &tasks_ : nullptr, operators, crtk);
  motions_.fill(crtk);
}

bool ControlCore::readyToAdvance() const noexcept {
  if (!drives_.unanswered())
    return false;
  for (int k = 0; k < setup_.arms(); ++k) {
    if (!arms_.powered(k))
      return false;
  }
  return motions_.anyActive() || (reference_.running(drives_.state()) &&
                                  reference_.answersState() == drives_.state().sequence && loop_.complete());
}

}  // namespace tandem::operation
