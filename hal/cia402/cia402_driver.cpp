// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/cia402_driver.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "hal/cia402/detail/node_setups.h"

namespace tandem::hal {
namespace {

using canopen::NodePhase;

static_assert(static_cast<int>(Progress::kIdle) == static_cast<int>(SdoJobs::Status::kIdle) &&
              static_cast<int>(Progress::kBusy) == static_cast<int>(SdoJobs::Status::kBusy) &&
              static_cast<int>(Progress::kDone) == static_cast<int>(SdoJobs::Status::kDone) &&
              static_cast<int>(Progress::kFailed) == static_cast<int>(SdoJobs::Status::kFailed));

AxisUnits unitsOf(const AxisConfig& config) {
  Gearing gearing = config.gearing;
  gearing.offset = 0.0;  // Axis adds it
  return AxisUnits(gearing, config.units);
}

std::string shortest(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

}  // namespace

Cia402Driver::Cia402Driver(const HardwareConfig& hardware,
                           const AxisConfig& config,
                           canopen::Network& network,
                           const safety::Budgets& budgets)
    : config_(config),
      network_(network),
      drive_(network.addNode(driveSetup(hardware, config, budgets.drive_heartbeat))),
      slots_(network.node(drive_), config.hasSwitches()),
      units_(unitsOf(config)),
      temperature_(config) {
  if (!config.encoder)
    return;
  if (config.hasEncoderNode())
    encoder_ = network.addNode(encoderSetup(hardware, config, budgets.drive_heartbeat));
  encoder_slots_ =
      encoder_ >= 0 ? EncoderSlots(network.node(encoder_)) : EncoderSlots(driveNode(), config.encoder->drive_input);
  encoder_reading_ = EncoderReading(*config.encoder, config.lower, config.upper);
}

void Cia402Driver::boot(std::int64_t now) noexcept {
  network_.boot(drive_, now);
  if (encoder_ >= 0)
    network_.boot(encoder_, now);
  phase_ = DriverPhase::kBooting;
  jobs_.clear();
  brake_jobs_.clear();
  temperature_.restart();
  limits_ = prepared_ = Progress::kIdle;
  wrong_mode_ = operation_ = false;
  emergency_ = encoder_emergency_ = false;
  error_code_ = 0;
  encoder_reading_.restart();
  statusword_ = mode_bits_ = 0;
  feedback_.state = DriveFeedback{}.state;
}

void Cia402Driver::onEmcy(int node, const canopen::Emcy& emcy) noexcept {
  (node == drive_ ? emergency_ : encoder_emergency_) = emcy.code != canopen::error_code::kNone;
  if (emcy.code != canopen::error_code::kNone)
    error_code_ = emcy.code;
}

void Cia402Driver::updateNodes(std::int64_t now) noexcept {
  bool all = true;
  for (const int index : {drive_, encoder_}) {
    if (index < 0)
      continue;
    if (network_.node(index).phase() == NodePhase::kConfigured && !(index == drive_ && refusedForCounts()))
      network_.start(index, now);
    const NodePhase phase = network_.node(index).phase();
    if (phase == NodePhase::kFailed)
      phase_ = DriverPhase::kFailed;
    all = all && phase == NodePhase::kOperational;
  }
  if (phase_ == DriverPhase::kBooting && all) {
    phase_ = DriverPhase::kUp;
    brake_jobs_.clear();
    const std::uint64_t* shown = driveNode().readValue(objects::kModeDisplay);
    mode_.expect(config_.mode, shown != nullptr && *shown == static_cast<std::uint64_t>(config_.mode));
    emergency_ = encoder_emergency_ = false;  // those before the reset; a present error shows in the statusword
  }
}

/// Refuses a drive whose counts are others than those of the hardware file: every distance would be wrong.
bool Cia402Driver::refusedForCounts() noexcept {
  const auto counts = differingCounts(statedFactors(driveNode()), config_.gearing);
  if (!config_.checks_counts || !counts)
    return false;
  driveNode().refuse(objects::kIncrements, static_cast<std::uint64_t>(std::llround(*counts)));
  return true;
}

void Cia402Driver::readDrive() noexcept {
  const canopen::Node& drive = driveNode();
  feedback_.arrivals.expected = network_.syncCount();
  if (!samples_.take(drive, slots_.measured))
    return;
  constexpr double kPerMille = 1e3;
  feedback_.arrivals.received = samples_.count();
  feedback_.time = sampled_;
  statusword_ = static_cast<std::uint16_t>(drive.get(slots_.statusword()));
  feedback_.state = driveState(statusword_);
  feedback_.position = units_.toJoint(static_cast<std::int32_t>(drive.getSigned(slots_.position())));
  if (slots_.torque().mapped())
    feedback_.torque = static_cast<double>(static_cast<std::int16_t>(drive.getSigned(slots_.torque()))) / kPerMille;
  const bool reports = config_.reports_following && config_.mode != DriveMode::kProfileVelocity;
  feedback_.follows = !reports || (statusword_ & statusword::kFollowsCommand) != 0;
  const std::uint64_t inputs = slots_.inputs.mapped() ? drive.get(slots_.inputs) : 0;
  const auto active = [inputs](int bit) { return bit >= 0 && (inputs >> bit & 1u) != 0; };
  feedback_.at_lower = active(units_.reversed() ? config_.positive_switch : config_.negative_switch);
  feedback_.at_upper = active(units_.reversed() ? config_.negative_switch : config_.positive_switch);
  // In cyclic velocity mode a drive may slow down before its limit and report the bit.
  feedback_.limited = config_.mode == DriveMode::kCyclicPosition && (statusword_ & statusword::kInternalLimit) != 0;
}

void Cia402Driver::readEncoder() noexcept {
  if (!config_.encoder)
    return;
  const canopen::Node& encoder = nodeOf(true);
  encoder_feedback_.arrivals.expected = network_.syncCount();
  if (!encoder_samples_.take(encoder, encoder_slots_.measured))
    return;
  encoder_feedback_.arrivals.received = encoder_samples_.count();
  encoder_feedback_.alarm = encoder_slots_.alarms().mapped() && (encoder.get(encoder_slots_.alarms()) & 1u) != 0;
  encoder_feedback_.position =
      encoder_reading_.take(static_cast<std::int32_t>(encoder.getSigned(encoder_slots_.position())));
}

DriveInputs Cia402Driver::inputs(bool of_status) const noexcept {
  const canopen::Node& node = driveNode();
  const canopen::PdoSlot at = of_status ? slots_.statusword() : slots_.inputs;
  return {node.phase() == NodePhase::kOperational,
          node.phase() == NodePhase::kFailed,
          {node.tpdos()[static_cast<std::size_t>(at.pdo)].count, network_.syncCount()},
          static_cast<std::uint32_t>(node.get(at))};
}

bool Cia402Driver::sdoFree() const noexcept {
  return brake_jobs_.status() != SdoJobs::Status::kBusy && !mode_.reading() && !temperature_.reading();
}

void Cia402Driver::stepJobs(std::int64_t now) noexcept {
  if (jobs_.status() != SdoJobs::Status::kBusy || !sdoFree())
    return;
  Progress progress = progressOf(jobs_.step(driveNode(), now));
  if (limits_ != Progress::kBusy) {
    prepared_ = progress;
    return;
  }
  if (progress == Progress::kFailed && canopen::isRefusal(jobs_.abort())) {
    driveNode().addLost(bit(Protection::kSoftwareLimits));
    jobs_.clear();
    progress = Progress::kDone;
  }
  limits_ = progress;
}

void Cia402Driver::stepMode(std::int64_t now) noexcept {
  wrong_mode_ = !mode_.step(operation_, idle(), driveNode(), now) || wrong_mode_;
}

void Cia402Driver::stepTemperature(std::int64_t now) noexcept {
  temperature_.step(idle() && limits_ == Progress::kDone, driveNode(), now);
}

void Cia402Driver::update(std::int64_t now) noexcept {
  updateNodes(now);
  if (phase_ == DriverPhase::kBooting)
    return;
  readDrive();
  readEncoder();
  stepJobs(now);
  brake_jobs_.step(driveNode(), now);
  if (mode_.reading())
    stepMode(now);
  if (temperature_.reading())
    stepTemperature(now);
}

void Cia402Driver::command(const DriveCommand& command, std::int64_t now) noexcept {
  if (phase_ != DriverPhase::kBooting && !mode_.reading())  // after the brake
    stepMode(now);
  if (phase_ != DriverPhase::kBooting && !temperature_.reading())
    stepTemperature(now);
  sampled_ = now;  // the SYNC of this period follows
  operation_ = feedback_.state == DriveState::kOperationEnabled;
  canopen::Node& drive = driveNode();
  drive.set(slots_.controlword, command.word | (operation_ ? mode_bits_ : 0));
  drive.set(slots_.target, targetIsVelocity(config_.mode) ? units_.toVelocityNumber(command.velocity)
                                                          : units_.toCounts(command.position).value);
}

void Cia402Driver::setLimits(double lower, double upper) noexcept {
  const auto limits = units_.softwareLimits(lower, upper);
  if (!limits) {
    limits_ = Progress::kFailed;
    return;
  }
  if ((lostProtections() & bit(Protection::kSoftwareLimits)) != 0) {
    limits_ = Progress::kDone;
    return;
  }
  prepared_ = Progress::kIdle;
  jobs_.clear();
  jobs_.write(objects::kLowerLimit, limits->least, 4);
  jobs_.write(objects::kUpperLimit, limits->most, 4);
  limits_ = Progress::kBusy;
}

/// Maximum torque of the drive (6072) during a run against a mechanical stop, and otherwise: as it was at boot.
std::int64_t Cia402Driver::maximumTorque(bool push) const noexcept {
  constexpr double kPerMille = 1e3;
  const std::uint64_t* before = driveNode().readValue(objects::kMaxTorque);
  const auto normal = static_cast<std::int64_t>(before == nullptr ? 0 : *before);
  return push ? std::min<std::int64_t>(normal, std::lround(kPerMille * config_.hard_stop.torque)) : normal;
}

void Cia402Driver::prepare(DriveTask task) noexcept {
  const DriveMode mode = task == DriveTask::kHome ? DriveMode::kHoming : config_.mode;
  limits_ = Progress::kIdle;
  jobs_.clear();
  jobs_.write(objects::kMode, static_cast<int>(mode), 1);
  mode_.expect(mode, false);
  wrong_mode_ = false;
  if (config_.reference == PositionReference::kHardStop)
    jobs_.write(objects::kMaxTorque, maximumTorque(task == DriveTask::kPush), 2);
  prepared_ = Progress::kBusy;
}

Progress Cia402Driver::confirmed() const noexcept {
  return mode_.confirmed() ? Progress::kDone : wrong_mode_ ? Progress::kFailed : Progress::kBusy;
}

Progress Cia402Driver::homing() const noexcept {
  switch (homingState(statusword_)) {
    case HomingState::kDone:
      return Progress::kDone;
    case HomingState::kErrorMoving:
    case HomingState::kErrorStanding:
      return Progress::kFailed;
    default:
      return Progress::kBusy;
  }
}

bool Cia402Driver::setBrake(bool closed) noexcept {
  if (!idle())
    return false;
  brake_jobs_.clear();
  brake_jobs_.write(objects::kOutputs, config_.brake->output(closed), 4);
  return true;
}

const canopen::Node& Cia402Driver::nodeOf(bool encoder) const noexcept {
  return network_.node(encoder && encoder_ >= 0 ? encoder_ : drive_);
}

std::string Cia402Driver::deviceName(bool encoder) const {
  const canopen::Node& node = nodeOf(encoder);
  return node.setup().name + " (node " + std::to_string(node.id()) + ")";
}

std::string Cia402Driver::describe(const DeviceFailure& failure, bool encoder) const {
  const canopen::Node& node = nodeOf(encoder);
  const canopen::NodeFailure failed = nodeFailure(failure);
  std::string text = node.describe(failed);
  if (failed.step < 0)
    return text;
  const canopen::SetupStep& step = node.steps()[static_cast<std::size_t>(failed.step)];
  if (failed.reason == canopen::NodeFailure::Reason::kMismatch) {
    const std::string units = encoder ? "" : describeUnits(step.object, failed.value);
    return units.empty() ? text : units;
  }
  const ProtectionMask lost = step.protections & node.lostProtections();
  if (lost != 0)
    text += "; without " + describeProtections(lost) +
            " the drive may go on when the HAL ends: change its setting, or `accept` this axis in the hardware file "
            "(docs/hardware.md)";
  return text;
}

/// "the drive states velocities in rpm (60A9), the hardware file says ..."; empty for an object without a unit.
std::string Cia402Driver::describeUnits(const canopen::ObjectAddress& object, std::uint64_t stated) const {
  const auto differ = [](const auto& found, const auto& words, const char* quantity, const char* key, RateUnit unit,
                         double scale) {
    const auto in = [&words](RateUnit of, double times) {
      return std::string(words[static_cast<std::size_t>(of)]) + (times == 1.0 ? "" : " times " + shortest(times));
    };
    return std::string("the drive states ") + quantity + " in " + in(found->first, found->second) +
           ", the hardware file says " + in(unit, scale) + ": set " + key + " and its _scale, or set up the drive";
  };
  const DriveUnits& units = config_.units;
  if (object == objects::kIncrements)
    return "the drive states " + describeCounts(static_cast<double>(stated), config_.gearing) +
           ": correct counts_per_revolution, or set up the drive (`sdo`); `checks_counts: false` is for a drive that "
           "means something else by these objects";
  const auto code = static_cast<std::uint32_t>(stated);
  if (const auto found = unitOfVelocityCode(code); found && object == objects::kVelocityUnit)
    return differ(found, kVelocityUnits, "velocities (60A9)", "velocity_unit", units.velocity, units.velocity_scale);
  if (const auto found = unitOfAccelerationCode(code); found && object == objects::kAccelerationUnit)
    return differ(found, kAccelerationUnits, "accelerations (60AA)", "acceleration_unit", units.acceleration,
                  units.acceleration_scale);
  return {};
}

/// "; the drive states 2000 counts per revolution ..., the hardware file says 4096" where they differ.
std::string Cia402Driver::remarks() const {
  const StatedFactors factors = statedFactors(driveNode());
  std::string text;
  if (const auto counts = differingCounts(factors, config_.gearing))
    text += "; the drive states " + describeCounts(*counts, config_.gearing);
  const auto compare = [&text](const StatedFactors::Ratio& stated, double counts_per_number, const char* of) {
    const double numbers = 1.0 / counts_per_number;
    if (stated.isSet() && factorDiffers(stated.value(), numbers))
      text += std::string("; the drive states ") + of + " of " + shortest(stated.value()) +
              ", the hardware file's units make it " + shortest(numbers);
  };
  compare(factors.velocity, units_.countsPerVelocityNumber(), "a velocity factor (6096)");
  compare(factors.acceleration, units_.countsPerAccelerationNumber(), "an acceleration factor (6097)");
  return text;
}

DeviceFailure deviceFailure(const canopen::NodeFailure& failure) noexcept {
  return {static_cast<std::uint8_t>(failure.reason), failure.step, static_cast<std::uint32_t>(failure.abort),
          failure.value};
}

canopen::NodeFailure nodeFailure(const DeviceFailure& failure) noexcept {
  return {static_cast<canopen::NodeFailure::Reason>(failure.reason), failure.step,
          static_cast<canopen::SdoAbort>(failure.code), failure.value};
}

}  // namespace tandem::hal
