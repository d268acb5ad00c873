// SPDX-License-Identifier: Apache-2.0
#include "hal/axis.h"

#include <algorithm>
#include <cmath>

#include "hal/nanoseconds.h"

namespace tandem::hal {
namespace {

/// Longest time without the report that the drive follows: one sample may be from before the command arrived, s.
constexpr double kIgnoreBudget = 0.030;
}  // namespace

Axis::Axis(const HardwareConfig& hardware, const AxisConfig& config, Fieldbus& bus, const safety::Budgets& budgets)
    : config_(config),
      heartbeat_budget_(budgets.drive_heartbeat),
      feedback_budget_(FeedbackBudget::of(hardware, budgets)),
      bus_(bus),
      driver_(bus.addAxis(hardware, config, budgets)),
      least_(leastProtections(config.accepted)),
      zero_(config.gearing.offset),
      power_(hardware.transition_budget, config.stopBudget()),
      motion_(config.velocity, AxisUnits(config.gearing).resolution(), hardware.period),
      torque_(config.torque),
      first_motion_(config.first_motion),
      run_motion_(config.first_motion),
      switches_(2.0 * AxisUnits(config.gearing).resolution()),
      release_(config, hardware.period),
      memory_(config.jump_tolerance) {
  if (config.brake)
    brake_.emplace(*config.brake);
}

void Axis::boot(std::int64_t now) noexcept {
  driver_.boot(now);
  phase_ = AxisPhase::kBooting;
  guards_ = latched_ = 0;
  homing_failure_ = HomingFailure::kNone;
  limits_pending_ = recovering_ = false;
  missing_ = 0;
  drive_stream_.restart();
  encoder_stream_.restart();
  drive_.state = DriveFeedback{}.state;
  encoder_sample_.alarm = false;
  motion_.restart();
  first_motion_.restart();
  run_motion_ = RunMotion(config_.first_motion);
  following_.clearError();
  provisional_ = false;
  power_.setGoal(PowerGoal::kOff, now);
  setOperating(false);
  hold();
}

void Axis::setOperating(bool operating) noexcept {
  if (operating && !operating_) {
    following_.restart(target_);
    first_motion_.begin(target_, position_, comparedPosition());
    torque_.reset();
  }
  operating_ = operating;
}

void Axis::fail(HardwareGuard guard) noexcept {
  latched_ |= bit(guard);
  guards_ |= bit(guard);
}

void Axis::failHoming(HomingFailure reason) noexcept {
  if (homing_failure_ == HomingFailure::kNone)
    homing_failure_ = reason;
  fail(HardwareGuard::kHoming);
}

void Axis::setTarget(double position, double velocity) noexcept {
  holding_ = false;
  target_ = position;
  target_velocity_ = velocity;
}

void Axis::updatePhase(std::int64_t now) noexcept {
  driver_.update(now);
  const DriverPhase phase = driver_.phase();
  if (phase == DriverPhase::kUp && phase_ == AxisPhase::kBooting) {
    for (const ProtectionMask set : least_)
      missing_ = (set & ~driver_.lostProtections()) == 0 ? set : missing_;
  }
  if (phase == DriverPhase::kFailed || missing_ != 0) {
    fail(HardwareGuard::kNode);
    phase_ = AxisPhase::kFailed;
  }
  if (phase_ == AxisPhase::kBooting && phase == DriverPhase::kUp) {
    phase_ = AxisPhase::kReferencing;
    if (brake_)
      brake_->restart(now);
    fault_reset_ = true;
  }
}

void Axis::readDrive(std::int64_t now) noexcept {
  drive_stream_.watch(driver_.drive().arrivals, now);
  if (!drive_stream_.fresh())
    return;
  if (!std::isfinite(driver_.drive().position) || !std::isfinite(driver_.drive().torque))
    return fail(HardwareGuard::kDriveFault);  // only a driver of another kind can do that
  drive_ = driver_.drive();
  motion_.sample(drive_.position, drive_.time);
  run_motion_.sample(drive_.position, now);
  if (torque_.watches())
    torque_.take(drive_.torque, now);
  if (referenced() || phase_ == AxisPhase::kFailed || unconfirmed() || provisional_)
    position_ = measured();
  switches_.take(drive_.at_lower, drive_.at_upper, position_, operating_);
}

void Axis::readEncoder(std::int64_t now) noexcept {
  if (!config_.encoder)
    return;
  encoder_stream_.watch(driver_.encoder().arrivals, now);
  if (!encoder_stream_.fresh())
    return;
  if (!std::isfinite(driver_.encoder().position))
    return fail(HardwareGuard::kEncoderAlarm);
  encoder_sample_ = driver_.encoder();
}

void Axis::setLimits() noexcept {
  // Outside the range in which an arm may be enabled: a drive whose target is beyond a limit moves to the limit at
  // once.
  const double here = recovering_ ? measured() : config_.lower;
  driver_.setLimits(placeOf(std::min(config_.lower, here) - safety::kPositionTolerance),
                    placeOf(std::max(config_.upper, here) + safety::kPositionTolerance));
  limits_pending_ = true;
  finishLimits();
}

void Axis::rereference(double place, double position) noexcept {
  if (!std::isfinite(place) || !std::isfinite(position))
    return fail(HardwareGuard::kReference);
  zero_ = position - place;
  phase_ = AxisPhase::kReferencing;
  provisional_ = false;
  setLimits();
}

MeasurementAnswer Axis::takeMeasurement(double position) noexcept {
  if (config_.reference != PositionReference::kMeasured)
    return MeasurementAnswer::kOtherReference;
  if (!up())
    return MeasurementAnswer::kNotUp;
  if (guards_ != 0)
    return MeasurementAnswer::kGuarded;
  if (!atStandstill())
    return MeasurementAnswer::kMoves;
  const double range = config_.upper - config_.lower;
  if (!(position >= config_.lower - range && position <= config_.upper + range))
    return MeasurementAnswer::kOutside;
  rereference(drive_.position, position);
  return MeasurementAnswer::kTaken;
}

void Axis::countFromHere() noexcept {
  provisional_ = true;
  zero_ = -drive_.position;
  position_ = 0.0;
}

void Axis::confirm() noexcept {
  if (unconfirmed())
    phase_ = AxisPhase::kReady;
}

void Axis::setRecovering(bool recovering) noexcept {
  if (recovering == recovering_)
    return;
  recovering_ = recovering;
  if (phase_ == AxisPhase::kReady)
    setLimits();
}

void Axis::finishLimits() noexcept {
  if (driver_.limits() == Progress::kFailed)
    fail(HardwareGuard::kReference);
  else if (driver_.limits() == Progress::kDone)
    beReady();
}

void Axis::beReady() noexcept {
  limits_pending_ = false;
  position_ = measured();
  phase_ = memory_.plausible(position_) ? AxisPhase::kReady : AxisPhase::kUnconfirmed;
}

/// Sets the reference from the first samples.
void Axis::reference() noexcept {
  if (!drive_stream_.fresh() || (config_.encoder && !encoder_stream_.fresh()))
    return;  // both of one period
  switch (config_.reference) {
    case PositionReference::kAbsoluteEncoder:
      if (!encoder_sample_.alarm)
        rereference(drive_.position, encoderPosition());
      return;
    case PositionReference::kDrive:
      setLimits();
      return;
    case PositionReference::kHoming:
    case PositionReference::kHardStop:
      phase_ = AxisPhase::kUnhomed;
      return;
    case PositionReference::kMeasured:
      phase_ = AxisPhase::kUnmeasured;
      return;
  }
}

/// Opens the brake while torque holds the joint in operation; closes it before torque goes off, or once it is off.
void Axis::moveBrake(std::int64_t now) noexcept {
  const DriveState state = driveState();
  const bool torque = state == DriveState::kOperationEnabled || state == DriveState::kQuickStopActive ||
                      state == DriveState::kFaultReaction;
  const bool operation = goal() == PowerGoal::kOperation && state == DriveState::kOperationEnabled;
  // A closing brake stays closed if the joint moves slightly.
  closing_ = torque && !operation && (closing_ || atStandstill());
  const bool open = operation || (torque && !closing_);
  if (!brake_->step(open, torque, measured(), driver_, now))
    fail(HardwareGuard::kBrake);
  free_to_move_ = brake_->opened(now);
}

void Axis::judgeMotion(std::int64_t now) noexcept {
  // Old feedback does not contain the present position; another guard reports that it is old.
  if (drive_stream_.fresh()) {
    following_.measured(position_, config_.following_error, now);
    first_motion_.sample(target_, position_, comparedPosition());
  }
  noteGuard(HardwareGuard::kFirstMotion, first_motion_.failed());
  const bool powered = driveState() == DriveState::kOperationEnabled;
  following_.follows(followsCommand() || !powered, now);
  noteGuard(HardwareGuard::kFollowing, following_.outside(config_.following_time, now));
  noteGuard(HardwareGuard::kIgnoresCommand, following_.ignored(kIgnoreBudget, now));
  noteGuard(HardwareGuard::kPowerLost, !powered);
  noteGuard(HardwareGuard::kTorque, torque_.exceeded(now));
  noteGuard(HardwareGuard::kInternalLimit, powered && drive_.limited);
  noteGuard(HardwareGuard::kInternalLimit, powered && switches_.beyond(target_));
}

void Axis::judge(std::int64_t now) noexcept {
  guards_ = latched_;
  noteGuard(HardwareGuard::kBus, bus_.faulty());
  noteGuard(HardwareGuard::kForeignMaster, bus_.otherMaster(now));
  if (phase_ == AxisPhase::kBooting || phase_ == AxisPhase::kFailed)
    return;
  noteGuard(HardwareGuard::kDriveSilent, drive_stream_.silent(feedback_budget_.silence, now));
  noteGuard(HardwareGuard::kFramesLost, 1.0 - feedbackSuccess() > feedback_budget_.lost);
  const DriveState state = driveState();
  noteGuard(HardwareGuard::kDriveFault, state == DriveState::kFault || state == DriveState::kFaultReaction);
  noteGuard(HardwareGuard::kEmergency, driver_.emergency());
  noteGuard(HardwareGuard::kOverspeed, motion_.tooFast());
  noteGuard(HardwareGuard::kFirstMotion, run_motion_.failed());
  if (config_.encoder) {
    noteGuard(HardwareGuard::kEncoderSilent, encoder_stream_.silent(feedback_budget_.silence, now));
    noteGuard(HardwareGuard::kEncoderAlarm, encoder_sample_.alarm);
    if (phase_ == AxisPhase::kReady)
      noteGuard(HardwareGuard::kEncoderMismatch, std::abs(encoderPosition() - position_) > config_.encoder->tolerance);
  }
  if (operating_)
    judgeMotion(now);
}

void Axis::update(std::int64_t now) noexcept {
  updatePhase(now);
  if (phase_ == AxisPhase::kBooting)
    return judge(now);
  readDrive(now);
  readEncoder(now);
  if (fault_reset_ && driveState() == DriveState::kFault) {
    power_.resetFault(now);  // some drives keep their fault over a reset of the node
    fault_reset_ = false;
  }
  fault_reset_ = fault_reset_ && driveState() != DriveState::kSwitchOnDisabled;  // a later fault is a new one
  if (limits_pending_)
    finishLimits();
  else if (phase_ == AxisPhase::kReferencing)
    reference();
  if (brake_)
    moveBrake(now);
  if (driver_.confirmed() == Progress::kFailed)
    fail(HardwareGuard::kSwitchOn);
  judge(now);
  if (valid())
    memory_.note(position_);
}

safety::FaultRecord Axis::failure(GuardMask guards) const noexcept {
  using safety::FaultCause;
  safety::FaultRecord record = faultOf(guards);
  if (record.faults == 0)
    return record;
  record.joint = static_cast<std::uint8_t>(config_.joint);
  const auto found = [&record](double amount, double allowed) {
    record.amount = amount;
    record.allowed = allowed;
  };
  if (record.cause == FaultCause::kDisagree)
    found(std::abs(encoderPosition() - position_), config_.encoder->tolerance);
  else if ((guards & bit(HardwareGuard::kFirstMotion)) != 0)
    found(std::max(first_motion_.excess(), run_motion_.excess()), config_.first_motion);
  else if (record.cause == FaultCause::kFollowingError)
    found(std::abs(following_.error()), config_.following_error);
  else if (record.cause == FaultCause::kLost)
    found(1.0 - feedbackSuccess(), feedback_budget_.lost);
  return record;
}

double Axis::feedbackSuccess() const noexcept {
  return std::min(drive_stream_.success().value(), encoder_stream_.success().value());
}

bool Axis::followsCommand() const noexcept {
  return driveState() == DriveState::kOperationEnabled && free_to_move_ && confirmed() && drive_.follows;
}

bool Axis::valid() const noexcept {
  constexpr GuardMask kUnknown = kSensorGuards | bit(HardwareGuard::kDriveSilent) | bit(HardwareGuard::kNode);
  return phase_ == AxisPhase::kReady && (guards_ & kUnknown) == 0;
}

bool Axis::mayRelease(std::int64_t now) noexcept {
  const bool runs_away = release_.runsAway(power_.braking(), velocity(), drive_stream_.fresh(), now);
  if (brake_ && closing_)
    return brake_->closed(now);
  return atStandstill() ? !brake_ : runs_away;
}

void Axis::writeCommand(std::int64_t now) noexcept {
  DriveCommand command;
  command.word = power_.step(drive_.state, mayRelease(now), now);
  // Without torque the target follows the joint, so that a drive that gets torque does not move.
  if (holding_ && driveState() != DriveState::kOperationEnabled) {
    target_ = position_;
    target_velocity_ = 0.0;
    target_place_ = drive_.position;
    following_.forget(target_);
  } else if (!holding_) {
    target_place_ = placeOf(target_);
  }
  following_.reported(target_);
  command.position = target_place_;
  command.velocity = targetIsVelocity(config_.mode) ? targetVelocity() : target_velocity_;
  driver_.command(command, now);
}

/// Target of a drive in a velocity mode, from the position loop of the HAL, m/s or rad/s.
double Axis::targetVelocity() const noexcept {
  if (driveState() != DriveState::kOperationEnabled)
    return 0.0;
  const double wanted = target_velocity_ + config_.velocity_gain * (target_ - position_);
  return std::clamp(wanted, -1.5 * config_.velocity, 1.5 * config_.velocity);
}

}  // namespace tandem::hal
