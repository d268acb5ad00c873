// SPDX-License-Identifier: Apache-2.0
#include "hal/cia402/detail/node_setups.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "hal/cia402/cia402_driver.h"
#include "hal/drives/cyclic_objects.h"
#include "hal/nanoseconds.h"

namespace tandem::hal {
namespace {

using canopen::PdoConfig;
using canopen::PdoDirection;
using canopen::SetupStep;

constexpr std::uint32_t kDriveProfile = 402;
constexpr std::uint32_t kEncoderProfile = 406;
/// CANopen has up to four predefined PDOs per direction; those that the HAL does not use must not load the bus.
constexpr int kPredefinedPdos = 4;
constexpr double kProfileReserve = 2.0;  ///< of the ramps of profile velocity

std::uint16_t milliseconds(double seconds) {
  constexpr double kMost = std::numeric_limits<std::uint16_t>::max();
  return static_cast<std::uint16_t>(std::clamp(std::round(1e3 * seconds), 1.0, kMost));
}

void append(std::vector<SetupStep>& steps, const std::vector<SetupStep>& more) {
  steps.insert(steps.end(), more.begin(), more.end());
}

SetupStep optional(SetupStep step) {
  step.optional = true;
  return step;
}

/// A drive that keeps a value of its own here works as well.
SetupStep dispensable(SetupStep step) {
  step.dispensable = true;
  return optional(std::move(step));
}

/// A speed or an acceleration, which drives round to their own units.
SetupStep writeRate(canopen::ObjectAddress object, std::int64_t value, std::string what) {
  constexpr std::uint64_t kShare = 100;
  SetupStep step = canopen::write(object, value, 4, std::move(what));
  step.tolerance = step.value / kShare;
  return step;
}

/// A drive without this object works, but without this protection.
SetupStep wanted(SetupStep step, Protection protection) {
  step.protections = bit(protection);
  return step;
}

canopen::Identity identityOf(const DeviceIdentity& device) {
  return {0, device.vendor, device.product, device.revision, device.serial};
}

/// Setup common to drives and encoders: identity, mutual watch, time-outs. @param watch lost without 1016 (or 100C,
/// 100D); 0: it is needed.
canopen::NodeSetup commonSetup(const HardwareConfig& hardware,
                               const AxisConfig& axis,
                               int node,
                               const DeviceIdentity& device,
                               std::uint32_t profile,
                               double heartbeat_budget,
                               MutualWatch kind,
                               ProtectionMask watch) {
  const BusConfig& bus = hardware.buses[static_cast<std::size_t>(axis.bus)];
  canopen::NodeSetup setup;
  setup.id = static_cast<std::uint8_t>(node);
  setup.steps.push_back(canopen::checkBits({0x1000, 0}, profile, 0xFFFF, 4, "device profile"));
  append(setup.steps, canopen::identitySteps(identityOf(device)));
  canopen::Guarding guarding;
  guarding.our_id = static_cast<std::uint8_t>(bus.node_id);
  guarding.our_heartbeat_timeout = milliseconds(heartbeat_budget);
  guarding.node_heartbeat = milliseconds(hardware.node_heartbeat);
  guarding.protections = watch;
  setup.heartbeat_timeout = nanoseconds(std::max(2.5 * hardware.node_heartbeat, heartbeat_budget));
  if (kind == MutualWatch::kNodeGuarding) {
    guarding.guard_time = static_cast<std::uint16_t>(guardTime(heartbeat_budget));
    guarding.life_factor = kGuardsPerBudget;
    setup.guard_period = nanoseconds(1e-3 * guarding.guard_time);
    setup.heartbeat_timeout = nanoseconds(heartbeat_budget);
  }
  append(setup.steps, canopen::guardingSteps(guarding));
  if (bus.sync_counter != 0)
    setup.steps.push_back(canopen::write({0x1019, 0}, bus.sync_counter, 1, "SYNC counter (sync_counter of the bus)"));
  setup.boot_timeout = nanoseconds(hardware.boot_budget);
  setup.sdo_timeout = nanoseconds(axis.sdo_timeout);
  return setup;
}

/// Switches off all predefined PDOs outside of `first` to `last`, if the node has them.
void switchOffOthers(std::vector<SetupStep>& steps, PdoDirection direction, int first, int last, int node) {
  for (int number = 1; number <= kPredefinedPdos; ++number) {
    if (number >= first && number <= last)
      continue;
    for (SetupStep& step : canopen::pdoOffSteps(number, direction, node))
      steps.push_back(optional(std::move(step)));
  }
}

/// PDOs like `pdo`, numbered from 1, with these objects.
std::vector<PdoConfig> mapped(const std::vector<CyclicObject>& objects, int most_objects, PdoConfig pdo) {
  std::vector<PdoConfig> pdos;
  for (const std::vector<CyclicObject>& part : packPdos(objects, most_objects)) {
    pdo.layout.clear();
    for (const CyclicObject& object : part)
      pdo.layout.add({{object.index, object.sub}, object.bits});
    pdo.number = static_cast<int>(pdos.size()) + 1;
    pdos.push_back(pdo);
  }
  return pdos;
}

/// 60C2: the period as u8 * 10^i8 s; config guarantees multiples of 0.1 ms up to 20 ms.
void appendInterpolation(std::vector<SetupStep>& steps, double period) {
  std::int64_t value = std::llround(1e4 * period);
  int exponent = -4;
  for (; value % 10 == 0; value /= 10)
    ++exponent;
  // A drive without the object measures the period of SYNC.
  steps.push_back(optional(canopen::write({0x60C2, 1}, value, 1, "interpolation period")));
  steps.push_back(optional(canopen::write({0x60C2, 2}, exponent, 1, "interpolation period exponent")));
}

/// Refuses a drive that states another unit than the hardware file. A unit that is not known, and an object that is
/// absent or 0, say nothing.
SetupStep unitStep(canopen::ObjectAddress object,
                   std::uint32_t (*code_of)(RateUnit, double),
                   RateUnit unit,
                   double scale,
                   const char* what) {
  const std::uint32_t expected = code_of(unit, scale);
  SetupStep step = optional(canopen::check(object, expected, 4, what));
  for (const RateUnit other : kRateUnits) {
    for (int power = kSmallestUnitPower; power <= 0; ++power) {
      const std::uint32_t code = code_of(other, std::pow(10.0, -power));
      if (code != expected)
        step.refused.push_back(code);
    }
  }
  return step;
}

/// What the hardware file writes, before all that the HAL writes itself.
void appendWrites(std::vector<SetupStep>& steps, const std::vector<SdoWrite>& writes) {
  for (const SdoWrite& write : writes) {
    const std::string what = write.why.empty() ? "`sdo` of the hardware file" : write.why;
    const canopen::ObjectAddress object{write.index, write.sub};
    SetupStep step = write.read_back ? canopen::write(object, write.value, write.size, what)
                                     : canopen::writeOnly(object, write.value, write.size, what);
    step.tolerance = write.tolerance;
    step.optional = write.optional;
    steps.push_back(std::move(step));
  }
}

void appendUnits(std::vector<SetupStep>& steps, const DriveUnits& units) {
  steps.push_back(unitStep(objects::kVelocityUnit, velocityCode, units.velocity, units.velocity_scale,
                           "unit of velocities (velocity_unit of the hardware file)"));
  steps.push_back(unitStep(objects::kAccelerationUnit, accelerationCode, units.acceleration, units.acceleration_scale,
                           "unit of accelerations (acceleration_unit of the hardware file)"));
}

/// What the drive states of its gearing, for a comparison with the hardware file.
void appendFactors(std::vector<SetupStep>& steps) {
  for (const canopen::ObjectAddress object : objects::kFactors)
    steps.push_back(optional(canopen::read(object, 0, "factor of the drive's units")));
}

/** Numbers without sign for a drive's objects. */
struct Magnitudes {
  AxisUnits units;
  std::int64_t velocity(double value) const { return std::abs(units.toVelocityNumber(value)); }
  std::int64_t acceleration(double value) const { return std::abs(units.toAccelerationNumber(value)); }
};
Magnitudes magnitudes(const AxisConfig& axis) { return {AxisUnits(axis.gearing, axis.units)}; }

/// Reaction of a drive to a stop or a loss of communication: always the quick stop ramp.
void appendReactions(std::vector<SetupStep>& steps, const AxisConfig& axis) {
  const std::int64_t deceleration = magnitudes(axis).acceleration(axis.quick_stop_deceleration);
  using enum Protection;
  const std::int64_t after_stop = axis.brake ? 6 : 2;
  steps.push_back(
      wanted(canopen::write({0x6007, 0}, 3, 2, "abort connection option: quick stop"), kConnectionReaction));
  // An axis whose brake the HAL closes keeps its torque after the ramp, until the brake holds or the HAL disables it.
  steps.push_back(
      wanted(canopen::write({0x605A, 0}, after_stop, 2,
                            axis.brake ? "quick stop option: ramp, then hold" : "quick stop option: ramp, then off"),
             kQuickStopRamp));
  steps.push_back(dispensable(canopen::write({0x605B, 0}, 1, 2, "shutdown option: ramp")));
  steps.push_back(dispensable(canopen::write({0x605C, 0}, 1, 2, "disable operation option: ramp")));
  steps.push_back(dispensable(canopen::write({0x605D, 0}, 2, 2, "halt option: quick stop ramp")));
  steps.push_back(wanted(canopen::write({0x605E, 0}, 2, 2, "fault reaction option: quick stop ramp"), kFaultReaction));
  if (axis.mode != DriveMode::kProfileVelocity)
    steps.push_back(dispensable(writeRate({0x6084, 0}, deceleration, "profile deceleration")));
  steps.push_back(wanted(writeRate({0x6085, 0}, deceleration, "quick stop deceleration"), kQuickStopRamp));
}

/// The HAL controls the output of the brake, and keeps the brake closed until the drive has torque.
void appendBrake(std::vector<SetupStep>& steps, const BrakeConfig& brake) {
  steps.push_back(canopen::write(objects::kOutputMask, brake.mask(), 4, "mask of the brake's output"));
  steps.push_back(canopen::write(objects::kOutputs, brake.output(true), 4, "output of the closed brake"));
}

void appendWindows(std::vector<SetupStep>& steps, const AxisConfig& axis) {
  const AxisUnits units(axis.gearing);
  steps.push_back(
      wanted(canopen::write({0x6065, 0}, units.toCountMagnitude(axis.following_error), 4, "following error window"),
             Protection::kFollowingError));
  steps.push_back(wanted(canopen::write({0x6066, 0}, milliseconds(axis.following_time), 2, "following error time-out"),
                         Protection::kFollowingError));
  // In rpm of the motor, whatever the drive's other units (CiA 402-2, 6080). With an allowance for the position loop to
  // catch up; the gate limits the speed itself.
  const double turns =
      static_cast<double>(units.toCountMagnitude(2.0 * axis.velocity)) / axis.gearing.counts_per_revolution;
  const auto rpm = static_cast<std::int64_t>(std::ceil(60.0 * turns));
  steps.push_back(wanted(writeRate({0x6080, 0}, rpm, "maximum motor speed in rpm"), Protection::kSpeedLimit));
  if (targetIsVelocity(axis.mode))
    steps.push_back(
        wanted(writeRate({0x607F, 0}, magnitudes(axis).velocity(2.0 * axis.velocity), "maximum profile velocity"),
               Protection::kSpeedLimit));
  // Written once the position is known.
  for (const canopen::ObjectAddress object : {objects::kLowerLimit, objects::kUpperLimit})
    steps.push_back(wanted(canopen::read(object, 4, "software limit"), Protection::kSoftwareLimits));
}

/// Ramps of profile velocity: steeper than every ramp that the HAL commands, so that the position loop leads.
void appendProfile(std::vector<SetupStep>& steps, const AxisConfig& axis) {
  const double steepest = std::isfinite(axis.slew_limit) ? std::max(axis.slew_limit, axis.quick_stop_deceleration)
                                                         : axis.quick_stop_deceleration;
  const std::int64_t ramp = magnitudes(axis).acceleration(kProfileReserve * steepest);
  steps.push_back(writeRate({0x6083, 0}, ramp, "profile acceleration"));
  steps.push_back(writeRate({0x6084, 0}, ramp, "profile deceleration"));
}

void appendHoming(std::vector<SetupStep>& steps, const AxisConfig& axis) {
  const Magnitudes units = magnitudes(axis);
  const HomingConfig& homing = axis.homing;
  steps.push_back(optional(canopen::write({0x607C, 0}, 0, 4, "home offset")));
  steps.push_back(canopen::write(objects::kHomingMethod, homing.method, 1, "homing method"));
  steps.back().is_signed = true;
  steps.push_back(writeRate({0x6099, 1}, units.velocity(homing.fast), "homing speed to the switch"));
  steps.push_back(writeRate({0x6099, 2}, units.velocity(homing.slow), "homing speed to the index"));
  steps.push_back(writeRate({0x609A, 0}, units.acceleration(homing.acceleration), "homing acceleration"));
}

/// Some drives show the mode only in operation enabled: then it is read there (ModeConfirmation).
SetupStep awaitMode(DriveMode mode) {
  SetupStep step = canopen::check(objects::kModeDisplay, static_cast<int>(mode), 1, "mode of operation display");
  step.kind = SetupStep::Kind::kAwait;
  step.late = true;
  step.timeout = kSecond / 2;
  return step;
}

}  // namespace

canopen::NodeSetup driveSetup(const HardwareConfig& hardware, const AxisConfig& axis, double heartbeat_budget) {
  canopen::NodeSetup setup = commonSetup(hardware, axis, axis.node, axis.identity, kDriveProfile, heartbeat_budget,
                                         axis.watch, bit(Protection::kHeartbeatWatch));
  setup.name = axis.name;
  setup.minimum = leastProtections(axis.accepted);
  std::uint32_t modes = 1u << (static_cast<int>(axis.mode) - 1);
  std::string names(name(axis.mode));
  if (axis.reference == PositionReference::kHoming) {
    modes |= 1u << (static_cast<int>(DriveMode::kHoming) - 1);
    names += ", " + std::string(name(DriveMode::kHoming));
  }
  appendWrites(setup.steps, axis.sdo);
  setup.steps.push_back(
      optional(canopen::checkBits({0x6502, 0}, modes, modes, 4, "supported modes, among them " + names)));
  appendUnits(setup.steps, axis.units);
  appendFactors(setup.steps);
  appendReactions(setup.steps, axis);
  if (axis.brake)
    appendBrake(setup.steps, *axis.brake);
  appendWindows(setup.steps, axis);
  if (axis.mode == DriveMode::kProfileVelocity)
    appendProfile(setup.steps, axis);
  else
    appendInterpolation(setup.steps, hardware.period);
  if (axis.reference == PositionReference::kHoming)
    appendHoming(setup.steps, axis);
  if (axis.reference == PositionReference::kHardStop)  // written for the run, and afterwards as it was
    setup.steps.push_back(canopen::read(objects::kMaxTorque, 2, "maximum torque"));
  PdoConfig command;
  command.event_timer = milliseconds(kDeadlineShare * heartbeat_budget);  // the drive watches the cycle itself
  command.protections = bit(Protection::kCommandDeadline);
  setup.rpdos = mapped(commandObjects(axis), axis.pdo_objects, command);
  setup.tpdos = mapped(feedbackObjects(hardware, axis), axis.pdo_objects, {});
  switchOffOthers(setup.steps, PdoDirection::kReceive, 1, static_cast<int>(setup.rpdos.size()), axis.node);
  switchOffOthers(setup.steps, PdoDirection::kTransmit, 1, static_cast<int>(setup.tpdos.size()), axis.node);
  setup.last_steps.push_back(canopen::writeOnly(objects::kMode, static_cast<int>(axis.mode), 1, "mode of operation"));
  setup.last_steps.push_back(awaitMode(axis.mode));
  return setup;
}

StatedFactors statedFactors(const canopen::Node& drive) noexcept {
  return factorsFrom([&drive](const canopen::ObjectAddress& object) {
    const std::uint64_t* value = drive.readValue(object);
    return value == nullptr ? 0 : *value;
  });
}

canopen::NodeSetup encoderSetup(const HardwareConfig& hardware, const AxisConfig& axis, double heartbeat_budget) {
  const EncoderConfig& encoder = *axis.encoder;
  canopen::NodeSetup setup = commonSetup(hardware, axis, encoder.node, encoder.identity, kEncoderProfile,
                                         heartbeat_budget, MutualWatch::kHeartbeat, 0);
  setup.name = axis.name + " encoder";
  setup.steps.push_back(canopen::checkBits({0x6503, 0}, 0, 1, 2, "position alarm"));
  // TPDO 1 of an encoder runs by its own timer, TPDO 2 by SYNC.
  constexpr int kSynchronous = 2;
  switchOffOthers(setup.steps, PdoDirection::kTransmit, kSynchronous, kSynchronous, encoder.node);
  PdoConfig feedback;
  feedback.number = kSynchronous;
  feedback.layout.add({{0x6004, 0}, 32});
  feedback.layout.add({{0x6503, 0}, 16});
  setup.tpdos.push_back(feedback);
  return setup;
}

}  // namespace tandem::hal
