// SPDX-License-Identifier: Apache-2.0
#include "hal/axis.h"

#include <algorithm>
#include <cmath>

#include "hal/detail/node_setups.h"
#include "hal/nanoseconds.h"

namespace tandem::hal {
namespace {
using canopen::NodePhase;

/// Longest time without the statusword bit "follows": one TPDO may have been sampled before the command arrived, s.
constexpr double kIgnoreBudget = 0.030;
}  // namespace

Axis::Axis(const HardwareConfig& hardware,
           const AxisConfig& config,
           canopen::Network& network,
           const safety::Budgets& budgets)
    : config_(config),
      heartbeat_budget_(budgets.drive_heartbeat),
      feedback_budget_(FeedbackBudget::of(hardware, budgets)),
      network_(network),
      drive_(network.addNode(driveSetup(hardware, config, budgets.drive_heartbeat))),
      units_(config.gearing, config.units),
      power_(hardware.transition_budget, config.stopBudget()),
      motion_(config.velocity, units_.resolution(), hardware.period),
      torque_(config.torque),
      first_motion_(config.first_motion),
      release_(config, hardware.period),
      memory_(config.jump_tolerance),
      temperature_(config) {
  if (config.brake)
    brake_.emplace(*config.brake);
  if (!config.encoder)
    return;
  encoder_ = network.addNode(encoderSetup(hardware, config, budgets.drive_heartbeat));
  encoder_reading_ = EncoderReading(*config.encoder, config.lower, config.upper);
}

void Axis::boot(std::int64_t now) noexcept {
  network_.boot(drive_, now);
  if (encoder_ >= 0)
    network_.boot(encoder_, now);
  phase_ = AxisPhase::kBooting;
  guards_ = latched_ = 0;
  jobs_.clear();
  temperature_.restart();
  limits_pending_ = recovering_ = false;
  emergency_ = encoder_emergency_ = encoder_alarm_ = false;
  error_code_ = 0;
  drive_stream_.restart();
  encoder_stream_.restart();
  encoder_reading_.restart();
  statusword_ = 0;
  motion_.restart();
  first_motion_.restart();
  following_.clearError();
  mode_bits_ = 0;
  provisional_ = false;
  power_.setGoal(PowerGoal::kOff, now);
  setOperating(false);
  hold();
}

void Axis::onEmcy(int node, const canopen::Emcy& emcy) noexcept {
  (node == drive_ ? emergency_ : encoder_emergency_) = emcy.code != canopen::error_code::kNone;
  if (emcy.code != canopen::error_code::kNone)
    error_code_ = emcy.code;
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

void Axis::setTarget(double position, double velocity) noexcept {
  holding_ = false;
  target_ = position;
  target_velocity_ = velocity;
}

void Axis::updateNodes(std::int64_t now) noexcept {
  bool all = true;
  for (const int index : {drive_, encoder_}) {
    if (index < 0)
      continue;
    const NodePhase phase = network_.node(index).phase();
    if (phase == NodePhase::kConfigured)
      network_.start(index, now);
    if (phase == NodePhase::kFailed) {
      fail(HardwareGuard::kNode);
      phase_ = AxisPhase::kFailed;
    }
    all = all && phase == NodePhase::kOperational;
  }
  if (phase_ == AxisPhase::kBooting && all) {
    phase_ = AxisPhase::kReferencing;
    if (brake_)
      brake_->restart(now);
    const std::uint64_t* shown = driveNode().readValue(objects::kModeDisplay);
    mode_.expect(config_.mode, shown != nullptr && *shown == static_cast<std::uint64_t>(config_.mode));
    emergency_ = encoder_emergency_ = false;  // those before the reset; a present error shows in the statusword
    fault_reset_ = true;
  }
}

void Axis::readDrive(std::int64_t now) noexcept {
  const canopen::Tpdo& tpdo = driveNode().tpdos()[0];
  drive_stream_.watch(tpdo, network_, now);
  if (!drive_stream_.fresh())
    return;
  counts_ = static_cast<std::int32_t>(tpdo.getSigned(slots::kPosition));
  motion_.sample(units_.scale() * static_cast<double>(counts_), sampled_);
  statusword_ = static_cast<std::uint16_t>(tpdo.get(slots::kStatusword));
  if (config_.feedbackTorque() != 0)
    torque_reading_ = static_cast<std::int16_t>(tpdo.getSigned(slots::kTorque));
  if (torque_.watches())
    torque_.take(torque_reading_, now);
  if (referenced() || phase_ == AxisPhase::kFailed || unconfirmed() || provisional_)
    position_ = units_.toJoint(counts_);
}

void Axis::readEncoder(std::int64_t now) noexcept {
  if (encoder_ < 0)
    return;
  const canopen::Tpdo& tpdo = network_.node(encoder_).tpdos()[0];
  encoder_stream_.watch(tpdo, network_, now);
  if (!encoder_stream_.fresh())
    return;
  encoder_alarm_ = (tpdo.get(slots::kEncoderAlarms) & 1u) != 0;
  encoder_position_ = encoder_reading_.take(static_cast<std::int32_t>(tpdo.getSigned(slots::kEncoderPosition)));
}

void Axis::setLimits() noexcept {
  // Outside the range in which an arm may be enabled: a drive whose target is beyond a limit moves to the limit at
  // once.
  const double here = recovering_ ? units_.toJoint(counts_) : config_.lower;
  const Counts first = units_.toCounts(std::min(config_.lower, here) - safety::kPositionTolerance);
  const Counts second = units_.toCounts(std::max(config_.upper, here) + safety::kPositionTolerance);
  if (!first.exact || !second.exact)
    return fail(HardwareGuard::kReference);
  if ((driveNode().lostProtections() & bit(Protection::kSoftwareLimits)) != 0)
    return beReady();
  const std::int64_t lower = std::min(first.value, second.value) - std::int64_t{1};
  const std::int64_t upper = std::max(first.value, second.value) + std::int64_t{1};
  jobs_.clear();
  jobs_.write(objects::kLowerLimit, lower, 4);
  jobs_.write(objects::kUpperLimit, upper, 4);
  limits_pending_ = true;
}

void Axis::rereference(std::int32_t counts, double position) noexcept {
  if (!units_.setReference(counts, position))
    return fail(HardwareGuard::kReference);
  phase_ = AxisPhase::kReferencing;
  provisional_ = false;
  setLimits();
}

void Axis::countFromHere() noexcept {
  provisional_ = units_.setReference(counts_, 0.0);
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

void Axis::finishLimits(std::int64_t now) noexcept {
  const SdoJobs::Status status = stepJobs(now);
  if (status == SdoJobs::Status::kFailed && canopen::isRefusal(jobs_.abort())) {
    driveNode().addLost(bit(Protection::kSoftwareLimits));
    jobs_.clear();
    beReady();
  } else if (status == SdoJobs::Status::kFailed) {
    fail(HardwareGuard::kReference);
  } else if (status == SdoJobs::Status::kDone) {
    beReady();
  }
}

void Axis::beReady() noexcept {
  limits_pending_ = false;
  position_ = units_.toJoint(counts_);
  phase_ = memory_.plausible(position_) ? AxisPhase::kReady : AxisPhase::kUnhomed;
}

/// Sets the reference from the first TPDOs.
void Axis::reference() noexcept {
  const bool encoder_needed = encoder_ >= 0;
  if (!drive_stream_.fresh() || (encoder_needed && !encoder_stream_.fresh()))
    return;  // both of one SYNC
  switch (config_.reference) {
    case PositionReference::kAbsoluteEncoder:
      if (!encoder_alarm_)
        rereference(counts_, encoder_position_);
      return;
    case PositionReference::kDrive:
      setLimits();
      return;
    case PositionReference::kHoming:
    case PositionReference::kHardStop:
      phase_ = AxisPhase::kUnhomed;
      return;
  }
}

bool Axis::sdoFree() const noexcept {
  return !(brake_ && brake_->writing()) && !mode_.reading() && !temperature_.reading();
}

SdoJobs::Status Axis::stepJobs(std::int64_t now) noexcept {
  return sdoFree() ? jobs_.step(driveNode(), now) : SdoJobs::Status::kBusy;
}

void Axis::requestMode(DriveMode mode) noexcept {
  jobs_.clear();
  jobs_.write(objects::kMode, static_cast<int>(mode), 1);
  mode_.expect(mode, false);
}

/// Accesses to the drive other than jobs(), one after the other.
void Axis::stepSdo(std::int64_t now) noexcept {
  const auto free = [this] { return sdoFree() && jobs_.status() != SdoJobs::Status::kBusy; };
  if (brake_)
    moveBrake(now, free());
  if (!mode_.step(driveState() == DriveState::kOperationEnabled, free(), driveNode(), now))
    fail(HardwareGuard::kSwitchOn);
  temperature_.step(free() && phase_ == AxisPhase::kReady, driveNode(), now);
}

/// Opens the brake while torque holds the joint in operation; closes it before torque goes off, or once it is off.
void Axis::moveBrake(std::int64_t now, bool free) noexcept {
  const DriveState state = driveState();
  const bool torque = state == DriveState::kOperationEnabled || state == DriveState::kQuickStopActive ||
                      state == DriveState::kFaultReaction;
  const bool operation = goal() == PowerGoal::kOperation && state == DriveState::kOperationEnabled;
  // A closing brake stays closed if the joint moves slightly.
  closing_ = torque && !operation && (closing_ || atStandstill());
  const bool open = operation || (torque && !closing_);
  if (!brake_->step(open, torque, units_.toJoint(counts_), free, driveNode(), now))
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
  // In cyclic velocity mode a drive may slow down before its limit and report the bit.
  noteGuard(HardwareGuard::kInternalLimit,
            config_.mode == DriveMode::kCyclicPosition && powered && (statusword_ & statusword::kInternalLimit) != 0);
}

void Axis::judge(std::int64_t now) noexcept {
  guards_ = latched_;
  noteGuard(HardwareGuard::kBus, network_.bus().faulty());
  noteGuard(HardwareGuard::kForeignMaster, network_.masters().commands(now));
  if (phase_ == AxisPhase::kBooting || phase_ == AxisPhase::kFailed)
    return;
  noteGuard(HardwareGuard::kDriveSilent, drive_stream_.silent(network_, feedback_budget_.silence, now));
  noteGuard(HardwareGuard::kFramesLost, 1.0 - feedbackSuccess() > feedback_budget_.lost);
  const DriveState state = driveState();
  noteGuard(HardwareGuard::kDriveFault, state == DriveState::kFault || state == DriveState::kFaultReaction);
  noteGuard(HardwareGuard::kEmergency, emergency_ || encoder_emergency_);
  noteGuard(HardwareGuard::kOverspeed, motion_.tooFast());
  if (encoder_ >= 0) {
    noteGuard(HardwareGuard::kEncoderSilent, encoder_stream_.silent(network_, feedback_budget_.silence, now));
    noteGuard(HardwareGuard::kEncoderAlarm, encoder_alarm_);
    if (phase_ == AxisPhase::kReady)
      noteGuard(HardwareGuard::kEncoderMismatch, std::abs(encoder_position_ - position_) > config_.encoder->tolerance);
  }
  if (operating_)
    judgeMotion(now);
}

void Axis::update(std::int64_t now) noexcept {
  updateNodes(now);
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
    finishLimits(now);
  else if (phase_ == AxisPhase::kReferencing)
    reference();
  stepSdo(now);
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
    found(std::abs(encoder_position_ - position_), config_.encoder->tolerance);
  else if ((guards & bit(HardwareGuard::kFirstMotion)) != 0)
    found(first_motion_.excess(), config_.first_motion);
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
  const bool reports = config_.reports_following && config_.mode != DriveMode::kProfileVelocity;
  return driveState() == DriveState::kOperationEnabled && free_to_move_ && mode_.confirmed() &&
         (!reports || (statusword_ & statusword::kFollowsCommand) != 0);
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
  const std::uint16_t controlword = power_.step(statusword_, mayRelease(now), now);
  sampled_ = now;  // the SYNC of this period follows
  // Without torque the target follows the joint, so that a drive that gets torque does not move.
  if (holding_ && driveState() != DriveState::kOperationEnabled) {
    target_ = position_;
    target_velocity_ = 0.0;
    target_counts_ = counts_;
    following_.forget(target_);
  } else if (!holding_) {
    target_counts_ = units_.toCounts(target_).value;
  }
  following_.reported(target_);
  canopen::Rpdo& rpdo = driveNode().rpdos()[0];
  rpdo.set(slots::kControlword, controlword | (driveState() == DriveState::kOperationEnabled ? mode_bits_ : 0));
  if (config_.mode == DriveMode::kCyclicPosition) {
    rpdo.set(slots::kTarget, target_counts_);
    return;
  }
  const bool moves = driveState() == DriveState::kOperationEnabled;
  const double wanted = target_velocity_ + config_.velocity_gain * (target_ - position_);
  const double speed = moves ? std::clamp(wanted, -1.5 * config_.velocity, 1.5 * config_.velocity) : 0.0;
  rpdo.set(slots::kTarget, units_.toVelocityNumber(speed));
}

}  // namespace tandem::hal
