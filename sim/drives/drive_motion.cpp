// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "sim/drives/drive.h"

namespace tandem::sim::drives {
namespace {

constexpr std::uint16_t kHalt = 0x0100, kImmediately = 0x20, kRelative = 0x40;

double number(const Entry& entry) noexcept { return static_cast<double>(entry.value); }

}  // namespace

double Drive::velocityOf(std::uint16_t index, std::uint8_t sub) noexcept {
  return spec_.velocity_unit * number(dictionary().require(index, sub));
}

/// The smaller of 607F and 6080, which is in rpm; those that the drive lacks limit nothing.
double Drive::fastest() noexcept {
  double most = spec_.motor.max_velocity;
  if (dictionary().hasIndex(0x607F))
    most = std::min(most, velocityOf(0x607F));
  if (dictionary().hasIndex(0x6080))
    most = std::min(most, number(dictionary().require(0x6080)) / 60.0 * countsPerRevolution());
  return most;
}

double Drive::accelerationOf(std::uint16_t index, std::uint8_t sub) noexcept {
  return spec_.acceleration_unit * number(dictionary().require(index, sub));
}

void Drive::adoptPosition() noexcept {
  demand_ = segment_start_ = segment_end_ = profile_target_ = position();
  demand_velocity_ = 0.0;
  segment_time_ = 0.0;
}

double Drive::interpolationPeriod() const noexcept {
  const Entry* value = dictionary().find({0x60C2, 1});
  const Entry* exponent = dictionary().find({0x60C2, 2});
  return number(*value) * std::pow(10.0, number(*exponent));
}

double Drive::limited(double target) noexcept {
  const double low = number(dictionary().require(0x607D, 1)), high = number(dictionary().require(0x607D, 2));
  if (low >= high)
    return target;
  const double inside = std::clamp(target, low, high);
  limited_ = inside != target;
  if (limited_)
    ++record_.limit_hits;
  return inside;
}

void Drive::takeTarget() noexcept {
  if (state_ != DriveState::kEnabled || mode() != kCyclicPosition)
    return;
  const double target = limited(number(target_) + number(dictionary().require(0x60B0)));
  record_.max_jump = std::max(record_.max_jump, std::abs(target - demand_));
  segment_start_ = demand_;
  segment_end_ = target;
  segment_time_ = 0.0;
}

void Drive::generate(double dt) noexcept {
  if (brake_.active) {
    slowDown(brake_.deceleration, dt);
    if (demand_velocity_ == 0.0)
      endBrake();
    return;
  }
  if (state_ != DriveState::kEnabled) {
    demand_velocity_ = 0.0;  // holds
    return;
  }
  halted_ = (last_word_ & kHalt) != 0;
  if (halted_) {
    const bool slow = dictionary().require(0x605D).value == 1;
    slowDown(accelerationOf(slow ? 0x6084 : 0x6085), dt);
    segment_start_ = segment_end_ = demand_;
    return;
  }
  switch (mode()) {
    case kProfilePosition:
      profilePosition(dt);
      break;
    case kHomingMode:
      homing(dt);
      break;
    case kCyclicPosition:
      cyclicPosition(dt);
      break;
    case kProfileVelocity:
      followVelocity(accelerationOf(0x6083), accelerationOf(0x6084), dt);
      break;
    case kCyclicVelocity:
      followVelocity(accelerationOf(0x60C5), accelerationOf(0x60C5), dt);
      break;
    default:
      demand_velocity_ = 0.0;
      break;
  }
}

void Drive::slowDown(double deceleration, double dt) noexcept {
  const double loss = std::min(std::abs(demand_velocity_), deceleration * dt);
  const double before = demand_velocity_;
  demand_velocity_ -= std::copysign(loss, demand_velocity_);
  demand_ += 0.5 * (before + demand_velocity_) * dt;
  // Mechanical ends stop the demand, too.
  demand_ = std::clamp(demand_, spec_.motor.low + zero_, spec_.motor.high + zero_);
}

void Drive::endBrake() noexcept {
  // The demand is at standstill; the motor must be, too, before its power goes off.
  if (std::abs(motor_.velocity()) > 1e-3 * spec_.motor.max_velocity)
    return;
  const Brake brake = brake_;
  brake_.active = false;
  if (!brake.stay)
    enter(brake.then);
}

void Drive::cyclicPosition(double dt) noexcept {
  const double period = interpolationPeriod();
  const double distance = segment_end_ - segment_start_;
  segment_time_ = std::min(segment_time_ + dt, period);
  const double before = demand_;
  demand_ = segment_time_ >= period ? segment_end_ : segment_start_ + distance * segment_time_ / period;
  demand_velocity_ = (demand_ - before) / dt + velocityOf(0x60B1);
}

void Drive::approach(double velocity, double acceleration, double dt) noexcept {
  const double change = std::clamp(velocity - demand_velocity_, -acceleration * dt, acceleration * dt);
  demand_ += (demand_velocity_ + 0.5 * change) * dt;
  demand_velocity_ += change;
}

/// Cyclic synchronous and profile velocity: the target velocity 60FF, reached by ramps.
void Drive::followVelocity(double acceleration, double deceleration, double dt) noexcept {
  const double most = fastest();
  double velocity = velocityOf(0x60FF) + (mode() == kCyclicVelocity ? velocityOf(0x60B1) : 0.0);
  limited_ = std::abs(velocity) > most;
  velocity = std::clamp(velocity, -most, most);
  // Limits the speed so that the joint can stop before a software limit.
  const double low = number(dictionary().require(0x607D, 1)), high = number(dictionary().require(0x607D, 2));
  if (low < high) {
    const double room = std::max(0.0, velocity > 0.0 ? high - demand_ : demand_ - low);
    const double fastest = std::sqrt(2.0 * deceleration * room);
    if (std::abs(velocity) > fastest) {
      limited_ = true;
      velocity = std::copysign(fastest, velocity);
    }
  }
  const bool slower = std::abs(velocity) < std::abs(demand_velocity_) || velocity * demand_velocity_ < 0.0;
  approach(velocity, slower ? deceleration : acceleration, dt);
}

void Drive::takeSetPoint() noexcept {
  if (acknowledged_)
    return;
  const double base = (last_word_ & kRelative) != 0 ? profile_target_ : 0.0;
  const double target = limited(base + number(target_));
  acknowledged_ = true;
  const bool busy = reached_time_ == 0.0 && demand_ != profile_target_;
  if (busy && (last_word_ & kImmediately) == 0) {
    next_target_ = target;
  } else {
    profile_target_ = target;
    reached_time_ = 0.0;
  }
}

void Drive::profilePosition(double dt) noexcept {
  if (demand_ == profile_target_ && next_target_) {
    profile_target_ = *next_target_;
    next_target_.reset();
    acknowledged_ = (last_word_ & 0x10) != 0;
    reached_time_ = 0.0;
  }
  const double distance = profile_target_ - demand_;
  const double deceleration = accelerationOf(0x6084);
  const double most = std::min(velocityOf(0x6081), fastest());
  // Largest speed from which the remaining distance suffices to stop, one step ahead.
  const double rest = std::max(0.0, std::abs(distance) - 0.5 * std::abs(demand_velocity_) * dt);
  const double velocity = std::copysign(std::min(most, std::sqrt(2.0 * deceleration * rest)), distance);
  const bool slower = std::abs(velocity) < std::abs(demand_velocity_) || velocity * demand_velocity_ < 0.0;
  approach(velocity, slower ? 1.2 * deceleration : accelerationOf(0x6083), dt);
  const double left = profile_target_ - demand_;
  if (std::abs(left) <= 0.5 || (left * distance < 0.0 && std::abs(left) < 10.0 * deceleration * dt * dt)) {
    demand_ = profile_target_;
    demand_velocity_ = 0.0;
  }
  const bool inside =
      demand_ == profile_target_ && std::abs(position() - profile_target_) <= number(dictionary().require(0x6067));
  reached_time_ = inside ? reached_time_ + dt : 0.0;
}

double Drive::countsPerRevolution() noexcept {
  return number(dictionary().require(0x608F, 1)) / std::max(1.0, number(dictionary().require(0x608F, 2)));
}

/// Of those that the simulation knows, the ones that the data sheet lists (60E3); all of them if it lists none.
std::optional<HomingMethod> Drive::homingMethod(std::int64_t number) const noexcept {
  const bool to_stop = spec_.stop_number != 0 && number == spec_.stop_number;
  const std::optional<HomingMethod> method = to_stop ? spec_.stop_method : HomingMethod::ofNumber(number);
  bool listed = false;
  for (std::uint8_t sub = 1; const Entry* entry = dictionary().find({0x60E3, sub}); ++sub) {
    if (entry->value == number)
      return method;
    listed = true;
  }
  return listed ? std::nullopt : method;
}

void Drive::homing(double dt) noexcept {
  constexpr double kStall = 0.02;     // s
  constexpr double kStanding = 1e-3;  // of the largest speed
  const double acceleration = accelerationOf(0x609A);
  if (search_.state() != HomingSearch::State::kRunning) {
    // The search may have ended at its start.
    slowDown(acceleration, dt);
  } else {
    approach(search_.direction() * velocityOf(0x6099, search_.slow() ? 2 : 1), acceleration, dt);
    // A switch at a mechanical end: the demand does not run ahead of the motor.
    const bool stands = std::abs(motor_.velocity()) < kStanding * spec_.motor.max_velocity;
    homing_stall_ = stands && demand_velocity_ != 0.0 ? homing_stall_ + dt : 0.0;
    const int direction = search_.direction();
    search_.step(motor_.position(), homing_stall_ > kStall);
    if (search_.direction() != direction && (motor_.atLowEnd() || motor_.atHighEnd())) {
      demand_ = position();
      demand_velocity_ = homing_stall_ = 0.0;
    }
  }
  if (search_.state() == HomingSearch::State::kDone && !homed_)
    homed();
}

void Drive::homed() noexcept {
  const double lag = demand_ - position();
  zero_ = number(dictionary().require(0x607C)) - motor_.position();
  demand_ = position() + lag;
  profile_target_ = segment_start_ = segment_end_ = demand_;
  homed_ = true;
}

}  // namespace tandem::sim::drives
