// SPDX-License-Identifier: Apache-2.0
#include "sim/drives/drive.h"

#include <algorithm>
#include <cmath>

namespace tandem::sim::drives {
namespace {

namespace error_code = hal::canopen::error_code;

// Controlword.
constexpr std::uint16_t kQuickStopBit = 0x04, kEnableVoltage = 0x02, kStartBit = 0x10, kFaultReset = 0x80;

/** Counts/s or counts/s^2 in one unit of a drive. @param stated  object 60A9 or 60AA: power of ten, numerator and
 * denominator in the numbers of CiA 303-2; revolutions per minute (B4 47) and per second (B4 03), and accelerations in
 * rpm per second (C0 03) and revolutions per square second (B4 57). @param own  if it is absent or another unit;
 * 0: counts. */
double unitOf(const Entry* stated, double counts_per_revolution, double own) {
  const auto code = stated == nullptr ? 0u : static_cast<std::uint32_t>(stated->value);
  const double prefix = std::pow(10.0, static_cast<std::int8_t>(code >> 24));
  switch (code >> 8 & 0xFFFF) {
    case 0xB447:
    case 0xC003:
      return prefix * counts_per_revolution / 60.0;
    case 0xB403:
    case 0xB457:
      return prefix * counts_per_revolution;
    case 0xB503:
    case 0xB557:
      return prefix;
    default:
      return own == 0.0 ? 1.0 : own;
  }
}

}  // namespace

std::string_view name(DriveState state) {
  constexpr std::string_view kNames[] = {
      "not ready to switch on", "switch on disabled", "ready to switch on",    "switched on",
      "operation enabled",      "quick stop active",  "fault reaction active", "fault"};
  return kNames[static_cast<std::size_t>(state)];
}

Drive::Drive(const DriveSpec& spec, const Eds& eds)
    : Device(spec.id, eds, driveEds(), spec.serial),
      spec_(spec),
      motor_(spec.motor, spec.start),
      load_(spec.load, spec.start),
      random_(spec.id),
      controlword_(dictionary().require(0x6040)),
      statusword_(dictionary().require(0x6041)),
      error_code_(dictionary().require(0x603F)),
      mode_(dictionary().require(0x6060)),
      mode_display_(dictionary().require(0x6061)),
      target_(dictionary().require(0x607A)),
      actual_(dictionary().require(0x6064)),
      demand_value_(dictionary().require(0x6062)),
      velocity_actual_(dictionary().require(0x606C)),
      following_(dictionary().require(0x60F4)),
      load_actual_(dictionary().require(0x60E4, spec.load_input)),
      torque_(dictionary().require(0x6077)),
      current_(dictionary().require(0x6078)),
      inputs_(dictionary().require(0x60FD)),
      max_torque_(dictionary().require(0x6072)),
      temperature_(spec.temperature.index == 0 ? dictionary().own({0x2001, 0}) : dictionary().find(spec.temperature)),
      temperature_limit_(dictionary().own({0x2002, 0})) {
  for (const std::uint16_t index :
       {0x6007, 0x605A, 0x605B, 0x605C, 0x605D, 0x605E, 0x6065, 0x6066, 0x6067, 0x6068, 0x607C, 0x607F,
        0x6080, 0x6081, 0x6083, 0x6084, 0x6085, 0x6098, 0x609A, 0x60B0, 0x60B1, 0x60C5, 0x6502})
    dictionary().require(index);
  for (const std::uint16_t index : {0x607D, 0x6099, 0x60C2, 0x608F, 0x60FE})
    dictionary().require(index, 2);
  setHabits(spec.habits);
  Switches& switches = spec_.switches;
  if (switches.at_ends && !switches.negative && std::isfinite(spec.motor.low))
    switches.negative = spec.motor.low;
  if (switches.at_ends && !switches.positive && std::isfinite(spec.motor.high))
    switches.positive = spec.motor.high;
  if (spec.counts_per_revolution > 0.0 && !dictionary().hasIndex(0x608F)) {
    for (const std::uint8_t sub : {1, 2}) {
      Entry& entry = dictionary().require(0x608F, sub);
      entry.value = entry.info.value = sub == 1 ? std::llround(spec.counts_per_revolution) : 1;
    }
  }
  const double counts = countsPerRevolution();
  spec_.velocity_unit = unitOf(dictionary().visible({0x60A9, 0}), counts, spec.velocity_unit);
  spec_.acceleration_unit = unitOf(dictionary().visible({0x60AA, 0}), counts, spec.acceleration_unit);
  zero_ = spec.incremental ? -motor_.position() : 0.0;
  adoptPosition();
  mark();
}

void Drive::mark() noexcept {
  record_ = {};
  record_.lowest = record_.highest = position();
}

void Drive::resetApplication() noexcept {
  enter(DriveState::kNotReady);
  if (!powered() && spec_.incremental)
    zero_ = -motor_.position();
  brake_ = {};
  search_.reset();
  next_target_.reset();
  acknowledged_ = false;
  last_word_ = 0;
  adoptPosition();
}

bool Drive::moves() const noexcept {
  return state_ == DriveState::kEnabled || state_ == DriveState::kQuickStop || state_ == DriveState::kFaultReaction;
}

void Drive::enter(DriveState state) noexcept {
  const bool moved = moves();
  state_ = state;
  brake_.active = false;
  error_time_ = 0.0;
  if (!moves() || !moved)
    adoptPosition();
  if (state == DriveState::kEnabled) {
    halted_ = false;
    profile_target_ = demand_;
    next_target_.reset();
    if (search_.state() != HomingSearch::State::kDone)
      search_.reset();
  }
}

void Drive::written(const Entry& entry) noexcept {
  if (&entry == &controlword_) {
    onControlword(static_cast<std::uint16_t>(entry.value));
  } else if (&entry == &target_) {
    takeTarget();
  }
}

SdoAbort Drive::accept(const Entry& entry, std::int64_t value) const noexcept {
  const std::uint16_t index = entry.info.address.index;
  if (index == 0x6060) {
    const auto supported = static_cast<std::uint64_t>(dictionary().find({0x6502, 0})->value);
    const bool known = value == 0 || (value >= 1 && value <= 32 && (supported >> (value - 1) & 1) != 0);
    return known ? SdoAbort::kNone : SdoAbort::kValueRange;
  }
  if (index == 0x6098)
    return homingMethod(value) ? SdoAbort::kNone : SdoAbort::kValueRange;
  if (index == 0x605A && value == 4)
    return SdoAbort::kValueRange;
  // Parameters of stops and limits cannot change while the motor moves.
  const bool fixed = index == 0x60C2 || index == 0x607D || index == 0x608F || index == 0x607C;
  return fixed && moves() ? SdoAbort::kDeviceState : SdoAbort::kNone;
}

void Drive::onControlword(std::uint16_t word) noexcept {
  const auto rising = static_cast<std::uint16_t>(word & ~last_word_);
  last_word_ = word;
  if (state_ == DriveState::kFault) {
    if ((rising & kFaultReset) != 0)
      resetFault();
    return;
  }
  if (nmt() != NmtState::kOperational && nmt() != NmtState::kPreOperational)
    return;
  command(word);
  if (state_ != DriveState::kEnabled || brake_.active)
    return;
  if (mode() == kProfilePosition) {
    if ((rising & kStartBit) != 0)
      takeSetPoint();
    if ((word & kStartBit) == 0 && !next_target_)
      acknowledged_ = false;
  } else if (mode() == kHomingMode && (rising & kStartBit) != 0) {
    search_.start(homingMethod(dictionary().require(0x6098).value), spec_.switches, motor_.position(),
                  countsPerRevolution());
    homing_stall_ = 0.0;
    homed_ = false;
  }
}

void Drive::command(std::uint16_t word) noexcept {
  const bool voltage = (word & kEnableVoltage) != 0;
  const bool no_quick_stop = (word & kQuickStopBit) != 0;
  const bool shutdown = (word & 0x07) == 0x06, switch_on = (word & 0x0F) == 0x07, enable = (word & 0x0F) == 0x0F;
  switch (state_) {
    case DriveState::kSwitchOnDisabled:
      if (shutdown && !emergency_stop)
        enter(DriveState::kReady);
      break;
    case DriveState::kReady:
      if (!voltage || !no_quick_stop) {
        enter(DriveState::kSwitchOnDisabled);
      } else if (switch_on || enable) {
        enter(enable ? DriveState::kEnabled : DriveState::kSwitchedOn);
      }
      break;
    case DriveState::kSwitchedOn:
      if (!voltage || !no_quick_stop) {
        enter(DriveState::kSwitchOnDisabled);
      } else if (shutdown) {
        enter(DriveState::kReady);
      } else if (enable) {
        enter(DriveState::kEnabled);
      }
      break;
    case DriveState::kEnabled:
      leaveEnabled(word);
      break;
    case DriveState::kQuickStop:
      if (!voltage) {
        enter(DriveState::kSwitchOnDisabled);
      } else if (enable && dictionary().require(0x605A).value >= 5) {
        enter(DriveState::kEnabled);
      }
      break;
    default:
      break;
  }
}

void Drive::leaveEnabled(std::uint16_t word) noexcept {
  if ((word & kEnableVoltage) == 0) {
    enter(DriveState::kSwitchOnDisabled);
  } else if ((word & kQuickStopBit) == 0) {
    quickStop();
  } else if ((word & 0x0F) != 0x0F && !brake_.active) {
    const bool shutdown = (word & 0x01) == 0;
    const DriveState then = shutdown ? DriveState::kReady : DriveState::kSwitchedOn;
    if (dictionary().require(shutdown ? 0x605B : 0x605C).value == 0) {
      enter(then);
    } else {
      brakeTo(accelerationOf(0x6084), then, false);
    }
  }
}

void Drive::brakeTo(double deceleration, DriveState then, bool stay) noexcept {
  brake_ = {true, deceleration, then, stay};
  halted_ = false;
  // Starts at the motor's position, not at the demand: a stop does not correct a following error.
  demand_ = position();
  demand_velocity_ = motor_.velocity();
}

void Drive::quickStop() noexcept {
  const std::int64_t option = dictionary().require(0x605A).value;
  ++record_.quick_stops;
  stopping_ = true;
  record_.stop_begin = now();
  record_.stop_travel = record_.stop_duration = 0.0;
  if (option == 0) {
    enter(DriveState::kSwitchOnDisabled);
    return;
  }
  enter(DriveState::kQuickStop);
  const bool slow = option == 1 || option == 5;
  const bool full_current = option == 3 || option == 7 || option == 8;
  const double deceleration = full_current ? spec_.motor.max_acceleration : accelerationOf(slow ? 0x6084 : 0x6085);
  brakeTo(deceleration, DriveState::kSwitchOnDisabled, option >= 5);
}

void Drive::contactLost() noexcept {
  ++record_.contact_losses;
  const std::int64_t option = dictionary().require(0x6007).value;
  if (option == 0 || state_ == DriveState::kFault || state_ == DriveState::kFaultReaction)
    return;
  if (option == 1) {
    if (state_ == DriveState::kEnabled)
      fail(lastError() == 0 ? error_code::kHeartbeat : lastError(), ErrorBit::kCommunication);
  } else if (state_ == DriveState::kEnabled && option == 3) {
    quickStop();
  } else if (state_ != DriveState::kQuickStop && state_ != DriveState::kNotReady) {
    enter(DriveState::kSwitchOnDisabled);
  }
}

void Drive::fail(std::uint16_t code, ErrorBit bit) noexcept {
  if (state_ == DriveState::kFault || state_ == DriveState::kFaultReaction)
    return;
  raise(code, bit);
  error_code_.value = code;
  ++record_.faults;
  const std::int64_t option = dictionary().require(0x605E).value;
  // Without a position, or with a short circuit, the drive cannot brake.
  const bool coast = option == 0 || code == error_code::kEncoder || code == error_code::kOverCurrent;
  if (moves()) {
    stopping_ = true;
    record_.stop_begin = now();
    record_.stop_travel = record_.stop_duration = 0.0;
  }
  if (!moves() || coast) {
    enter(DriveState::kFault);
    return;
  }
  enter(DriveState::kFaultReaction);
  brakeTo(accelerationOf(option == 1 ? 0x6084 : 0x6085), DriveState::kFault, false);
}

bool Drive::causePersists() const noexcept {
  return sensor.alarm || motor_.faults.over_current || motor_.temperature() > temperatureLimit();
}

void Drive::resetFault() noexcept {
  if (causePersists())
    return;
  error_code_.value = 0;
  for (const ErrorBit bit : {ErrorBit::kCurrent, ErrorBit::kVoltage, ErrorBit::kTemperature, ErrorBit::kCommunication,
                             ErrorBit::kProfile, ErrorBit::kGeneric})
    clear(bit);
  enter(DriveState::kSwitchOnDisabled);
}

void Drive::step(double dt) noexcept {
  const double before = motor_.position();
  // At the end of the step before, in which the deadline of the command PDO was checked.
  if (state_ == DriveState::kEnabled)
    record_.longest_silence = std::max(record_.longest_silence, commandSilence() - dt);
  if (state_ == DriveState::kNotReady && powered() && nmt() != NmtState::kBootUp)
    enter(DriveState::kSwitchOnDisabled);
  if (emergency_stop && state_ != DriveState::kNotReady && state_ != DriveState::kSwitchOnDisabled &&
      state_ != DriveState::kFault)
    enter(state_ == DriveState::kFaultReaction ? DriveState::kFault : DriveState::kSwitchOnDisabled);
  if (mode_display_.value != mode_.value && (!habits().late_mode_display || state_ == DriveState::kEnabled)) {
    mode_display_.value = mode_.value;
    profile_target_ = demand_;
    demand_velocity_ = moves() ? demand_velocity_ : 0.0;
    segment_start_ = segment_end_ = demand_;
    next_target_.reset();
    acknowledged_ = false;
  }
  if (spec_.brake)
    moveBrake(dt);
  if (moves() && powered()) {
    generate(dt);
    if (moves()) {
      motor_.limitTorque(static_cast<double>(max_torque_.value));
      motor_.follow(demand_ - zero_, demand_velocity_, dt);
    } else {
      motor_.coast(dt);
    }
  } else {
    motor_.coast(dt);
    adoptPosition();
  }
  load_.follow(motor_.position());
  note(dt, before);
  if (powered() && state_ != DriveState::kNotReady)
    monitor(dt);
}

/// Without current in its coil the brake closes by its spring.
void Drive::moveBrake(double dt) noexcept {
  const auto level = [this](int sub) { return static_cast<std::uint32_t>(dictionary().require(0x60FE, sub).value); };
  const BrakeSpec& brake = *spec_.brake;
  const bool high = powered() && (level(1) & level(2) & brake.mask) != 0;
  const double change = dt / brake.time;
  braked_ = std::clamp(braked_ + (high == brake.closed_level ? change : -change), 0.0, 1.0);
  motor_.setBrake(braked_ >= 1.0);
}

void Drive::note(double dt, double before) noexcept {
  const double distance = std::abs(motor_.position() - before);
  record_.travel += distance;
  record_.lowest = std::min(record_.lowest, position());
  record_.highest = std::max(record_.highest, position());
  record_.peak_velocity = std::max(record_.peak_velocity, std::abs(motor_.velocity()));
  if (stopping_) {
    record_.stop_travel += distance;
    if (std::abs(motor_.velocity()) < 1e-3 * spec_.motor.max_velocity) {
      stopping_ = false;
    } else {
      record_.stop_duration += dt;
    }
  }
}

void Drive::monitor(double dt) noexcept {
  if (sensor.alarm)
    fail(error_code::kEncoder, ErrorBit::kProfile);
  if (motor_.faults.over_current && moves())
    fail(error_code::kOverCurrent, ErrorBit::kCurrent);
  if (motor_.temperature() > temperatureLimit())
    fail(error_code::kDriveTemperature, ErrorBit::kTemperature);
  if (state_ != DriveState::kEnabled)
    return;
  const double error = std::abs(demand_ - position());
  record_.max_following_error = std::max(record_.max_following_error, error);
  const auto window = static_cast<std::uint32_t>(dictionary().require(0x6065).value);
  if (!dictionary().hasIndex(0x6065) || window == 0xFFFFFFFF || error <= window) {
    error_time_ = 0.0;
    return;
  }
  error_time_ += dt;
  if (error_time_ > 1e-3 * static_cast<double>(dictionary().require(0x6066).value))
    fail(error_code::kFollowingError, ErrorBit::kProfile);
}

}  // namespace tandem::sim::drives
