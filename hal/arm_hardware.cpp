// SPDX-License-Identifier: Apache-2.0
#include "hal/arm_hardware.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "hal/nanoseconds.h"

namespace tandem::hal {
namespace {

using safety::DriveRequest;
using safety::OperatingState;

/// Shortest time between two boots of an arm that fails to come up: control repeats its request with every command.
constexpr std::int64_t kBootPause = 2 * kSecond;
/// Time for faults that drives keep over a boot, until they are reset.
constexpr std::int64_t kFaultReset = kSecond;

}  // namespace

ArmHardware::ArmHardware(const ArmConfig& config,
                         std::vector<Axis*> axes,
                         const safety::SupervisorOptions& options,
                         double power_budget,
                         double period)
    : supervisor_(config.limits, safety::ArmVector::Zero(config.limits.jointCount()), options),
      axes_(std::move(axes)),
      homing_(axes_, period),
      power_budget_(nanoseconds(power_budget)),
      request_budget_(nanoseconds(options.budgets.commandAge(options.control_period))) {
  trusted_.setZero(config.limits.jointCount());
  for (const Axis* axis : axes_)
    stop_budget_ = std::max(stop_budget_, nanoseconds(axis->config().stopBudget()));
}

template <class Condition>
bool ArmHardware::all(Condition&& condition) const noexcept {
  return std::all_of(axes_.begin(), axes_.end(), [&](const Axis* axis) { return condition(*axis); });
}

bool ArmHardware::homed() const noexcept {
  return all([](const Axis& axis) { return axis.referenced(); });
}

bool ArmHardware::valid() const noexcept {
  return all([&](const Axis& axis) { return axis.valid() || lost(axis); });
}

bool ArmHardware::standing() const noexcept {
  return supervisor_.standing() && !homing_.running() &&
         all([](const Axis& axis) { return axis.velocity() == 0.0 || axis.unresponsive(); });
}

bool ArmHardware::foreignMaster() const noexcept {
  return !all([](const Axis& axis) { return (axis.guards() & bit(HardwareGuard::kForeignMaster)) == 0; });
}

safety::ArmVector ArmHardware::position() const noexcept {
  safety::ArmVector q(jointCount());
  for (int j = 0; j < jointCount(); ++j)
    q[j] = lost(j) ? trusted_[j] : axis(j).position();
  return q;
}

void ArmHardware::notePositions() noexcept {
  for (int j = 0; j < jointCount(); ++j) {
    if (!axis(j).valid() || axis(j).guards() != 0)
      continue;
    trusted_[j] = axis(j).position();
    known_ |= safety::jointBit(j);
  }
}

safety::ArmVector ArmHardware::velocity() const noexcept {
  safety::ArmVector v(jointCount());
  for (int j = 0; j < jointCount(); ++j)
    v[j] = axis(j).unresponsive() ? 0.0 : axis(j).velocity();
  return v;
}

/// Commanded positions of the drives; of lost joints, the last valid ones.
safety::ArmVector ArmHardware::places() const noexcept {
  safety::ArmVector q(jointCount());
  for (int j = 0; j < jointCount(); ++j)
    q[j] = lost(j) ? trusted_[j] : axis(j).target();
  return q;
}

safety::FaultRecord ArmHardware::presentFailure() const noexcept {
  safety::FaultRecord present;
  for (const Axis* axis : axes_) {
    // Guards of a lost joint are the cause of its loss; only another master counts: it may move the other joints, too.
    constexpr GuardMask kOfAll = bit(HardwareGuard::kForeignMaster);
    const safety::FaultRecord failure = axis->failure(lost(*axis) ? axis->guards() & kOfAll : axis->guards());
    if (present.faults == 0)
      present = failure;
    present.faults |= failure.faults;
  }
  if ((needs_boot_ && !recovering_) || rebooting_)
    present.faults |= safety::bit(safety::Fault::kDrive);
  return safety::withEmergencyStop(present, emergency_active_, emergency_pressed_);
}

void ArmHardware::setEmergencyStop(bool pressed, bool lost, bool known) noexcept {
  emergency_lost_ = lost;
  emergency_pressed_ = pressed;
  emergency_active_ = pressed || (lost && !(recovering_ && without_emergency_stop_));
  emergency_known_ = known;
  if (emergency_active_ && (supervisor_.faults() & safety::bit(safety::Fault::kStopRequested)) == 0)
    supervisor_.latch(pressed ? safety::kEmergencyStopRecord : presentFailure());
}

void ArmHardware::boot(std::int64_t now) noexcept {
  for (Axis* axis : axes_)
    axis->boot(now);
  booted_ = now;
}

void ArmHardware::latch(const safety::FaultRecord& record) noexcept {
  needs_boot_ = needs_boot_ || record.faults != 0;
  supervisor_.latch(record);
}

DriveRequest ArmHardware::onEnable(std::int64_t now) noexcept {
  if (supervisor_.state() != OperatingState::kDisabled)
    return DriveRequest::kEnable;
  if (presentFaults() != 0)
    return DriveRequest::kEnable;  // the supervisor latches the faults and reports them
  if (!homed() || homing_.running() || recovering_ || !emergency_known_)
    return DriveRequest::kKeep;
  if (!(safety::readOutside(supervisor_.limits(), position()).amount <= 0.0))
    return DriveRequest::kEnable;  // likewise, before a drive gets torque outside its limits
  enable_asked_ = now;
  if (power_ == ArmPower::kOff && supervisor_.standing())
    startSwitchingOn(now);
  return onceInOperation() ? DriveRequest::kEnable : DriveRequest::kKeep;
}

DriveRequest ArmHardware::onRecover(safety::JointMask without, std::int64_t now) noexcept {
  if (supervisor_.powered() || supervisor_.recoverRequestConsumed() || !supervisor_.standing() || homing_.running() ||
      rebooting_ || foreignMaster())
    return DriveRequest::kKeep;
  if (power_ == ArmPower::kSwitchingOn && (!recovering_ || (without & ~lost_) != 0))
    switchOff(now);  // another request
  enable_asked_ = now;
  if (power_ == ArmPower::kOff) {
    safety::JointMask lost = without, left = 0;
    for (const Axis* axis : axes_) {
      const safety::JointMask bit = safety::jointBit(axis->config().joint);
      if (axis->guards() != 0 || axis->phase() != AxisPhase::kReady)
        lost |= bit;
      left |= bit;
    }
    left &= static_cast<safety::JointMask>(~lost);
    if (left == 0 || (lost & ~known_) != 0)
      return DriveRequest::kKeep;
    recovering_ = true;
    lost_ = lost;
    without_emergency_stop_ = emergency_lost_;
    startSwitchingOn(now);
  }
  return recovering_ && onceInOperation() ? DriveRequest::kRecover : DriveRequest::kKeep;
}

void ArmHardware::startSwitchingOn(std::int64_t now) noexcept {
  power_ = ArmPower::kSwitchingOn;
  power_since_ = now;
  for (Axis* axis : axes_) {
    axis->hold();
    axis->setRecovering(recovering_ && !lost(*axis));
  }
}

/// All drives that have to get torque have it.
bool ArmHardware::onceInOperation() noexcept {
  if (power_ != ArmPower::kSwitchingOn || !all([&](const Axis& axis) { return axis.followsCommand() || lost(axis); }))
    return false;
  power_ = ArmPower::kOn;
  for (Axis* axis : axes_)
    axis->setOperating(!lost(*axis));
  return true;
}

void ArmHardware::onDisable(std::int64_t now) noexcept {
  if (power_ == ArmPower::kSwitchingOn)
    switchOff(now);
  // The request is stored: torque may still be on, or the last boot too recent.
  if (supervisor_.state() == OperatingState::kFault && needs_boot_ && !rebooting_)
    rebooting_ = boot_due_ = true;
}

safety::GateReport ArmHardware::command(const safety::ArmRequest& request, std::int64_t now) noexcept {
  safety::ArmRequest passed = request;
  if (request.motion.stream == 0) {
    supervisor_.noteRecoverRequest(request.request == DriveRequest::kRecover);
    if (request.request == DriveRequest::kEnable)
      passed.request = onEnable(now);
    if (request.request == DriveRequest::kDisable)
      onDisable(now);
    if (request.request == DriveRequest::kRecover)
      passed.request = request.unseen ? DriveRequest::kKeep : onRecover(request.lost, now);
    passed.lost = lost_;
  }
  const bool was_enabled = supervisor_.powered();
  const safety::GateReport report = supervisor_.command(passed, places(), presentFailure(), now);
  constexpr safety::FaultMask kOutside = safety::bit(safety::Fault::kStopRequested);  // no boot would help
  if (passed.request == DriveRequest::kEnable && !was_enabled && (presentFaults() & ~kOutside) != 0)
    needs_boot_ = true;
  return report;
}

void ArmHardware::onAxisGuards(int joint, GuardMask guards, std::int64_t now) noexcept {
  if (lost(joint)) {
    if ((guards & bit(HardwareGuard::kForeignMaster)) != 0)
      latch(axes_[static_cast<std::size_t>(joint)]->failure(bit(HardwareGuard::kForeignMaster)));
    return;
  }
  Axis& axis = *axes_[static_cast<std::size_t>(joint)];
  const bool drive = (guards & ~kRampGuards) != 0;
  const bool moves = power_ == ArmPower::kOn;
  if (moves && drive) {
    // The drive of this axis stops by itself; the other joints stop along the line that remains without it.
    needs_boot_ = true;
    supervisor_.latchAxisFailure(axis.failure(guards), axis.position());
    axis.setOperating(false);
    axis.setGoal(PowerGoal::kOff, now);
  }
  constexpr GuardMask kOfTheBus = bit(HardwareGuard::kBus) | bit(HardwareGuard::kForeignMaster);
  const bool lost = axis.phase() == AxisPhase::kFailed || (guards & kOfTheBus) != 0;
  if (moves || power_ == ArmPower::kSwitchingOn || homing_.running() || lost)
    latch(axis.failure(guards));
}

void ArmHardware::watchAxes(std::int64_t now, std::array<GuardMask, safety::kMaxJointsPerArm>& began) noexcept {
  for (int j = 0; j < jointCount(); ++j) {
    const auto i = static_cast<std::size_t>(j);
    const GuardMask guards = axes_[i]->guards();
    began[i] = guards & ~seen_[i];
    seen_[i] = guards;
    if (began[i] != 0)
      onAxisGuards(j, began[i], now);
  }
}

void ArmHardware::switchOff(std::int64_t now) noexcept {
  power_ = ArmPower::kSwitchingOff;
  power_since_ = now;
  stood_ = 0;
  for (Axis* axis : axes_) {
    axis->setOperating(false);
    axis->hold();
    axis->setGoal(PowerGoal::kOff, now);
  }
}

void ArmHardware::stepSwitchingOn(std::int64_t now) noexcept {
  const bool faulty = recovering_ ? presentFaults() != 0 || supervisor_.recoverRequestConsumed()
                                  : supervisor_.state() != OperatingState::kDisabled;
  const bool forgotten = now - enable_asked_ > request_budget_;
  safety::FaultRecord late;
  for (Axis* axis : axes_) {
    if (lost(*axis))
      continue;
    if (!axis->settingLimits())
      axis->setGoal(PowerGoal::kOperation, now);
    if (axis->goalLate(now) || (now - power_since_ > power_budget_ && !axis->followsCommand())) {
      axis->fail(HardwareGuard::kSwitchOn);
      late = late.faults == 0 ? axis->failure(bit(HardwareGuard::kSwitchOn)) : late;
    }
  }
  if (faulty || forgotten || late.faults != 0)
    switchOff(now);
  latch(late);
}

/// Torque goes off when the joints are at standstill, not only their reference; after the stop budget in any case.
void ArmHardware::stepOn(std::int64_t now) noexcept {
  if (supervisor_.powered() || !supervisor_.standing()) {
    stood_ = 0;
    return;
  }
  stood_ = stood_ == 0 ? now : stood_;
  const bool late = now - stood_ > stop_budget_;
  if (late || all([](const Axis& axis) { return axis.atStandstill() || !axis.operating(); }))
    switchOff(now);
}

void ArmHardware::stepPower(std::int64_t now) noexcept {
  switch (power_) {
    case ArmPower::kOff:
      return;
    case ArmPower::kSwitchingOn:
      return stepSwitchingOn(now);
    case ArmPower::kOn:
      return stepOn(now);
    case ArmPower::kSwitchingOff:
      if (all([&](const Axis& axis) { return axis.goalReached() || axis.goalLate(now); })) {
        for (Axis* axis : axes_) {
          if (axis->goalReached() || axis->unresponsive() || lost(*axis))
            continue;
          axis->fail(HardwareGuard::kSwitchOn);  // torque does not go off
          latch(axis->failure(bit(HardwareGuard::kSwitchOn)));
        }
        power_ = ArmPower::kOff;
        recovering_ = false;
        lost_ = 0;
        for (Axis* axis : axes_)
          axis->setRecovering(false);
      }
      return;
  }
}

void ArmHardware::stepReboot(std::int64_t now) noexcept {
  if (foreignMaster())
    rebooting_ = boot_due_ = false;  // no reset of nodes that another master commands
  if (!rebooting_)
    return;
  if (boot_due_) {
    boot_due_ = power_ != ArmPower::kOff || homing_.running() || (booted_ != 0 && now - booted_ < kBootPause);
    if (!boot_due_)
      boot(now);
    return;
  }
  const bool up = all([](const Axis& axis) { return axis.up(); });
  const bool failed = !all([](const Axis& axis) { return axis.phase() != AxisPhase::kFailed; });
  const bool clear = all([](const Axis& axis) { return axis.guards() == 0; });
  up_since_ = !up ? 0 : up_since_ == 0 ? now : up_since_;
  if (up && clear) {
    needs_boot_ = rebooting_ = false;
    const safety::ArmRequest disable{.request = DriveRequest::kDisable, .motion = {}};
    supervisor_.command(disable, places(), presentFailure(), now);
  } else if (failed || (up && now - up_since_ > kFaultReset) || now - booted_ > 30 * kSecond) {
    rebooting_ = false;
  }
}

ArmHardware::HomingAnswer ArmHardware::home(std::int64_t now) noexcept {
  const bool again = now - std::exchange(home_asked_, now) <= nanoseconds(kHomingKeepAlive);
  if (homing_.running())
    return HomingAnswer::kRunning;
  if (homed())
    return HomingAnswer::kDone;
  if (!off())
    return HomingAnswer::kNotDisabled;
  if (!all([](const Axis& axis) { return !axis.unconfirmed(); })) {
    confirmPositions(again, now);
    return homed() ? HomingAnswer::kDone : HomingAnswer::kUnconfirmed;
  }
  if (!homing_.needed())
    return all([](const Axis& axis) { return !axis.unmeasured(); }) ? HomingAnswer::kNotReady
                                                                    : HomingAnswer::kUnmeasured;
  if (presentFaults() != 0 || !all([](const Axis& axis) { return axis.up(); }))
    return HomingAnswer::kNotReady;
  homing_.start(now);
  return HomingAnswer::kRunning;
}

/// Confirmation needs two requests: a single one confirms nothing. @param again  the last request was recent.
void ArmHardware::confirmPositions(bool again, std::int64_t now) noexcept {
  confirming_ = again ? confirming_ : now;
  if (now - confirming_ < nanoseconds(kConfirmTime) || presentFaults() != 0 ||
      !all([](const Axis& axis) { return axis.up(); }))
    return;
  for (Axis* axis : axes_)
    axis->confirm();
}

void ArmHardware::stepHoming(std::int64_t now) noexcept {
  if (!homing_.running())
    return;
  if (now - home_asked_ > nanoseconds(kHomingKeepAlive) || supervisor_.state() != OperatingState::kDisabled)
    homing_.abort(now);
  homing_.step(now);
}

void ArmHardware::step(double dt, std::int64_t now, std::array<GuardMask, safety::kMaxJointsPerArm>& began) noexcept {
  notePositions();
  watchAxes(now, began);
  stepReboot(now);
  stepHoming(now);
  supervisor_.step(dt, now);
  stepPower(now);
  // Without torque the reference is the measured position, whatever it was before.
  if (power_ != ArmPower::kOn && supervisor_.standing() && !supervisor_.powered() && homed())
    supervisor_.place(power_ == ArmPower::kSwitchingOn ? places() : position());
  for (int j = 0; j < jointCount(); ++j) {
    Axis& axis = *axes_[static_cast<std::size_t>(j)];
    if (power_ == ArmPower::kOn && !lost(j))
      axis.setTarget(supervisor_.reference()[j], supervisor_.referenceVelocity()[j]);
    axis.writeCommand(now);
  }
}

}  // namespace tandem::hal
