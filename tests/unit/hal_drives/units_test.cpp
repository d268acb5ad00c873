// SPDX-License-Identifier: Apache-2.0
#include "hal/drives/units.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "tests/unit/safety/random_arm.h"

namespace tandem::hal {
namespace {

using test::Random;

Gearing randomGearing(Random& random) {
  Gearing gearing;
  gearing.counts_per_revolution = std::floor(std::exp(random.uniform(std::log(100.0), std::log(1 << 20))));
  gearing.gear_ratio = random.chance(0.3) ? 1.0 : random.uniform(0.2, 300.0);
  gearing.travel_per_revolution = random.chance(0.5) ? random.uniform(0.5e-3, 20e-3) : 2.0 * std::numbers::pi;
  gearing.reversed = random.chance(0.5);
  gearing.offset = random.uniform(-1.0, 1.0);
  return gearing;
}

TEST(AxisUnits, CountsSurviveTheWayToSiAndBack) {
  for (std::uint32_t run = 0; run < 2000; ++run) {
    SCOPED_TRACE(test::trace(test::baseSeed() + run));
    Random random(test::baseSeed() + run);
    const Gearing gearing = randomGearing(random);
    AxisUnits units(gearing);
    if (random.chance(0.5))
      units.setReference(random.integer(-1000000, 1000000), random.uniform(-1.0, 1.0));
    for (int i = 0; i < 20; ++i) {
      const std::int32_t counts =
          random.integer(std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max());
      const Counts back = units.toCounts(units.toJoint(counts));
      EXPECT_TRUE(back.exact);
      EXPECT_EQ(back.value, counts);
    }
  }
}

TEST(AxisUnits, PositionsSurviveWithinHalfACount) {
  for (std::uint32_t run = 0; run < 2000; ++run) {
    SCOPED_TRACE(test::trace(test::baseSeed() + run));
    Random random(test::baseSeed() + run);
    const AxisUnits units(randomGearing(random));
    const double joint =
        units.toJoint(random.integer(-100000000, 100000000)) + units.scale() * random.uniform(-0.5, 0.5);
    const double back = units.toJoint(units.toCounts(joint).value);
    EXPECT_LE(std::abs(back - joint), 0.5 * units.resolution() * (1.0 + 1e-6) + 1e-15);
  }
}

TEST(AxisUnits, SpeedsHaveTheSignOfDisplacements) {
  for (std::uint32_t run = 0; run < 500; ++run) {
    SCOPED_TRACE(test::trace(test::baseSeed() + run));
    Random random(test::baseSeed() + run);
    const AxisUnits units(randomGearing(random));
    const std::int32_t from = random.integer(-1000000, 1000000), step = random.integer(-1000, 1000);
    const double moved = units.toJoint(from + step) - units.toJoint(from);
    EXPECT_NEAR(units.toJointSpeed(step), moved, 1e-9 * std::abs(moved) + 1e-12);
    EXPECT_NEAR(units.toCountSpeed(units.toJointSpeed(step)), step, 1e-9 * std::abs(step));
    EXPECT_EQ(units.toCountMagnitude(moved), static_cast<std::uint32_t>(std::abs(step)));
  }
}

TEST(AxisUnits, AKnownLeadScrew) {
  // 4096 counts a revolution, gear 10, lead 2 mm: 20480 counts per mm; zero counts at -150 mm, reversed.
  const AxisUnits units({4096.0, 10.0, 2e-3, true, -0.15});
  EXPECT_NEAR(units.toJoint(20480), -0.151, 1e-12);
  EXPECT_EQ(units.toCounts(-0.149).value, -20480);
  EXPECT_EQ(units.toCountMagnitude(5e-3), 102400u);
}

TEST(AxisUnits, ReferenceMovesTheOriginOnly) {
  AxisUnits units({1000.0, 1.0, 1e-3, false, 0.0});
  ASSERT_TRUE(units.setReference(123456, -0.1));
  EXPECT_EQ(units.toJoint(123456), -0.1);
  EXPECT_NEAR(units.toJoint(124456), -0.099, 1e-15);
  EXPECT_FALSE(units.setReference(0, std::nan("")));
  EXPECT_EQ(units.toJoint(123456), -0.1);
}

TEST(AxisUnits, ValuesOutOfRangeAreMarked) {
  const AxisUnits units({4096.0, 1.0, 1e-3, false, 0.0});
  EXPECT_FALSE(units.toCounts(std::nan("")).exact);
  EXPECT_FALSE(units.toCounts(std::numeric_limits<double>::infinity()).exact);
  EXPECT_FALSE(units.toCounts(1e6).exact);
  EXPECT_EQ(units.toCounts(1e6).value, std::numeric_limits<std::int32_t>::max());
  EXPECT_EQ(units.toCounts(-1e6).value, std::numeric_limits<std::int32_t>::min());
}

TEST(AxisUnits, InvalidGearingIsRefused) {
  const Gearing good{4096.0, 10.0, 2e-3, false, 0.0};
  for (double Gearing::*member :
       {&Gearing::counts_per_revolution, &Gearing::gear_ratio, &Gearing::travel_per_revolution}) {
    for (const double value : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
      Gearing bad = good;
      bad.*member = value;
      EXPECT_THROW(AxisUnits{bad}, std::invalid_argument);
    }
  }
  Gearing bad = good;
  bad.offset = std::nan("");
  EXPECT_THROW(AxisUnits{bad}, std::invalid_argument);
}

/// Numbers of CiA 303-2, as drives state them; each states what it was made from.
TEST(Units, StatedUnits) {
  EXPECT_EQ(velocityCode(RateUnit::kRevolutionsPerMinute, 1.0), 0x00B44700u);
  EXPECT_EQ(velocityCode(RateUnit::kRevolutionsPerMinute, 1000.0), 0xFDB44700u);
  EXPECT_EQ(accelerationCode(RateUnit::kRevolutionsPerMinute, 1.0), 0x00C00300u);
  for (const RateUnit unit : kRateUnits) {
    for (const double scale : {1.0, 10.0, 1e6}) {
      EXPECT_EQ(unitOfVelocityCode(velocityCode(unit, scale)), std::pair(unit, scale));
      EXPECT_EQ(unitOfAccelerationCode(accelerationCode(unit, scale)), std::pair(unit, scale));
    }
  }
  EXPECT_FALSE(unitOfVelocityCode(0));
  EXPECT_FALSE(unitOfVelocityCode(0x00010000));
}

}  // namespace
}  // namespace tandem::hal
