// SPDX-License-Identifier: Apache-2.0
#include "sim/simulated_arm.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/safety/random_arm.h"

namespace tandem::sim {
namespace {

using safety::ArmVector;

PlantLimits same(int joints, double velocity, double acceleration) {
  return {ArmVector::Constant(joints, velocity), ArmVector::Constant(joints, acceleration)};
}

TEST(SimulatedArm, IdealJointsAreAtTheirReferenceBitForBit) {
  test::Random random(test::baseSeed());
  SCOPED_TRACE(test::trace(test::baseSeed()));
  SimulatedArm arm(ArmVector::Zero(6), same(6, safety::kUnlimited, safety::kUnlimited));
  for (int i = 0; i < 10000; ++i) {
    ArmVector reference(6);
    for (Eigen::Index j = 0; j < 6; ++j)
      reference[j] = random.uniform(-3.0, 3.0);
    arm.step(0.1, reference);
    ASSERT_EQ(arm.position(), reference);
    ASSERT_EQ(arm.reading(), reference);
  }
}

TEST(SimulatedArm, LimitedJointsKeepTheirLimitsArriveAndDoNotOvershoot) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 300; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    const double velocity = random.uniform(0.005, 0.05);
    const double acceleration = random.uniform(0.05, 2.0);
    const double goal = random.uniform(-0.05, 0.05);
    SimulatedArm arm(ArmVector::Zero(1), same(1, velocity, acceleration));
    const double dt = 1e-3;
    double last = 0.0;
    const double way = std::abs(goal);
    // At full speed, plus one acceleration and deceleration, plus a margin for the steps.
    const int steps = static_cast<int>((way / velocity + 2.0 * velocity / acceleration) / dt) + 60;
    for (int i = 0; i < steps; ++i) {
      arm.step(dt, ArmVector::Constant(1, goal));
      ASSERT_LE(std::abs(arm.velocity()[0]), velocity * (1 + 1e-12));
      ASSERT_LE(std::abs(arm.velocity()[0] - last), acceleration * dt * (1 + 1e-9));
      ASSERT_LE(arm.position()[0] * std::copysign(1.0, goal), way);
      last = arm.velocity()[0];
    }
    arm.step(dt, ArmVector::Constant(1, goal));
    EXPECT_EQ(arm.position()[0], goal);
    EXPECT_TRUE(arm.standing());
  }
}

TEST(SimulatedArm, FaultsActAsTheySay) {
  SimulatedArm arm(ArmVector::Zero(5), same(5, safety::kUnlimited, safety::kUnlimited));
  arm.inject(0, AxisFault::kOff);
  arm.inject(1, AxisFault::kStuck);
  arm.inject(2, AxisFault::kGarbage);
  arm.inject(3, AxisFault::kInvalid);
  arm.step(0.1, ArmVector::Ones(5));
  EXPECT_EQ(arm.position(), (ArmVector(5) << 0, 0, 1, 1, 1).finished());
  EXPECT_TRUE(std::isnan(arm.reading()[2]) && std::isnan(arm.velocityReading()[2]));
  EXPECT_EQ(arm.reading()[3], 1.0);
  EXPECT_FALSE(arm.valid());
  EXPECT_EQ(arm.presentFaults(), safety::bit(safety::Fault::kDrive) | safety::bit(safety::Fault::kSensor));
  arm.inject(2, AxisFault::kNone);
  EXPECT_FALSE(arm.valid());
  arm.inject(3, AxisFault::kNone);
  EXPECT_TRUE(arm.valid());
  EXPECT_EQ(arm.presentFaults(), safety::bit(safety::Fault::kDrive));
  arm.inject(0, AxisFault::kNone);
  EXPECT_EQ(arm.presentFaults(), 0u) << "a stuck joint does not report itself";
}

TEST(AxisFault, NamesRoundTrip) {
  for (const char* text : {"none", "off", "stuck", "garbage", "invalid", "runaway"}) {
    ASSERT_TRUE(axisFaultFromName(text));
    EXPECT_EQ(name(*axisFaultFromName(text)), text);
  }
  EXPECT_FALSE(axisFaultFromName("broken"));
}

}  // namespace
}  // namespace tandem::sim
