// SPDX-License-Identifier: Apache-2.0
/** @file Absolute encoders whose counts begin again after a range. */
#include "hal/encoder_reading.h"

#include <random>

#include "tests/unit/hal_robot/robot_fixture.h"

namespace tandem::hal::test {
namespace {

TEST(EncoderReading, FollowsAJointOverTheEndOfItsRange) {
  const auto seed = static_cast<unsigned>(::testing::UnitTest::GetInstance()->random_seed()) + 11u;
  std::printf("seed %u\n", seed);
  std::mt19937 random(seed);
  const auto uniform = [&](double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(random);
  };
  for (int run = 0; run < 100; ++run) {
    EncoderConfig encoder;
    encoder.gearing.counts_per_revolution = 4096;
    encoder.gearing.travel_per_revolution = 2e-3;
    encoder.gearing.reversed = run % 2 == 0;
    encoder.gearing.offset = uniform(-1.0, 1.0);
    encoder.range = std::floor(uniform(2000.0, 100000.0));
    const AxisUnits units(encoder.gearing);
    const double width = units.resolution() * encoder.range, lower = uniform(-1.0, 1.0);
    const double upper = lower + 0.95 * width;
    EncoderReading reading(encoder, lower, upper);
    const auto counts = [&](double joint) {
      const auto all = std::int64_t{units.toCounts(joint).value}, range = static_cast<std::int64_t>(encoder.range);
      return static_cast<std::int32_t>((all % range + range) % range);
    };
    for (int boot = 0; boot < 3; ++boot) {
      reading.restart();
      double joint = uniform(lower, upper);
      for (int k = 0; k < 200; ++k) {
        ASSERT_NEAR(reading.take(counts(joint)), joint, 2.0 * units.resolution()) << run << " " << k;
        joint = std::clamp(joint + uniform(-0.4, 0.4) * width, lower - 0.02 * width, upper + 0.02 * width);
      }
    }
  }
}

HardwareConfig singleTurn() {
  HardwareConfig config = presetHardware();
  for (AxisConfig& axis : config.axes)
    axis.encoder->range = std::ceil(1.2 * (axis.upper - axis.lower) / AxisUnits(axis.encoder->gearing).resolution());
  return config;
}

/// The simulated encoders begin at 0: the first motion in negative direction passes the end of their range.
TEST(EncoderReading, AnArmMovesOverTheEndOfTheRange) {
  for (const double direction : {-1.0, 1.0}) {
    System system(singleTurn());
    ASSERT_TRUE(system.boot()) << system.story();
    for (int j = 0; j < 6; ++j)
      EXPECT_NEAR(system.robot->position(0)[j], system.truth(0, j), 1e-5) << j;
    ASSERT_TRUE(system.enable());
    system.move(0, speeds(direction * 4e-3, direction * 0.5));
    system.run(1.0);
    system.hold();
    system.run(0.3);
    EXPECT_EQ(system.robot->state(0), OperatingState::kEnabled) << system.story();
    for (int j = 0; j < 6; ++j)
      EXPECT_NEAR(system.robot->position(0)[j], system.truth(0, j), 1e-4) << j;
  }
}

TEST(EncoderReading, WithoutARangeInTheFileTheWrapStopsTheArm) {
  System system(singleTurn());
  HardwareConfig silent = system.config;
  for (AxisConfig& axis : silent.axes)
    axis.encoder->range = 0.0;
  system.replaceHal(silent);
  ASSERT_TRUE(system.boot());
  ASSERT_TRUE(system.enable());
  system.move(0, speeds(-4e-3, -0.5));
  EXPECT_TRUE(system.until(1.0, [&] { return system.robot->state(0) == OperatingState::kFault; }));
  EXPECT_GE(system.guardCount(HardwareGuard::kEncoderMismatch), 1u) << system.story();
}

}  // namespace
}  // namespace tandem::hal::test
