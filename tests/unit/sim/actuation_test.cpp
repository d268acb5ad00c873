// SPDX-License-Identifier: Apache-2.0
#include "sim/actuation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sim/simulated_arm.h"
#include "tests/unit/safety/allocation_counter.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::sim {
namespace {

using safety::ArmVector;

class Plant : public ::testing::Test {
 public:
  std::uint32_t seed = test::baseSeed();
  test::Random random{seed};
  ::testing::ScopedTrace scope{__FILE__, __LINE__, test::trace(seed)};

  ArmVector any(double size) {
    ArmVector v(6);
    for (Eigen::Index j = 0; j < 6; ++j)
      v[j] = random.uniform(-size, size);
    return v;
  }
  static constexpr safety::JointKind kSlides = safety::JointKind::kTranslation, kTurns = safety::JointKind::kRotation;
  static constexpr safety::JointKinds kKinds{kSlides, kTurns, kTurns, kSlides, kSlides, kTurns};
  static SimulatedArm arm(const JointOptions& options) {
    const ArmVector unlimited = ArmVector::Constant(6, safety::kUnlimited);
    return {ArmVector::Zero(6), {unlimited, unlimited}, options};
  }
  static JointOptions with(JointMechanics mechanics, EncoderOptions encoders = {}) {
    return {mechanics, encoders, 7, 0, 1e-3, kKinds};
  }
};

TEST_F(Plant, LagAnswersAStepAsItsClosedForm) {
  for (int round = 0; round < 200; ++round) {
    const double tau = random.uniform(0.002, 0.5), height = random.uniform(-1.0, 1.0);
    double y = 0.0, t = 0.0;
    for (int i = 0; i < 50; ++i) {
      const double dt = random.uniform(1e-4, 0.1);
      y = lagged(y, height, height, dt, tau);
      t += dt;
      ASSERT_NEAR(y, height * (1.0 - std::exp(-t / tau)), 1e-12);
    }
  }
}

TEST_F(Plant, LagBehindARampIsTauTimesSpeed) {
  const double tau = 0.05, speed = 0.005;
  double y = 0.0, u = 0.0;
  for (int i = 0; i < 20; ++i, u += speed * 0.1)
    y = lagged(y, u, u + speed * 0.1, 0.1, tau);
  EXPECT_NEAR(u - y, tau * speed, 1e-12);
}

TEST_F(Plant, LagAndDelayDoNotDependOnTheStep) {
  // The same piecewise linear motion with one step per corner and with ten.
  for (int round = 0; round < 50; ++round) {
    JointMechanics mechanics;
    mechanics.delay = 1e-3 * random.integer(0, 250);
    mechanics.lag = {random.uniform(0.0, 0.2), random.uniform(0.0, 0.2)};
    Actuation coarse(mechanics, kKinds, 0.1), fine(mechanics, kKinds, 0.01);
    ArmVector corner = any(1.0);
    coarse.place(corner);
    fine.place(corner);
    for (int i = 0; i < 30; ++i) {
      const ArmVector next = any(1.0);
      coarse.step(0.1, next);
      for (int k = 1; k <= 10; ++k)
        fine.step(0.01, corner + 0.1 * k * (next - corner));
      corner = next;
      ASSERT_LT((coarse.output() - fine.output()).cwiseAbs().maxCoeff(), 1e-12) << "delay " << mechanics.delay;
    }
  }
}

TEST_F(Plant, DelayIsExact) {
  for (const int steps : {1, 3, 17}) {
    JointMechanics mechanics;
    mechanics.delay = 0.01 * steps;
    Actuation line(mechanics, kKinds, 0.01);
    const ArmVector start = any(1.0);
    line.place(start);
    std::vector<ArmVector> past(static_cast<std::size_t>(steps), start);
    for (int i = 0; i < 500; ++i) {
      past.push_back(any(1.0));
      line.step(0.01, past.back());
      ASSERT_EQ(line.output(), past[past.size() - 1 - static_cast<std::size_t>(steps)]) << steps << " steps, " << i;
    }
  }
}

TEST_F(Plant, JointsWithPendingMotionAreNotAtStandstill) {
  JointMechanics mechanics;
  mechanics.delay = 0.02;
  mechanics.lag = {0.01, 0.01};
  SimulatedArm plant = arm(with(mechanics));
  EXPECT_TRUE(plant.standing());
  const ArmVector goal = ArmVector::Constant(6, 1e-3);
  plant.step(1e-3, goal);
  EXPECT_FALSE(plant.standing()) << "it has not begun to move, but it will";
  int steps = 0;
  for (; steps < 1000 && !plant.standing(); ++steps)
    plant.step(1e-3, goal);
  EXPECT_EQ(plant.position(), goal);
  EXPECT_LT(steps, 300);
  plant.step(1e-3, ArmVector::Zero(6));
  plant.forget();
  plant.step(1e-3, goal);
  EXPECT_EQ(plant.position(), goal) << "what had been on its way is forgotten";
}

TEST_F(Plant, PlayMakesAHysteresisOfItsWidth) {
  for (int round = 0; round < 20; ++round) {
    JointMechanics mechanics;
    mechanics.backlash = {random.uniform(1e-4, 1e-3), random.uniform(1e-3, 1e-1)};
    SimulatedArm plant = arm(with(mechanics));
    ArmVector up = ArmVector::Zero(6), down = ArmVector::Zero(6);
    for (const int sign : {1, -1}) {  // up to 1 and back to 0
      for (int i = 1; i <= 100; ++i)
        plant.step(1e-3, ArmVector::Constant(6, sign > 0 ? 0.01 * i : 1.0 - 0.01 * i));
      if (sign > 0) {
        for (int i = 1; i <= 50; ++i)
          plant.step(1e-3, ArmVector::Constant(6, 1.0));
        up = plant.tubes();
      } else {
        down = plant.tubes();
      }
    }
    for (int j = 0; j < 6; ++j) {
      const double width = mechanics.backlash.of(kKinds[j]);
      EXPECT_NEAR(up[j], 1.0 - 0.5 * width, 1e-12) << "pulled from below";
      EXPECT_NEAR(down[j], 0.5 * width, 1e-12) << "pulled from above";
    }
    EXPECT_EQ(plant.reading(), ArmVector::Zero(6)) << "the encoder is at the motor and sees none of it";
    // Within the backlash the tube does not move.
    const ArmVector before = plant.tubes();
    ArmVector within(6);
    for (int j = 0; j < 6; ++j)
      within[j] = 0.9 * mechanics.backlash.of(kKinds[j]);
    plant.step(1e-3, within);
    EXPECT_EQ(plant.tubes(), before);
  }
}

TEST_F(Plant, ReadingsAreMultiplesOfTheResolution) {
  const EncoderOptions encoders{{1e-5, 1e-3}, {}};
  SimulatedArm plant = arm(with({}, encoders));
  for (int i = 0; i < 2000; ++i) {
    const ArmVector q = any(0.3);
    plant.step(1e-3, q);
    const ArmVector reading = plant.reading();
    for (int j = 0; j < 6; ++j) {
      const double resolution = encoders.resolution.of(kKinds[j]), ticks = reading[j] / resolution;
      ASSERT_NEAR(ticks, std::round(ticks), 1e-9);
      ASSERT_LE(std::abs(reading[j] - q[j]), 0.5 * resolution * (1 + 1e-9));
    }
    ASSERT_EQ(plant.position(), q);
  }
}

TEST_F(Plant, NoiseIsSeededAndHasItsDeviation) {
  const EncoderOptions encoders{{}, {1e-4, 1e-2}};
  SimulatedArm first = arm(with({}, encoders)), again = arm(with({}, encoders));
  JointOptions other_seed = with({}, encoders), other_arm = with({}, encoders);
  other_seed.seed = 8;
  other_arm.arm = 1;
  SimulatedArm third = arm(other_seed), fourth = arm(other_arm);
  constexpr int kCount = 20000;
  ArmVector squares = ArmVector::Zero(6), sum = ArmVector::Zero(6);
  std::vector<ArmVector> readings;
  for (int i = 0; i < kCount; ++i) {
    const ArmVector q = any(0.3);
    for (SimulatedArm* plant : {&first, &again, &third, &fourth})
      plant->step(1e-3, q);
    ASSERT_EQ(first.reading(), again.reading());
    ASSERT_EQ(first.reading(), first.reading()) << "asking does not draw";
    ASSERT_NE(first.reading(), third.reading());
    ASSERT_NE(first.reading(), fourth.reading());
    const ArmVector noise = first.reading() - q;
    sum += noise;
    squares += noise.cwiseAbs2();
    if (i < 20)
      readings.push_back(noise);
  }
  for (int j = 0; j < 6; ++j) {
    const double deviation = encoders.noise.of(kKinds[j]);
    EXPECT_NEAR(std::sqrt(squares[j] / kCount), deviation, 0.03 * deviation);
    EXPECT_NEAR(sum[j] / kCount, 0.0, 5.0 * deviation / std::sqrt(kCount));
  }
  first.place(ArmVector::Zero(6));
  for (const ArmVector& noise : readings) {
    first.step(1e-3, ArmVector::Zero(6));
    ASSERT_LT((first.reading() - noise).cwiseAbs().maxCoeff(), 1e-15) << "the same numbers after a reset";
  }
}

TEST_F(Plant, StepsAllocateNothing) {
  if (!test::canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  JointMechanics mechanics{0.0123, {0.02, 0.03}, {1e-4, 1e-3}};
  SimulatedArm plant = arm(with(mechanics, {{1e-5, 1e-4}, {1e-5, 1e-4}}));
  const ArmVector q = any(0.1);
  const std::size_t before = test::allocationCount();
  for (int i = 0; i < 200; ++i)
    plant.step(i % 2 == 0 ? 1e-3 : 1e-4, q);  // steps that are also shorter than configured
  plant.place(q);
  EXPECT_EQ(test::allocationCount(), before);
}

}  // namespace
}  // namespace tandem::sim
