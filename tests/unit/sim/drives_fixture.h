// SPDX-License-Identifier: Apache-2.0
/** @file Test fixture: simulated drives of two arms with a correct command stream, in simulated time. */
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "sim/simulated_drives.h"

namespace tandem::test {

using safety::ArmLimits;
using safety::ArmVector;
using safety::DriveRequest;
using safety::Fault;
using safety::OperatingState;

inline constexpr double kPeriod = 0.1;   ///< of control, s
inline constexpr double kTick = 1e-3;    ///< of the simulation, s
inline constexpr double kSpeed = 0.010;  ///< largest speed of a translation, m/s
inline constexpr double kDeceleration = 0.1;
inline constexpr double kStopTime = kSpeed / kDeceleration;  ///< budget of a stop from full speed, s

/// Two tubes with 5 mm between the carriages; rotations up to 1 rad/s, which stop in 0.05 s.
inline ArmLimits fixtureLimits() {
  safety::TubeLimitSpec spec;
  spec.tube_length = {0.4, 0.2};
  spec.carriage_spacing = {0.005};
  spec.minimum_extension = {0.005};
  spec.stage_minimum = {-0.3, -0.2};
  spec.stage_maximum = {0.0, 0.0};
  spec.translation.velocity = kSpeed;
  spec.translation.stop_deceleration = kDeceleration;
  spec.translation.max_step = 0.05;
  spec.rotation.velocity = 1.0;
  spec.rotation.stop_deceleration = 20.0;
  return safety::makeTubeLimits(spec);
}

inline ArmVector fixtureStart() {
  ArmVector q(4);
  q << -0.150, -0.100, 0.2, -0.3;
  return q;
}

/** Two arms and a command source with a clock of its own. */
class DrivesFixture : public ::testing::Test {
 public:
  explicit DrivesFixture(bool lock_step = false)
      : drives({fixtureLimits(), fixtureLimits()}, {fixtureStart(), fixtureStart()}, options(lock_step)) {}

  static sim::SimulatedDrivesOptions options(bool lock_step) {
    sim::SimulatedDrivesOptions made;
    made.control_period = kPeriod;
    made.lock_step = lock_step;
    return made;
  }

  /// A fresh command without motion.
  sim::Command nextCommand() {
    sim::Command command;
    command.header = {session, ++sequence, 0.01, 2};
    return command;
  }

  bool request(DriveRequest what) {
    sim::Command command = nextCommand();
    command.request.fill(what);
    command.request[2] = DriveRequest::kKeep;
    return drives.command(command, now);
  }

  /// Command that moves both arms from their setpoints with these velocities for one period.
  sim::Command moveCommand(const ArmVector& speed) {
    sim::Command command = nextCommand();
    for (int arm = 0; arm < 2; ++arm) {
      command.moving[arm] = true;
      for (int j = 0; j < 4; ++j) {
        command.velocity[arm * safety::kMaxJointsPerArm + j] = speed[j];
        command.position[arm * safety::kMaxJointsPerArm + j] = drives.setpoint(arm)[j] + speed[j] * kPeriod;
      }
    }
    return command;
  }
  bool move(const ArmVector& speed) { return drives.command(moveCommand(speed), now); }

  void tick() {
    now += static_cast<std::int64_t>(kTick * 1e9);
    drives.step(kTick, now);
  }
  void run(double seconds) {
    for (long i = std::lround(seconds / kTick); i > 0; --i)
      tick();
  }

  /// Time until the standstill of all arms, s; fails after `budget` plus two ticks.
  double timeToStand(double budget) {
    double time = 0.0;
    while (!drives.standing()) {
      tick();
      time += kTick;
      if (time > budget + 2.5 * kTick) {
        ADD_FAILURE() << "still moving after " << time << " s";
        break;
      }
    }
    return time;
  }

  /// Enables and brings both arms to full speed, in the middle of a segment.
  void bringToSpeed() {
    request(DriveRequest::kEnable);
    for (int i = 0; i < 3; ++i) {
      move(fullSpeed());
      run(kPeriod);
    }
    move(fullSpeed());
    run(0.5 * kPeriod);
    ASSERT_FALSE(drives.standing(0) || drives.standing(1));
  }

  static ArmVector fullSpeed() {
    ArmVector v(4);
    v << -kSpeed, -kSpeed, 1.0, 0.5;
    return v;
  }

  void expectFault(safety::FaultMask faults) {
    for (int arm = 0; arm < 2; ++arm) {
      EXPECT_EQ(drives.state(arm), OperatingState::kFault);
      EXPECT_EQ(drives.faults(arm), faults) << safety::describeFaults(drives.faults(arm));
    }
  }

  /// Runs for a while with motion commands and expects no motion.
  void expectNothingMoves() {
    const ArmVector a = drives.plant(0).position();
    const ArmVector b = drives.plant(1).position();
    for (int i = 0; i < 3; ++i) {
      move(fullSpeed());
      run(kPeriod);
      EXPECT_EQ(drives.plant(0).position(), a);
      EXPECT_EQ(drives.plant(1).position(), b);
    }
  }

  sim::SimulatedDrives drives;
  std::uint64_t session = 42;
  std::uint64_t sequence = 0;
  std::int64_t now = 5'000'000'000;
};

}  // namespace tandem::test
