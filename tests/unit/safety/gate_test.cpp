// SPDX-License-Identifier: Apache-2.0
#include "safety/gate.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/safety/allocation_counter.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::safety {
namespace {

constexpr double kPeriod = 0.1;

GateCommand commandTo(const ArmVector& position) {
  GateCommand command;
  command.position = position;
  command.velocity = ArmVector::Zero(position.size());
  command.duration = kPeriod;
  return command;
}

/// Two tubes, 5 mm between the carriages, 10 mm/s.
ArmLimits twoTubes() {
  TubeLimitSpec spec;
  spec.tube_length = {0.4, 0.2};
  spec.carriage_spacing = {0.005};
  spec.minimum_extension = {0.0};
  spec.stage_minimum = {-0.3, -0.2};
  spec.stage_maximum = {0.0, 0.0};
  spec.translation.max_step = 0.05;
  return makeTubeLimits(spec);
}

ArmVector vector4(double a, double b, double c, double d) {
  ArmVector q(4);
  q << a, b, c, d;
  return q;
}

TEST(Gate, WildCommandsEndInsideAndNeverBeyondTheRequest) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 20000; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    const Gate gate(test::randomLimits(random));
    const ArmVector now = test::randomInside(gate.limits(), random);
    const ArmVector rest = ArmVector::Zero(now.size());
    const ArmVector wanted = test::randomWild(gate.limits(), now, random);
    ArmVector next;
    ASSERT_EQ(gate.check(commandTo(wanted), now, rest, next).faults, 0u);
    ASSERT_LE(largestViolation(gate.limits(), next), 0.0);
    for (Eigen::Index j = 0; j < now.size(); ++j) {
      // Between the present and the requested position; or moved by the inner neighbour, by no more than that one
      // moves.
      const bool between = next[j] >= std::min(now[j], wanted[j]) && next[j] <= std::max(now[j], wanted[j]);
      const bool outer = j > 0 && j < now.size() / 2;
      const bool carried = outer && std::abs(next[j] - now[j]) <= std::abs(next[j - 1] - now[j - 1]) + 1e-12;
      ASSERT_TRUE(between || carried) << "joint " << j;
      ASSERT_LE(std::abs(next[j] - now[j]), gate.limits().joints[j].velocity * kPeriod * (1.0 + 1e-9) + 1e-15);
    }
    ArmVector again;
    const GateReport report = gate.check(commandTo(next), now, rest, again);
    ASSERT_EQ(again, next);
    for (const GuardAction& action : report.guards)
      ASSERT_FALSE(action.acted);
  }
}

TEST(Gate, AnArmOutsideItsLimitsIsNotDrivenFartherOut) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 5000; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    const Gate gate(test::randomLimits(random));
    ArmVector now = test::randomInside(gate.limits(), random);
    for (Eigen::Index j = 0; j < now.size(); ++j)
      now[j] += random.uniform(-0.02, 0.02);
    ArmVector next;
    gate.check(commandTo(test::randomWild(gate.limits(), now, random)), now, ArmVector::Zero(now.size()), next);
    ASSERT_LE(largestViolation(gate.limits(), next), std::max(0.0, largestViolation(gate.limits(), now)));
    for (const LinearRow& row : gate.limits().rows) {
      ASSERT_LE(rowValue(row, next), std::max(row.b, rowValue(row, now)));
    }
  }
}

TEST(Gate, WhatIsInsidePassesUntouched) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 2000; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    ArmLimits limits = test::randomLimits(random);
    for (JointLimit& joint : limits.joints)
      joint.velocity = kUnlimited;
    const Gate gate(limits);
    const ArmVector now = test::randomInside(limits, random);
    const ArmVector wanted = test::randomInside(limits, random);
    ArmVector next;
    const GateReport report = gate.check(commandTo(wanted), now, ArmVector::Zero(now.size()), next);
    ASSERT_EQ(next, wanted);
    for (const GuardAction& action : report.guards)
      ASSERT_FALSE(action.acted);
  }
}

TEST(Gate, CarriesAnOuterCarriageAlong) {
  const Gate gate(twoTubes());
  const ArmVector now = vector4(-0.100, -0.080, 0.0, 0.0);
  // Tube 1 closes 20 mm of a gap of 15 mm: tube 2 moves 5 mm with it, whatever was requested.
  ArmVector next;
  const GateReport report = gate.check(commandTo(vector4(-0.080, -0.090, 0.3, 0.0)), now, vector4(0, 0, 0, 0), next);
  EXPECT_EQ(next[0], -0.080);
  EXPECT_NEAR(next[1], -0.075, 1e-12);
  EXPECT_EQ(next[2], 0.3);
  EXPECT_TRUE(report[Guard::kCoupledRow].acted);
  EXPECT_EQ(report[Guard::kCoupledRow].joint, 1);
  EXPECT_NEAR(report[Guard::kCoupledRow].amount, 0.015, 1e-12);
  EXPECT_FALSE(report[Guard::kPosition].acted);
}

TEST(Gate, CarriesNoCarriageFasterThanItsLimit) {
  ArmLimits limits = twoTubes();
  limits.joints[1].velocity = 1e-3 / kPeriod;
  const ArmVector now = vector4(-0.100, -0.080, 0.0, 0.0);
  ArmVector next;
  Gate(limits).check(commandTo(vector4(-0.080, -0.090, 0.3, 0.0)), now, vector4(0, 0, 0, 0), next);
  EXPECT_LE(std::abs(next[1] - now[1]), 1e-3 * (1.0 + 1e-6)) << "5 mm would make room for tube 1";
  EXPECT_LE(largestViolation(limits, next), 1e-12);
}

TEST(Gate, TakesACoupledRowBackInProportionWhereNothingCanBeCarried) {
  ArmLimits limits = twoTubes();
  limits.joints[1].upper = -0.080;  // the outer stage ends here
  const Gate gate(limits);
  const ArmVector now = vector4(-0.100, -0.080, 0.0, 0.0);
  // Tube 1 closes 20 mm, tube 2 closes 10 mm of a gap of 15 mm: 15 mm too much, two thirds of it from tube 1.
  ArmVector next;
  const GateReport report = gate.check(commandTo(vector4(-0.080, -0.090, 0.3, 0.0)), now, vector4(0, 0, 0, 0), next);
  EXPECT_NEAR(next[0], -0.090, 1e-12);
  EXPECT_NEAR(next[1], -0.085, 1e-12);
  EXPECT_EQ(report[Guard::kCoupledRow].joint, 0);
  EXPECT_NEAR(report[Guard::kCoupledRow].amount, 0.010, 1e-12);
}

TEST(Gate, ReportsWhichGuardWhichJointAndHowMuch) {
  ArmLimits limits = twoTubes();
  limits.joints[1].velocity = 0.010;
  limits.joints[2].slew_limit = 2.0;
  const Gate gate(limits);
  const ArmVector now = vector4(-0.290, -0.150, 0.0, 0.0);
  ArmVector next;
  const GateReport report = gate.check(commandTo(vector4(-0.310, -0.148, 0.1, 0.0)), now, vector4(0, 0, 0.5, 0), next);
  EXPECT_TRUE(report[Guard::kPosition].acted);
  EXPECT_EQ(report[Guard::kPosition].joint, 0);
  EXPECT_NEAR(report[Guard::kPosition].amount, 0.010, 1e-12);
  EXPECT_TRUE(report[Guard::kVelocity].acted);
  EXPECT_EQ(report[Guard::kVelocity].joint, 1);
  EXPECT_NEAR(report[Guard::kVelocity].amount, 0.010, 1e-12);
  EXPECT_TRUE(report[Guard::kSlew].acted);
  EXPECT_EQ(report[Guard::kSlew].joint, 2);
  EXPECT_NEAR(report[Guard::kSlew].amount, 0.3, 1e-12);
  EXPECT_NEAR(next[0], -0.300, 1e-15);
  EXPECT_NEAR(next[1], -0.149, 1e-15);
  EXPECT_NEAR(next[2], 0.07, 1e-15);
}

TEST(Gate, ACommandExactlyAtTheSpeedLimitIsNoIntervention) {
  ArmLimits limits = twoTubes();
  limits.joints[0].velocity = 0.010;
  const Gate gate(limits);
  for (int i = 0; i < 1000; ++i) {
    const ArmVector now = vector4(-0.2 + 1e-4 * i, -0.05, 0, 0);
    ArmVector wanted = now;
    wanted[0] += 0.010 * kPeriod;
    ArmVector next;
    const GateReport report = gate.check(commandTo(wanted), now, vector4(0, 0, 0, 0), next);
    ASSERT_FALSE(report[Guard::kVelocity].acted);
    ASSERT_EQ(next, wanted);
  }
}

TEST(Gate, IntegrityGuardsRefuseTheWholeCommand) {
  const Gate gate(twoTubes());
  const ArmVector now = vector4(-0.100, -0.080, 0.0, 0.0);
  const auto refusal = [&](auto change) {
    GateCommand command = commandTo(vector4(-0.099, -0.080, 0.0, 0.0));
    change(command);
    ArmVector next;
    const GateReport report = gate.check(command, now, vector4(0, 0, 0, 0), next);
    if (report.faults != 0) {
      EXPECT_EQ(next, now);
    }
    return report;
  };
  EXPECT_EQ(refusal([](GateCommand&) {}).faults, 0u);
  const double nan = std::nan("");
  EXPECT_EQ(refusal([&](GateCommand& c) { c.position[3] = nan; }).faults, bit(Fault::kNotFinite));
  EXPECT_EQ(refusal([&](GateCommand& c) { c.velocity[1] = kUnlimited; }).faults, bit(Fault::kNotFinite));
  EXPECT_EQ(refusal([&](GateCommand& c) { c.duration = 0.0; }).faults, bit(Fault::kNotFinite));
  EXPECT_EQ(refusal([&](GateCommand& c) { c.position.setZero(3); }).faults, bit(Fault::kNotFinite));
  const GateReport step = refusal([](GateCommand& c) { c.position[1] = -0.020; });
  EXPECT_EQ(step.faults, bit(Fault::kStepTooLarge));
  EXPECT_EQ(step[Guard::kStep].joint, 1);
  EXPECT_NEAR(step[Guard::kStep].amount, 0.010, 1e-12);
  const FaultMask stream = bit(Fault::kStaleCommand) | bit(Fault::kOutOfSequence) | bit(Fault::kUnknownArm);
  const GateReport bad_stream = refusal([&](GateCommand& c) {
    c.stream = stream;
    c.age_excess = 0.2;
  });
  EXPECT_EQ(bad_stream.faults, stream);
  EXPECT_TRUE(bad_stream[Guard::kSequence].acted && bad_stream[Guard::kKnownArm].acted);
  EXPECT_DOUBLE_EQ(bad_stream[Guard::kFresh].amount, 0.2);
}

TEST(Gate, DoesNotAllocate) {
  if (!test::canCountAllocations())
    GTEST_SKIP() << "the sanitizer has its own allocator";
  test::Random random(test::baseSeed());
  const Gate gate(test::randomLimits(random));
  const ArmVector now = test::randomInside(gate.limits(), random);
  const ArmVector rest = ArmVector::Zero(now.size());
  GateCommand command = commandTo(now);
  GuardCounters counters;
  ArmVector next;
  const std::size_t before = test::allocationCount();
  for (int i = 0; i < 1000; ++i) {
    command.position = test::randomWild(gate.limits(), now, random);
    counters.add(0, gate.check(command, now, rest, next));
  }
  EXPECT_EQ(test::allocationCount(), before);
  EXPECT_GT(counters[Guard::kVelocity].count, 0u);
  // Verifies the counter, without which this test could not fail.
  const std::vector<double> proof(1000, 1.0);
  EXPECT_GT(test::allocationCount(), before);
  EXPECT_EQ(proof.size(), 1000u);
}

}  // namespace
}  // namespace tandem::safety
