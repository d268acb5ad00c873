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

/** A fault of one axis, injected by a test or a user. */
enum class AxisFault : std::uint8_t {
  kNone = 0,
  kOff,      ///< the drive is dead: the joint does not move, and the drive says so
  kStuck,    ///< the joint does not move, and only the following error tells
  kGarbage,  ///< the joint moves, its reading is not a number
  kInvalid,  ///< the joint moves, its reading is marked as bad
  kRunaway,  ///< as long as there is power the joint moves at twice its largest speed, whatever the command
};

/// "none", "off", "stuck", "garbage", "invalid", "runaway".
std::string_view name(AxisFault fault);
std::optional<AxisFault> axisFaultFromName(std::string_view name);

/** What the joints of a plant can do; kUnlimited = ideal. */
struct PlantLimits {
  safety::ArmVector velocity;      ///< m/s, rad/s
  safety::ArmVector acceleration;  ///< m/s^2, rad/s^2
};

/** What is not ideal about the joints of one arm. */
struct JointOptions {
  JointMechanics mechanics;
  EncoderOptions encoders;
  std::uint64_t seed = 1;
  int arm = 0;                  ///< arms have random numbers of their own
  double shortest_step = 1e-3;  ///< of step(), s
  safety::JointKinds kinds{};
};

/** Joints of one arm: reference -> delay and lag -> motor, with its encoder -> play -> tube.
 *
 * Without limits and with ideal mechanics a joint is at its reference after every step, bit for bit, so that runs in
 * lock-step repeat exactly. With limits each motor goes to its (delayed, lagged) reference on its own, as fast as it
 * can and without overshoot; joints that stay behind do so independently of each other. Noise is drawn once a step,
 * from the first number again after each place(). Nothing after construction allocates. */
class SimulatedArm {
 public:
  /// Stands at `position`, m, rad.
  SimulatedArm(const safety::ArmVector& position, const PlantLimits& limits, const JointOptions& options = {});

  /// Follows the reference for dt, s (above zero).
  void step(double dt, const safety::ArmVector& reference) noexcept;
  /// Puts the joints elsewhere, at rest, in the middle of their play.
  void place(const safety::ArmVector& position) noexcept;
  /// The motors stay where they are: what was on its way to them, or to one of them, is forgotten.
  void forget() noexcept { actuation_.place(position_); }
  void forget(int joint) noexcept { actuation_.place(joint, position_[joint]); }
  /// Sets or ends (kNone) the fault of one joint.
  void inject(int joint, AxisFault fault) noexcept { faults_[joint] = fault; }
  AxisFault fault(int joint) const noexcept { return faults_[joint]; }
  /// Whether the drives hold and move the joints.
  void setPower(bool on) noexcept { powered_ = on; }

  /// Where the motors really are, m, rad.
  const safety::ArmVector& position() const noexcept { return position_; }
  /// Where the tubes are, behind the play of the transmission, m, rad.
  const safety::ArmVector& tubes() const noexcept { return tubes_; }
  /// Where intact motors without limits would be: the reference, delayed and lagged, m, rad.
  const safety::ArmVector& expected() const noexcept { return actuation_.output(); }
  /// How fast the motors really move, averaged over the last step, m/s, rad/s.
  const safety::ArmVector& velocity() const noexcept { return velocity_; }
  /// What the encoders say, m, rad: NaN where a reading is garbage.
  safety::ArmVector reading() const noexcept;
  safety::ArmVector velocityReading() const noexcept;
  /// All readings are good.
  bool valid(safety::JointMask without = 0) const noexcept;
  bool standing() const noexcept { return velocity_.isZero(0.0) && actuation_.atRest(); }
  /// Faults that the plant reports by itself: kDrive for a dead drive, kSensor for a bad reading.
  safety::FaultMask presentFaults() const noexcept { return presentFailure().faults; }
  /// The same, with the joint of the first of them. @param without  joints that do not count
  safety::FaultRecord presentFailure(safety::JointMask without = 0) const noexcept;
  /// Joints that report a fault of theirs.
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
  safety::ArmVector encoders_;  ///< what they read in this step
  safety::ArmVector velocity_;
  std::array<AxisFault, safety::kMaxJointsPerArm> faults_{};
  bool powered_ = true;
};

}  // namespace tandem::sim
