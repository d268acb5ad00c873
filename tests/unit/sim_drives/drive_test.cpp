// SPDX-License-Identifier: Apache-2.0
#include "sim/drives/drive.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/safety/random_arm.h"
#include "tests/unit/support/drive_rig.h"

namespace tandem::sim::drives {
namespace {

using test::DriveRig;
using test::kActual;
using test::kControl;
using test::kMillisecond;
using test::kStatus;
using test::kTarget;

constexpr std::uint16_t kStateMask = 0x6F;

/// Moves the cyclic target with constant speed (counts/s) for `seconds`.
void ramp(DriveRig& rig, double speed, double seconds) {
  double target = static_cast<double>(rig.command().layout.getSigned(rig.command().word, kTarget));
  for (double t = 0.0; t < seconds; t += 4e-3)
    rig.cycle([&] { rig.command().set(kTarget, std::llround(target += 4e-3 * speed)); });
}

TEST(Drive, StatesFollowTheControlword) {
  DriveRig rig(1);
  ASSERT_TRUE(rig.bringUp());
  const auto send = [&](std::uint16_t word) {
    rig.command().set(kControl, word);
    rig.run(0.02);
    return rig.status() & kStateMask;
  };
  rig.run(0.02);
  EXPECT_EQ(rig.status() & 0x4F, 0x40) << "switch on disabled";
  EXPECT_EQ(send(0x0F) & 0x4F, 0x40) << "no short cut";
  EXPECT_EQ(send(0x06), 0x21);
  EXPECT_EQ(send(0x07), 0x23);
  EXPECT_EQ(send(0x06), 0x21);
  EXPECT_EQ(send(0x07), 0x23);
  EXPECT_EQ(send(0x0F), 0x27);
  EXPECT_EQ(rig.status() & 0x1000, 0x1000) << "follows the target";
  EXPECT_EQ(send(0x07), 0x23) << "disable operation";
  EXPECT_EQ(rig.status() & 0x1000, 0);
  EXPECT_EQ(send(0x0F), 0x27);
  EXPECT_EQ(send(0x00) & 0x4F, 0x40) << "disable voltage";
  EXPECT_EQ(send(0x06), 0x21);
  EXPECT_EQ(send(0x02) & 0x4F, 0x40) << "quick stop without motion";
}

TEST(Drive, EnablingDoesNotMove) {
  auto spec = test::rigSpec(1);
  spec.drives[0].start = 123456.0;
  DriveRig rig(spec);
  rig.network.addNode(test::driveSetup(1));
  ASSERT_TRUE(rig.ready());
  rig.run(0.5);
  EXPECT_EQ(rig.drive().record().travel, 0.0);
  EXPECT_EQ(rig.drive().record().max_jump, 0.0);
  EXPECT_EQ(rig.feedback().getSigned(kActual), 123456);
}

TEST(Drive, FollowsCyclicSetpointsWithinItsWindow) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 5; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    DriveRig rig(1);
    ASSERT_TRUE(rig.ready());
    // A sum of sines: 200 000 counts/s at most, like an axis of 10 mm/s.
    const double a = random.uniform(1e3, 30e3), f = random.uniform(0.2, 1.0), b = random.uniform(100, 2e3);
    double t = 0.0, worst = 0.0, before = 0.0;
    for (int k = 0; k < 500; ++k) {
      t += 4e-3;
      const double target =
          a * (1.0 - std::cos(2.0 * M_PI * f * t)) + b * std::sin(2.0 * M_PI * 3.0 * f * t) * std::min(1.0, t);
      rig.cycle([&] { rig.command().set(kTarget, std::llround(target)); });
      // The drive reaches a target one period after it received it.
      worst = std::max(worst, std::abs(rig.drive().position() - before));
      before = target;
    }
    EXPECT_EQ(rig.status() & kStateMask, 0x27);
    EXPECT_LT(rig.drive().record().max_following_error, 300.0) << "window 2000";
    EXPECT_LT(worst, 1500.0);
    EXPECT_EQ(rig.drive().record().faults, 0u);
    rig.run(0.2);
    EXPECT_NEAR(rig.drive().position(), before, 1.0);
  }
}

TEST(Drive, MovesTheSameWhenItsProcessIsLate) {
  DriveRecord records[2];
  double positions[2];
  for (const bool late : {false, true}) {
    DriveRig rig(1);
    ASSERT_TRUE(rig.ready());
    for (int k = 0; k < 10; ++k) {
      rig.stalled = late;
      ramp(rig, 200e3, 0.08);  // longer than the deadline of the command PDO
      rig.stalled = false;
      ramp(rig, 200e3, 0.02);
    }
    EXPECT_EQ(rig.drive().counters().rpdo_timeouts, 0u);
    records[late] = rig.drive().record();
    positions[late] = rig.drive().position();
  }
  EXPECT_EQ(positions[1], positions[0]);
  EXPECT_EQ(records[1].max_jump, records[0].max_jump);
  EXPECT_EQ(records[1].peak_velocity, records[0].peak_velocity);
}

TEST(Drive, QuickStopKeepsItsDeceleration) {
  for (const std::int64_t deceleration : {500'000, 2'000'000}) {
    DriveRig rig(1);
    ASSERT_TRUE(rig.ready());
    ASSERT_EQ(rig.write(0, {0x6085, 0}, deceleration, 4), hal::canopen::SdoAbort::kNone);
    constexpr double kSpeed = 200e3;
    ramp(rig, kSpeed, 0.3);
    ASSERT_NEAR(rig.drive().motor().velocity(), kSpeed, 0.02 * kSpeed);
    rig.command().set(kControl, 0x02);
    rig.run(0.004);
    EXPECT_EQ(rig.status() & kStateMask, 0x07) << "quick stop active";
    rig.run(1.0);
    EXPECT_EQ(rig.status() & 0x4F, 0x40) << "then switch on disabled";
    const DriveRecord& record = rig.drive().record();
    const double braking = kSpeed / static_cast<double>(deceleration);
    EXPECT_NEAR(record.stop_duration, braking, 0.15 * braking + 0.03);
    EXPECT_NEAR(record.stop_travel, 0.5 * kSpeed * braking, 0.15 * kSpeed * braking + 0.012 * kSpeed);
    EXPECT_EQ(record.quick_stops, 1u);
  }
}

TEST(Drive, StaysInQuickStopWhereItsOptionSaysSo) {
  DriveRig rig(1);
  ASSERT_TRUE(rig.ready());
  ASSERT_EQ(rig.write(0, {0x605A, 0}, 6, 2), hal::canopen::SdoAbort::kNone);
  ramp(rig, 100e3, 0.2);
  rig.command().set(kControl, 0x02);
  rig.run(0.5);
  EXPECT_EQ(rig.status() & kStateMask, 0x07);
  EXPECT_NEAR(rig.drive().motor().velocity(), 0.0, 1.0);
  const double where = rig.drive().position();
  rig.command().set(kTarget, std::llround(where));
  rig.command().set(kControl, 0x0F);
  rig.run(0.2);
  EXPECT_EQ(rig.status() & kStateMask, 0x27);
  EXPECT_NEAR(rig.drive().position(), where, 2.0);
}

TEST(Drive, StopsByItselfWhenTheMasterDies) {
  DriveRig rig(1);
  ASSERT_TRUE(rig.ready());
  ramp(rig, 200e3, 0.2);
  rig.alive = false;
  const std::int64_t death = rig.now;
  rig.run(0.5);
  const DriveRecord& record = rig.drive().record();
  EXPECT_EQ(rig.drive().state(), DriveState::kSwitchOnDisabled);
  EXPECT_EQ(record.quick_stops, 1u);
  EXPECT_LE(record.stop_begin - death, 60 * kMillisecond) << "RPDO deadline 50 ms comes first";
  EXPECT_EQ(rig.drive().counters().rpdo_timeouts, 1u);
  EXPECT_EQ(rig.drive().counters().heartbeats_lost, 1u);
  EXPECT_EQ(rig.drive().nmt(), NmtState::kPreOperational) << "1029:1 = 0";
  EXPECT_NEAR(rig.drive().motor().velocity(), 0.0, 1.0);
}

TEST(Drive, ReactsToALostHeartbeatAlone) {
  // No RPDO deadline; each option of 6007.
  const std::pair<int, DriveState> cases[] = {{0, DriveState::kEnabled},
                                              {1, DriveState::kFault},
                                              {2, DriveState::kSwitchOnDisabled},
                                              {3, DriveState::kSwitchOnDisabled}};
  for (const auto& [option, expected] : cases) {
    SCOPED_TRACE(option);
    DriveRig rig(test::rigSpec(1));
    auto setup = test::driveSetup(1);
    setup.rpdos[0].event_timer = 0;
    for (auto& step : setup.steps) {
      if (step.object.index == 0x6007)
        step.value = static_cast<std::uint64_t>(option);
    }
    rig.network.addNode(setup);
    ASSERT_TRUE(rig.ready()) << rig.network.node(0).describeFailure();
    rig.network.setHeartbeat(false);
    const std::int64_t begin = rig.now;
    ASSERT_TRUE(rig.until([&] { return rig.drive().counters().heartbeats_lost == 1; }, 1.0));
    EXPECT_NEAR(1e-6 * static_cast<double>(rig.now - begin), 100.0, 30.0);
    rig.run(0.3);
    EXPECT_EQ(rig.drive().state(), expected) << name(rig.drive().state());
    EXPECT_EQ(rig.network.node(0).lastEmcy().code, hal::canopen::error_code::kHeartbeat);
  }
}

TEST(Drive, AnRpdoDeadlineStopsIt) {
  DriveRig rig(1);
  ASSERT_TRUE(rig.ready());
  rig.setpoints = false;  // heartbeat and SYNC continue
  const std::int64_t begin = rig.now;
  ASSERT_TRUE(rig.until([&] { return rig.drive().state() != DriveState::kEnabled; }, 1.0));
  EXPECT_NEAR(1e-6 * static_cast<double>(rig.now - begin), 50.0, 8.0);
  rig.run(0.1);
  EXPECT_EQ(rig.network.node(0).lastEmcy().code, hal::canopen::error_code::kRpdoTimeout);
  EXPECT_EQ(rig.network.node(0).phase(), hal::canopen::NodePhase::kOperational);
}

TEST(Drive, AFollowingErrorIsAFault) {
  DriveRig rig(1);
  ASSERT_TRUE(rig.ready());
  rig.command().set(kTarget, 500'000);  // a jump that no motor can follow
  ASSERT_TRUE(rig.until([&] { return (rig.status() & 0x4F) == 0x08; }, 1.0));
  EXPECT_EQ(rig.read(0, {0x603F, 0}), hal::canopen::error_code::kFollowingError);
  EXPECT_NEAR(rig.drive().record().max_jump, 500e3, 1.0);
  EXPECT_LT(rig.drive().position(), 100e3) << "it stops where it is";
  // A fault is reset by an edge, not by a level.
  EXPECT_EQ(rig.status() & 0x2000, 0x2000);
  rig.command().set(kControl, 0x8F);
  rig.run(0.02);
  EXPECT_EQ(rig.status() & 0x4F, 0x40);
  EXPECT_EQ(rig.read(0, {0x603F, 0}), 0u);
  EXPECT_EQ(rig.read(0, {0x1001, 0}), 0u);
}

TEST(Drive, AFaultResetNeedsAnEdge) {
  DriveRig rig(1);
  ASSERT_TRUE(rig.ready());
  rig.command().set(kControl, 0x8F);  // the bit is already set when the fault occurs
  rig.run(0.02);
  rig.drives.inject({FaultKind::kEncoderAlarm, 1, 0.0, 0.05});
  rig.run(0.2);
  EXPECT_EQ(rig.status() & 0x4F, 0x08) << "still in fault";
  rig.command().set(kControl, 0x00);
  rig.run(0.02);
  rig.command().set(kControl, 0x80);
  rig.run(0.02);
  EXPECT_EQ(rig.status() & 0x4F, 0x40);
}

TEST(Drive, SoftwareLimitsStopTheMotor) {
  DriveRig rig(test::rigSpec(1));
  auto setup = test::driveSetup(1);
  setup.steps.push_back(hal::canopen::write({0x607D, 1}, -1000, 4, "low"));
  setup.steps.push_back(hal::canopen::write({0x607D, 2}, 2000, 4, "high"));
  rig.network.addNode(setup);
  ASSERT_TRUE(rig.ready());
  ramp(rig, 20e3, 0.3);
  EXPECT_NEAR(rig.drive().record().highest, 2000.0, 30.0);
  EXPECT_GT(rig.drive().record().limit_hits, 0u);
  EXPECT_EQ(rig.status() & 0x0800, 0x0800) << "internal limit active";
  ramp(rig, -20e3, 0.6);
  EXPECT_NEAR(rig.drive().record().lowest, -1000.0, 30.0);
}

TEST(Drive, CyclicVelocity) {
  DriveRig rig(1, 9);
  ASSERT_TRUE(rig.ready());
  rig.command().set(kTarget, 50'000);
  rig.run(0.5);
  EXPECT_NEAR(rig.drive().motor().velocity(), 50e3, 500.0);
  EXPECT_EQ(rig.status() & 0x1000, 0x1000);
  rig.command().set(kTarget, -50'000);
  rig.run(0.5);
  EXPECT_NEAR(rig.drive().motor().velocity(), -50e3, 500.0);
  rig.command().set(kTarget, 0);
  rig.run(0.2);
  EXPECT_NEAR(rig.drive().motor().velocity(), 0.0, 10.0);
}

TEST(Drive, ProfilePositionWithItsHandshake) {
  DriveRig rig(1, 1);
  ASSERT_TRUE(rig.ready());
  constexpr std::uint16_t kAcknowledged = 0x1000, kReached = 0x0400;
  const auto command = [&](std::int32_t target, std::uint16_t bits) {
    rig.command().set(kTarget, target);
    rig.command().set(kControl, 0x0F);
    EXPECT_TRUE(rig.until([&] { return (rig.status() & kAcknowledged) == 0; }, 1.0));
    rig.command().set(kControl, static_cast<std::uint16_t>(0x1F | bits));
    EXPECT_TRUE(rig.until([&] { return (rig.status() & kAcknowledged) != 0; }, 1.0));
  };
  command(20'000, 0);
  rig.run(0.02);
  EXPECT_EQ(rig.status() & kReached, 0);
  ASSERT_TRUE(rig.until([&] { return (rig.status() & kReached) != 0; }, 3.0));
  EXPECT_NEAR(rig.drive().position(), 20e3, 20.0);
  EXPECT_LE(rig.drive().record().peak_velocity, 1.02 * 50e3) << "profile velocity";
  command(-5'000, 0x40);  // relative
  ASSERT_TRUE(rig.until([&] { return (rig.status() & kReached) == 0; }, 1.0));
  ASSERT_TRUE(rig.until([&] { return (rig.status() & kReached) != 0; }, 3.0));
  EXPECT_NEAR(rig.drive().position(), 15e3, 20.0);
  // A second set-point waits for the first one; a third is rejected until then.
  command(30'000, 0);
  rig.run(0.05);
  command(10'000, 0);
  rig.command().set(kControl, 0x0F);
  rig.run(0.05);
  EXPECT_EQ(rig.status() & kAcknowledged, kAcknowledged) << "full";
  ASSERT_TRUE(rig.until([&] { return (rig.status() & kReached) != 0; }, 5.0));
  EXPECT_NEAR(rig.drive().position(), 10e3, 20.0);
  EXPECT_NEAR(rig.drive().record().highest, 30e3, 50.0);
  EXPECT_EQ(rig.status() & kAcknowledged, 0);
}

TEST(Drive, HaltStandsAndGoesOn) {
  DriveRig rig(1, 1);
  ASSERT_TRUE(rig.ready());
  rig.command().set(kTarget, 100'000);
  rig.command().set(kControl, 0x1F);
  rig.run(0.5);
  rig.command().set(kControl, 0x11F);
  rig.run(0.5);
  const double where = rig.drive().position();
  rig.run(0.2);
  EXPECT_NEAR(rig.drive().position(), where, 1.0);
  rig.command().set(kControl, 0x1F);
  ASSERT_TRUE(rig.until([&] { return (rig.status() & 0x400) == 0; }, 1.0));
  ASSERT_TRUE(rig.until([&] { return (rig.status() & 0x400) != 0; }, 5.0));
  EXPECT_NEAR(rig.drive().position(), 100e3, 20.0);
}

TEST(Drive, HomingMethods) {
  constexpr std::uint16_t kReached = 0x0400, kAttained = 0x1000, kError = 0x2000;
  for (const int method : {17, 18, 33, 34, 35, 37}) {
    SCOPED_TRACE(method);
    auto spec = test::rigSpec(1);
    spec.drives[0].start = 5000.0;
    spec.drives[0].motor.low = -20e3;
    spec.drives[0].motor.high = 30e3;
    spec.drives[0].incremental = true;
    DriveRig rig(spec);
    auto setup = test::driveSetup(1, 6);
    setup.steps.push_back(hal::canopen::write({0x6098, 0}, method, 1, "method"));
    setup.steps.push_back(hal::canopen::write({0x607C, 0}, 1000, 4, "home offset"));
    rig.network.addNode(setup);
    ASSERT_TRUE(rig.ready());
    EXPECT_NEAR(rig.drive().position(), 0.0, 1.0) << "counts from where it was switched on";
    rig.command().set(kControl, 0x1F);
    ASSERT_TRUE(rig.until([&] { return (rig.status() & (kAttained | kReached)) == (kAttained | kReached); }, 10.0));
    EXPECT_EQ(rig.status() & kError, 0);
    const double home = rig.drive().motor().position() - (rig.drive().position() - 1000.0);
    const double expected = method == 17   ? -20e3
                            : method == 18 ? 30e3
                            : method == 33 ? 4096.0
                            : method == 34 ? 8192.0
                                           : 5000.0;
    EXPECT_NEAR(home, expected, 30.0);
  }
}

TEST(Drive, HomingWithoutASwitchIsAnError) {
  DriveRig rig(test::rigSpec(1));
  auto setup = test::driveSetup(1, 6);
  setup.steps.push_back(hal::canopen::write({0x6098, 0}, 17, 1, "method"));
  rig.network.addNode(setup);
  ASSERT_TRUE(rig.ready());
  rig.command().set(kControl, 0x1F);
  ASSERT_TRUE(rig.until([&] { return (rig.status() & 0x2000) != 0; }, 1.0));
  EXPECT_EQ(rig.status() & 0x1000, 0);
}

TEST(Drive, WhatCannotChangeWhileItRunsDoesNot) {
  DriveRig rig(1);
  ASSERT_TRUE(rig.ready());
  using hal::canopen::SdoAbort;
  EXPECT_EQ(rig.write(0, {0x60C2, 1}, 2, 1), SdoAbort::kDeviceState);
  EXPECT_EQ(rig.write(0, {0x607D, 1}, 0, 4), SdoAbort::kDeviceState);
  EXPECT_EQ(rig.write(0, {0x6060, 0}, 2, 1), SdoAbort::kValueRange) << "no velocity mode of frequency converters";
  EXPECT_EQ(rig.write(0, {0x6098, 0}, 36, 1), SdoAbort::kValueRange);
  EXPECT_EQ(rig.write(0, {0x605A, 0}, 4, 2), SdoAbort::kValueRange);
  rig.command().set(kControl, 0);
  rig.run(0.02);
  EXPECT_EQ(rig.write(0, {0x60C2, 1}, 2, 1), SdoAbort::kNone);
}

}  // namespace
}  // namespace tandem::sim::drives
