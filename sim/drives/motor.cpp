// SPDX-License-Identifier: Apache-2.0
#include "sim/drives/motor.h"

#include <algorithm>
#include <cmath>

namespace tandem::sim::drives {
namespace {

constexpr double kPeakTorque = 2000.0;  // per mille, at max_acceleration
constexpr double kFriction = 60.0;      // per mille, at max_velocity
constexpr double kHeating = 100.0;      // K

}  // namespace

Motor::Motor(const MotorParameters& parameters, double position) noexcept
    : parameters_(parameters),
      position_(std::clamp(position, parameters.low, parameters.high)),
      temperature_(parameters.ambient) {}

void Motor::follow(double position, double velocity, double dt) noexcept {
  const double limit = parameters_.max_velocity;
  const double error = position - position_;
  const double wanted = faults.runaway != 0.0
                            ? faults.runaway * limit
                            : faults.speed * std::clamp(velocity + parameters_.position_gain * error, -limit, limit);
  const double most = parameters_.max_acceleration * std::min(1.0, most_torque_ / kPeakTorque);
  const double acceleration = std::clamp((wanted - velocity_) / parameters_.velocity_lag, -most, most);
  torque_ = kPeakTorque * acceleration / parameters_.max_acceleration + kFriction * velocity_ / limit + faults.load;
  move(acceleration, dt);
  heat(dt);
}

void Motor::coast(double dt) noexcept {
  torque_ = 0.0;
  move(parameters_.load - velocity_ / parameters_.coast_lag, dt);
  if (parameters_.load == 0.0 && std::abs(velocity_) < 1.0)
    velocity_ = 0.0;
  heat(dt);
}

void Motor::move(double acceleration, double dt) noexcept {
  const double beyond = position_ - std::clamp(position_, parameters_.low, parameters_.high);
  const double stiffness = parameters_.end_stiffness * parameters_.max_acceleration / kPeakTorque;  // 1/s^2
  const double damping = beyond == 0.0 ? 0.0 : 2.0 * std::sqrt(stiffness);                          // 1/s: critical
  velocity_ += (acceleration - stiffness * beyond - damping * velocity_) * dt;
  if (faults.blocked || (braked_ && !faults.no_brake))
    velocity_ = 0.0;
  position_ += velocity_ * dt;
  if (parameters_.end_stiffness > 0.0)
    return;
  if (position_ < parameters_.low || position_ > parameters_.high) {
    position_ = std::clamp(position_, parameters_.low, parameters_.high);
    velocity_ = 0.0;
  }
}

void Motor::heat(double dt) noexcept {
  const double load = current() / 1000.0;
  const double target = parameters_.ambient + parameters_.rated_rise * load * load;
  temperature_ += (target - temperature_) * dt / parameters_.thermal_lag;
}

double Motor::current() const noexcept { return faults.over_current ? 3.5e3 : std::abs(torque_); }

double Motor::temperature() const noexcept { return temperature_ + (faults.over_heated ? kHeating : 0.0); }

}  // namespace tandem::sim::drives
