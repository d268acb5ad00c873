// SPDX-License-Identifier: Apache-2.0
/** @file Plant of one arm: joints that follow a reference, with injectable faults. */
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "safety/faults.h"
#include "safety/limits.h"
#include "safety/recovery.h"
#include "sim/actuation.h"
#include "sim/random_stream.h"

namespace tandem::sim {

/** Fault of one axis, injected by a test or a user. */
enum class AxisFault : std::uint8_t {
  kNone = 0,
  kOff,      ///< the drive has no power: the joint does not move, and the drive reports a fault
  kStuck,    ///< the joint does not move; visible only in the following error
  kGarbage,  ///< the joint moves, its reading is not a number
  kInvalid,  ///< the joint moves, its reading is marked invalid
  kRunaway,  ///< while there is power, the joint moves at twice its largest speed, whatever the command
};

/// "none", "off", "stuck", "garbage", "invalid", "runaway".
std::string_view name(AxisFault fault);
std::optional<AxisFault> axisFaultFromName(std::string_view name);

/** Limits of the joints of a plant; kUnlimited = ideal. */
struct PlantLimits {
  safety::ArmVector velocity;      ///< m/s, rad/s
  safety::ArmVector acceleration;  ///< m/s^2, rad/s^2
};

/** Imperfections of the joints of one arm. */
struct JointOptions {
  JointMechanics mechanics;
  EncoderOptions encoders;
  std::uint64_t seed = 1;
  int arm = 0;                  ///< each arm has its own random numbers
  double shortest_step = 1e-3;  ///< shortest dt of step(), s
  safety::JointKinds kinds{};
};

/** Joints of one arm: reference -> delay and lag -> motor, with its encoder -> backlash -> tube.
 *
 * Without limits and with ideal mechanics a joint is at its reference after every step, bit for bit, so that runs in
 * lock-step repeat exactly. With limits each motor moves to its (delayed, lagged) reference as fast as it can and
 * without overshoot; joints lag behind independently of each other. Noise is drawn once per step, from the start of its
 * stream after each place(). Nothing after construction allocates. */
class SimulatedArm {
 public:
  /// Starts at standstill at `position`, m, rad.
  SimulatedArm(const safety::ArmVector& position, const PlantLimits& limits, const JointOptions& options = {});

  /// Follows the reference for dt > 0, s.
  void step(double dt, const safety::ArmVector& reference) noexcept;
  /// Resets the joints: at standstill, in the middle of their backlash.
  void place(const safety::ArmVector& position) noexcept;
  /// The motors keep their positions; clears the delay and lag of all joints, or of one.
  void forget() noexcept { actuation_.place(position_); }
  void forget(int joint) noexcept { actuation_.place(joint, position_[joint]); }
  /// Sets or ends (kNone) the fault of one joint.
  void inject(int joint, AxisFault fault) noexcept { faults_[joint] = fault; }
  AxisFault fault(int joint) const noexcept { return faults_[joint]; }
  /// Drive power: the drives hold and move the joints.
  void setPower(bool on) noexcept { powered_ = on; }

  /// True positions of the motors, m, rad.
  const safety::ArmVector& position() const noexcept { return position_; }
  /// Positions of the tubes, after the backlash of the transmission, m, rad.
  const safety::ArmVector& tubes() const noexcept { return tubes_; }
  /// Positions of motors without faults and limits: the reference, delayed and lagged, m, rad.
  const safety::ArmVector& expected() const noexcept { return actuation_.output(); }
  /// True velocities of the motors, averaged over the last step, m/s, rad/s.
  const safety::ArmVector& velocity() const noexcept { return velocity_; }
  /// Encoder readings, m, rad: NaN for kGarbage.
  safety::ArmVector reading() const noexcept;
  safety::ArmVector velocityReading() const noexcept;
  /// All readings are valid.
  bool valid(safety::JointMask without = 0) const noexcept;
  bool standing() const noexcept { return velocity_.isZero(0.0) && actuation_.atStandstill(); }
  /// Faults that the plant itself reports: kDrive for a drive without power, kSensor for an invalid reading.
  safety::FaultMask presentFaults() const noexcept { return presentFailure().faults; }
  /// The same, with the joint of the first of them. @param without joints that do not count
  safety::FaultRecord presentFailure(safety::JointMask without = 0) const noexcept;
  /// Joints that report a fault.
  safety::JointMask failed() const noexcept;

 private:
  double nextVelocity(int joint, double dt, double error) const noexcept;
  safety::ArmVector withGarbage(const safety::ArmVector& values) const noexcept;
  void readEncoders() noexcept;

  PlantLimits limits_;
  JointOptions options_;
  Actuation actuation_;
  RandomStream random_;
  safety::ArmVector position_;
  safety::ArmVector tubes_;
  safety::ArmVector encoders_;  ///< encoder readings in this step
  safety::ArmVector velocity_;
  std::array<AxisFault, safety::kMaxJointsPerArm> faults_{};
  bool powered_ = true;
};

}  // namespace tandem::sim
