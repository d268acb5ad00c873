// SPDX-License-Identifier: Apache-2.0
#include "sim/simulated_arm.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::sim {
namespace {

constexpr std::array<std::string_view, 6> kFaultNames{"none", "off", "stuck", "garbage", "invalid", "runaway"};

constexpr double kRunawaySpeed = 0.01;  // m/s or rad/s: half the speed of a runaway joint without a limit

/// The drive itself reports the fault.
bool reported(AxisFault fault) {
  return fault == AxisFault::kOff || fault == AxisFault::kGarbage || fault == AxisFault::kInvalid;
}

}  // namespace

std::string_view name(AxisFault fault) {
  const auto index = static_cast<std::size_t>(fault);
  return index < kFaultNames.size() ? kFaultNames[index] : "unknown";
}

std::optional<AxisFault> axisFaultFromName(std::string_view name) {
  for (std::size_t i = 0; i < kFaultNames.size(); ++i) {
    if (kFaultNames[i] == name)
      return static_cast<AxisFault>(i);
  }
  return std::nullopt;
}

SimulatedArm::SimulatedArm(const safety::ArmVector& position, const PlantLimits& limits, const JointOptions& options)
    : limits_(limits),
      options_(options),
      actuation_(options.mechanics, options.kinds, options.shortest_step),
      random_(options.seed, Noise::kEncoder, options.arm) {
  place(position);
}

void SimulatedArm::place(const safety::ArmVector& position) noexcept {
  position_ = tubes_ = position;
  velocity_.setZero(position.size());
  actuation_.place(position);
  random_.restart();
  readEncoders();
}

void SimulatedArm::readEncoders() noexcept {
  encoders_ = position_;
  const int n = static_cast<int>(position_.size());
  const EncoderOptions& encoders = options_.encoders;
  for (int j = 0; j < n && !encoders.noise.isZero(); ++j)
    encoders_[j] += encoders.noise.of(options_.kinds[j]) * random_.normal();
  for (int j = 0; j < n; ++j)
    encoders_[j] = quantised(encoders_[j], encoders.resolution.of(options_.kinds[j]));
}

/// Speed over the next step: towards the reference, and low enough that the joint can stop there.
double SimulatedArm::nextVelocity(int joint, double dt, double error) const noexcept {
  const double acceleration = limits_.acceleration[joint];
  const double change = acceleration * dt;
  double speed = std::min(std::abs(error) / dt, limits_.velocity[joint]);
  if (std::isfinite(change) && speed > change) {
    // Largest v with v dt + v^2 / (2 a) <= |error|.
    const double stoppable = std::sqrt(change * change + 2.0 * acceleration * std::abs(error)) - change;
    speed = std::min(speed, std::max(stoppable, change));
  }
  return std::clamp(std::copysign(speed, error), velocity_[joint] - change, velocity_[joint] + change);
}

void SimulatedArm::step(double dt, const safety::ArmVector& reference) noexcept {
  actuation_.step(dt, reference);
  const safety::ArmVector& target = actuation_.output();
  const int n = static_cast<int>(position_.size());
  for (Eigen::Index j = 0; j < n; ++j) {
    const int joint = static_cast<int>(j);
    if (faults_[joint] == AxisFault::kOff || faults_[joint] == AxisFault::kStuck) {
      velocity_[j] = 0.0;
      continue;
    }
    if (faults_[joint] == AxisFault::kRunaway) {
      const double speed = std::isfinite(limits_.velocity[joint]) ? limits_.velocity[joint] : kRunawaySpeed;
      velocity_[j] = powered_ ? 2.0 * speed : 0.0;
      position_[j] += velocity_[j] * dt;
      tubes_[j] = withBacklash(tubes_[j], position_[j], options_.mechanics.backlash.of(options_.kinds[joint]));
      continue;
    }
    const double error = target[j] - position_[j];
    const double direct = error / dt;
    velocity_[j] = nextVelocity(joint, dt, error);
    // Set to the reference itself; a sum would differ by rounding.
    position_[j] = velocity_[j] == direct ? target[j] : position_[j] + velocity_[j] * dt;
    tubes_[j] = withBacklash(tubes_[j], position_[j], options_.mechanics.backlash.of(options_.kinds[joint]));
  }
  readEncoders();
}

safety::ArmVector SimulatedArm::withGarbage(const safety::ArmVector& values) const noexcept {
  safety::ArmVector result = values;
  for (Eigen::Index j = 0; j < values.size(); ++j) {
    if (faults_[static_cast<std::size_t>(j)] == AxisFault::kGarbage) {
      result[j] = std::numeric_limits<double>::quiet_NaN();
    }
  }
  return result;
}

safety::ArmVector SimulatedArm::reading() const noexcept { return withGarbage(encoders_); }
safety::ArmVector SimulatedArm::velocityReading() const noexcept { return withGarbage(velocity_); }

bool SimulatedArm::valid(safety::JointMask without) const noexcept {
  return (presentFailure(without).faults & safety::bit(safety::Fault::kSensor)) == 0;
}

safety::JointMask SimulatedArm::failed() const noexcept {
  safety::JointMask mask = 0;
  for (int j = 0; j < static_cast<int>(position_.size()); ++j)
    mask |= reported(faults_[static_cast<std::size_t>(j)]) ? safety::jointBit(j) : safety::JointMask{0};
  return mask;
}

safety::FaultRecord SimulatedArm::presentFailure(safety::JointMask without) const noexcept {
  safety::FaultRecord present;
  for (Eigen::Index j = 0; j < position_.size(); ++j) {
    const AxisFault fault = faults_[static_cast<std::size_t>(j)];
    if (!reported(fault) || (without & safety::jointBit(static_cast<int>(j))) != 0)
      continue;
    if (present.faults == 0) {
      present.joint = static_cast<std::uint8_t>(j);
      present.cause = fault == AxisFault::kOff ? safety::FaultCause::kOff : safety::FaultCause::kUnspecified;
    }
    present.faults |= safety::bit(fault == AxisFault::kOff ? safety::Fault::kDrive : safety::Fault::kSensor);
  }
  return present;
}

}  // namespace tandem::sim
