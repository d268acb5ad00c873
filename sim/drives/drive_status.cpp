// SPDX-License-Identifier: Apache-2.0
/** @file Status objects of the simulated drive. */
#include <algorithm>
#include <cmath>

#include "sim/drives/drive.h"

namespace tandem::sim::drives {
namespace {

namespace error_code = hal::canopen::error_code;

std::int32_t round32(double value) noexcept {
  constexpr double kMost = 2147483647.0;
  return static_cast<std::int32_t>(std::llround(std::clamp(value, -kMost - 1.0, kMost)));
}

}  // namespace

std::int32_t SensorFaults::distort(double value, std::int32_t& held, std::mt19937& random) const noexcept {
  if (garbage)
    return static_cast<std::int32_t>(random());
  if (!frozen)
    held = round32(value + offset);
  return held;
}

double Drive::temperatureLimit() const noexcept {
  constexpr double kOfOthers = 110.0;
  return temperature_limit_ == nullptr ? kOfOthers : static_cast<double>(temperature_limit_->value);
}

void Drive::refresh() noexcept {
  actual_.value = sensor.distort(position(), held_reading_, random_);
  load_actual_.value = load_.wrapped(round32(load_.position()));
  demand_value_.value = round32(demand_);
  velocity_actual_.value = round32(motor_.velocity() / spec_.velocity_unit);
  following_.value = round32(demand_ - position());
  torque_.value = std::clamp<std::int64_t>(std::llround(motor_.torque()), -32768, 32767);
  current_.value = std::clamp<std::int64_t>(std::llround(motor_.current()), -32768, 32767);
  if (temperature_ != nullptr && temperature_->size() > 0)
    temperature_->value = std::llround(motor_.temperature() / spec_.temperature_scale);
  inputs_.value = (spec_.switches.negativeAt(motor_.position()) ? 1 : 0) |
                  (spec_.switches.positiveAt(motor_.position()) ? 2 : 0) |
                  (spec_.switches.homeAt(motor_.position()) ? 4 : 0) | (emergency_stop ? 0 : 1 << kEmergencyInput);
  statusword_.value = statusword();
}

std::uint16_t Drive::statusword() const noexcept {
  constexpr std::uint16_t kStates[] = {0x00, 0x40, 0x21, 0x23, 0x27, 0x07, 0x0F, 0x08};
  std::uint16_t word = kStates[static_cast<std::size_t>(state_)];
  word |= 0x0200;                            // remote
  word |= emergency_stop ? 0x4000 : 0x0010;  // STO, voltage enabled
  const double margin = temperatureLimit() - motor_.temperature();
  if (margin < 15.0)
    word |= 0x0080;
  if (limited_)
    word |= 0x0800;
  return static_cast<std::uint16_t>(word | modeBits());
}

std::uint16_t Drive::modeBits() const noexcept {
  constexpr std::uint16_t kReached = 0x0400, kBit12 = 0x1000, kBit13 = 0x2000;
  const bool enabled = state_ == DriveState::kEnabled;
  const bool error = error_time_ > 0.0 || error_code_.value == error_code::kFollowingError;
  const bool standing = std::abs(motor_.velocity()) < 1.0;
  switch (mode()) {
    case kCyclicPosition:
    case kCyclicVelocity:
      return static_cast<std::uint16_t>((enabled && !brake_.active && !halted_ ? kBit12 : 0) | (error ? kBit13 : 0));
    case kProfilePosition: {
      const double window = 1e-3 * static_cast<double>(valueOf(0x6068));
      const bool reached = halted_ ? standing : reached_time_ >= window && !next_target_;
      return static_cast<std::uint16_t>((reached ? kReached : 0) | (acknowledged_ ? kBit12 : 0) | (error ? kBit13 : 0));
    }
    case kProfileVelocity: {
      const bool reached =
          std::abs(demand_velocity_ - spec_.velocity_unit * static_cast<double>(valueOf(0x60FF))) < 1.0;
      return static_cast<std::uint16_t>((enabled && reached ? kReached : 0) | (standing ? kBit12 : 0));
    }
    case kHomingMode:
      if (search_.state() == HomingSearch::State::kDone)
        return static_cast<std::uint16_t>(kBit12 | (standing ? kReached : 0));
      if (search_.state() == HomingSearch::State::kError)
        return static_cast<std::uint16_t>(kBit13 | (standing ? kReached : 0));
      return search_.state() == HomingSearch::State::kIdle || halted_ || !enabled ? kReached : std::uint16_t{0};
    default:
      return 0;
  }
}

std::int64_t Drive::valueOf(std::uint16_t index) const noexcept {
  const Entry* entry = dictionary().find({index, 0});
  return entry == nullptr ? 0 : entry->value;
}

}  // namespace tandem::sim::drives
