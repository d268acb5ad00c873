// SPDX-License-Identifier: Apache-2.0
#include "hal/axis.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hal/nanoseconds.h"
#include "hal/node_setups.h"

namespace tandem::hal {
namespace {

using canopen::NodePhase;

/// A TPDO is missed after so many SYNCs, and the budget's time at the least.
constexpr std::uint64_t kMissedSyncs = 3;
/// For which a drive may not say that it follows: one TPDO may have been sampled before the command came.
constexpr double kIgnoreBudget = 0.030;

}  // namespace

std::string_view name(AxisPhase phase) {
  constexpr std::array<std::string_view, 5> kNames{"booting", "referencing", "unhomed", "ready", "failed"};
  const auto i = static_cast<std::size_t>(phase);
  return i < kNames.size() ? kNames[i] : std::string_view("unknown");
}

Axis::Axis(const HardwareConfig& hardware, const AxisConfig& config, canopen::Network& network, double heartbeat_budget)
    : config_(config),
      period_(hardware.period),
      feedback_budget_(std::max(hardware.feedback_budget, 3.0 * hardware.period)),
      network_(network),
      drive_(network.addNode(driveSetup(hardware, config, heartbeat_budget))),
      units_(config.gearing),
      power_(hardware.transition_budget),
      temperature_(std::numeric_limits<double>::quiet_NaN()) {
  if (!config.encoder)
    return;
  encoder_ = network.addNode(encoderSetup(hardware, config, heartbeat_budget));
  encoder_units_ = AxisUnits(config.encoder->gearing);
}

void Axis::boot(std::int64_t now) noexcept {
  network_.boot(drive_, now);
  if (encoder_ >= 0)
    network_.boot(encoder_, now);
  phase_ = AxisPhase::kBooting;
  guards_ = latched_ = 0;
  jobs_.clear();
  limits_pending_ = false;
  emergency_ = encoder_emergency_ = encoder_alarm_ = false;
  error_code_ = 0;
  drive_stream_ = encoder_stream_ = {};
  statusword_ = 0;
  velocity_ = following_error_ = 0.0;
  mode_bits_ = 0;
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
    recent_targets_.fill(target_);
    outside_since_ = ignoring_since_ = 0;
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
    emergency_ = encoder_emergency_ = false;  // of the time before the reset; what still stands shows in the statusword
    fault_reset_ = true;
  }
}

void Axis::watchStream(const canopen::Tpdo& tpdo, Stream& stream, std::int64_t now) noexcept {
  if (!stream.heard) {  // the wait for the first one begins now
    stream.heard = true;
    stream.count = tpdo.count;
    stream.time = now;
    stream.sync_mark = network_.syncCount();
  }
  stream.fresh = tpdo.count != stream.count;
  if (!stream.fresh)
    return;
  stream.count = tpdo.count;
  stream.time = now;
  stream.sync_mark = network_.syncCount();
}

bool Axis::silent(const Stream& stream, std::int64_t now) const noexcept {
  // Not heard while this process itself stood still proves nothing: the SYNCs count, too.
  return network_.syncCount() - stream.sync_mark >= kMissedSyncs && now - stream.time > nanoseconds(feedback_budget_);
}

void Axis::readDrive(std::int64_t now) noexcept {
  const canopen::Tpdo& tpdo = driveNode().tpdos()[0];
  const std::int64_t before = drive_stream_.time;
  const bool first = !drive_stream_.heard;
  watchStream(tpdo, drive_stream_, now);
  if (!drive_stream_.fresh)
    return;
  const std::int32_t counts = static_cast<std::int32_t>(tpdo.getSigned(slots::kPosition));
  const double passed = std::max(period_, 1e-9 * static_cast<double>(now - before));
  // One count to and fro is the counter's, not the joint's.
  const double step = static_cast<double>(counts) - static_cast<double>(counts_);
  velocity_ = first || std::abs(step) <= 1.0 ? 0.0 : units_.toJointSpeed(step / passed);
  counts_ = counts;
  statusword_ = static_cast<std::uint16_t>(tpdo.get(slots::kStatusword));
  if (phase_ == AxisPhase::kReady || phase_ == AxisPhase::kFailed)
    position_ = units_.toJoint(counts_);
}

void Axis::readEncoder(std::int64_t now) noexcept {
  if (encoder_ < 0)
    return;
  const canopen::Tpdo& tpdo = network_.node(encoder_).tpdos()[0];
  watchStream(tpdo, encoder_stream_, now);
  if (!encoder_stream_.fresh)
    return;
  encoder_alarm_ = (tpdo.get(slots::kEncoderAlarms) & 1u) != 0;
  encoder_position_ = encoder_units_.toJoint(static_cast<std::int32_t>(tpdo.getSigned(slots::kEncoderPosition)));
}

void Axis::setLimits() noexcept {
  // A hair outside, so that a setpoint at the limit of the gate is inside in counts, too.
  Counts first = units_.toCounts(config_.lower), second = units_.toCounts(config_.upper);
  if (!first.exact || !second.exact)
    return fail(HardwareGuard::kReference);
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
  setLimits();
}

/// From the first TPDOs to known position and limits in the drive.
void Axis::reference(std::int64_t now) noexcept {
  if (limits_pending_) {
    const SdoJobs::Status status = jobs_.step(driveNode(), now);
    if (status == SdoJobs::Status::kFailed)
      fail(HardwareGuard::kReference);
    if (status != SdoJobs::Status::kDone)
      return;
    limits_pending_ = false;
    phase_ = AxisPhase::kReady;
    position_ = units_.toJoint(counts_);
    return;
  }
  const bool encoder_needed = encoder_ >= 0;
  if (!drive_stream_.fresh || (encoder_needed && !encoder_stream_.fresh))
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
      phase_ = AxisPhase::kUnhomed;
      return;
  }
}

/// Once a second, when nothing else uses the node's SDO client.
void Axis::readTemperature(std::int64_t now) noexcept {
  if (config_.temperature_index == 0 || phase_ != AxisPhase::kReady)
    return;
  if (jobs_.status() != SdoJobs::Status::kBusy && now >= next_temperature_) {
    next_temperature_ = now + kSecond;
    jobs_.clear();
    jobs_.read({config_.temperature_index, config_.temperature_sub});
    return;
  }
  if (jobs_.status() != SdoJobs::Status::kBusy)
    return;
  const SdoJobs::Status status = jobs_.step(driveNode(), now);
  if (status == SdoJobs::Status::kDone) {
    const int bits = 8 * static_cast<int>(std::clamp<std::size_t>(driveNode().sdo().data().size(), 1, 4));
    temperature_ = config_.temperature_scale * static_cast<double>(canopen::signExtend(jobs_.value(), bits));
  } else if (status == SdoJobs::Status::kFailed) {
    temperature_ = std::numeric_limits<double>::quiet_NaN();
  }
}

void Axis::noteGuard(HardwareGuard guard, bool stands) noexcept {
  if (stands)
    guards_ |= bit(guard);
}

void Axis::judgeMotion(std::int64_t now) noexcept {
  // What is old says nothing about where the joint is; that it is old is another guard's business.
  if (drive_stream_.fresh)
    judgeFollowing(now);
  noteGuard(HardwareGuard::kFollowing,
            outside_since_ != 0 && now - outside_since_ >= nanoseconds(config_.following_time));
  noteGuard(HardwareGuard::kPowerLost, driveState() != DriveState::kOperationEnabled);
  if (followsCommand() || driveState() != DriveState::kOperationEnabled) {
    ignoring_since_ = 0;
  } else if (ignoring_since_ == 0) {
    ignoring_since_ = now;
  }
  noteGuard(HardwareGuard::kIgnoresCommand,
            ignoring_since_ != 0 && now - ignoring_since_ >= nanoseconds(kIgnoreBudget));
}

void Axis::judgeFollowing(std::int64_t now) noexcept {
  const auto [least, most] = std::minmax_element(recent_targets_.begin(), recent_targets_.end());
  following_error_ = position_ > *most ? position_ - *most : position_ < *least ? position_ - *least : 0.0;
  if (std::abs(following_error_) <= config_.following_error) {
    outside_since_ = 0;
  } else if (outside_since_ == 0) {
    outside_since_ = now;
  }
}

void Axis::judge(std::int64_t now) noexcept {
  guards_ = latched_;
  noteGuard(HardwareGuard::kBus, network_.bus().faulty());
  if (phase_ == AxisPhase::kBooting || phase_ == AxisPhase::kFailed)
    return;
  noteGuard(HardwareGuard::kDriveSilent, silent(drive_stream_, now));
  const DriveState state = driveState();
  noteGuard(HardwareGuard::kDriveFault, state == DriveState::kFault || state == DriveState::kFaultReaction);
  noteGuard(HardwareGuard::kEmergency, emergency_ || encoder_emergency_);
  if (encoder_ >= 0) {
    noteGuard(HardwareGuard::kEncoderSilent, silent(encoder_stream_, now));
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
  if (phase_ == AxisPhase::kReferencing)
    reference(now);
  readTemperature(now);
  judge(now);
}

safety::FaultRecord Axis::failure(GuardMask guards) const noexcept {
  using safety::FaultCause;
  constexpr GuardMask kSilent = bit(HardwareGuard::kNode) | bit(HardwareGuard::kDriveSilent) |
                                bit(HardwareGuard::kEncoderSilent) | bit(HardwareGuard::kBus);
  constexpr GuardMask kError =
      bit(HardwareGuard::kDriveFault) | bit(HardwareGuard::kEmergency) | bit(HardwareGuard::kEncoderAlarm);
  safety::FaultRecord record;
  record.faults = faultsOf(guards);
  if (record.faults == 0)
    return record;
  record.joint = static_cast<std::uint8_t>(config_.joint);
  if ((guards & kSilent) != 0) {
    record.cause = FaultCause::kNoAnswer;
  } else if ((guards & kError) != 0) {
    record.cause = FaultCause::kDeviceError;
  } else if ((guards & bit(HardwareGuard::kEncoderMismatch)) != 0) {
    record.cause = FaultCause::kDisagree;
    record.amount = std::abs(encoder_position_ - position_);
    record.allowed = config_.encoder->tolerance;
  } else if ((guards & bit(HardwareGuard::kFollowing)) != 0) {
    record.cause = FaultCause::kFollowingError;
    record.amount = std::abs(following_error_);
    record.allowed = config_.following_error;
  } else if ((guards & bit(HardwareGuard::kPowerLost)) != 0) {
    record.cause = FaultCause::kOff;
  }
  return record;
}

bool Axis::followsCommand() const noexcept {
  return driveState() == DriveState::kOperationEnabled && (statusword_ & statusword::kFollowsCommand) != 0;
}

bool Axis::valid() const noexcept {
  constexpr GuardMask kUnknown = kSensorGuards | bit(HardwareGuard::kDriveSilent) | bit(HardwareGuard::kNode);
  return phase_ == AxisPhase::kReady && (guards_ & kUnknown) == 0;
}

void Axis::writeCommand(std::int64_t now) noexcept {
  const std::uint16_t controlword = power_.step(statusword_, now);
  // Without torque the target follows the joint, so that torque never finds a distance to cover.
  if (holding_ && driveState() != DriveState::kOperationEnabled) {
    target_ = position_;
    target_velocity_ = 0.0;
    target_counts_ = counts_;
    recent_targets_.fill(target_);
  } else if (!holding_) {
    target_counts_ = units_.toCounts(target_).value;
  }
  recent_targets_[recent_++ % kRecentTargets] = target_;
  canopen::Rpdo& rpdo = driveNode().rpdos()[0];
  rpdo.set(slots::kControlword, controlword | (driveState() == DriveState::kOperationEnabled ? mode_bits_ : 0));
  if (config_.mode == DriveMode::kCyclicPosition) {
    rpdo.set(slots::kTarget, target_counts_);
    return;
  }
  const bool moves = driveState() == DriveState::kOperationEnabled;
  const double wanted = target_velocity_ + config_.velocity_gain * (target_ - position_);
  const double speed = moves ? std::clamp(wanted, -1.5 * config_.velocity, 1.5 * config_.velocity) : 0.0;
  rpdo.set(slots::kTarget, static_cast<std::int64_t>(std::llround(units_.toCountSpeed(speed))));
}

}  // namespace tandem::hal
