// SPDX-License-Identifier: Apache-2.0
#include "safety/limits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "tests/unit/safety/random_arm.h"

namespace tandem::safety {
namespace {

/// Three tubes as in Alsaka et al. 2024, without margins.
TubeLimitSpec paperSpec() {
  TubeLimitSpec spec;
  spec.tube_length = {0.431, 0.332, 0.174};
  spec.carriage_spacing = {0.0, 0.0};
  spec.minimum_extension = {0.0, 0.0};
  spec.stage_minimum = {-kUnlimited, -kUnlimited, -kUnlimited};
  spec.stage_maximum = {kUnlimited, kUnlimited, kUnlimited};
  return spec;
}

/// Equation (1), written literally and independently of rows.
bool insideEquationOne(const TubeLimitSpec& spec, const ArmVector& q) {
  const std::vector<double>& l = spec.tube_length;
  if (q[0] < -l[0] || q[0] > 0.0)
    return false;
  for (std::size_t i = 1; i < l.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (q[k] < std::max(-l[i], q[k - 1]) || q[k] > std::min(q[k - 1] + l[i - 1] - l[i], 0.0))
      return false;
  }
  return true;
}

TEST(TubeLimits, AreEquationOne) {
  const TubeLimitSpec spec = paperSpec();
  const ArmLimits limits = makeTubeLimits(spec);
  test::Random random(test::baseSeed());
  SCOPED_TRACE(test::trace(test::baseSeed()));
  int inside = 0;
  for (int i = 0; i < 100000; ++i) {
    ArmVector q = ArmVector::Zero(6);
    for (Eigen::Index j = 0; j < 3; ++j)
      q[j] = random.uniform(-0.5, 0.05);
    const bool expected = insideEquationOne(spec, q);
    inside += expected ? 1 : 0;
    ASSERT_EQ(largestViolation(limits, q) <= 0.0, expected) << q.transpose();
  }
  EXPECT_GT(inside, 500);
}

TEST(Readings, OutsideByLessThanTheirErrorAreBroughtInside) {
  for (std::uint32_t i = 0; i < test::cases(2000); ++i) {
    const std::uint32_t seed = test::baseSeed() + i;
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    const ArmLimits limits = test::randomLimits(random);
    const ArmVector joints = test::randomInside(limits, random);
    EXPECT_EQ(broughtInside(limits, joints), joints) << "inside, nothing changes";
    const double error = random.uniform(1e-8, 2e-4);
    ArmVector reading = joints;
    for (Eigen::Index j = 0; j < reading.size(); ++j)
      reading[j] += random.uniform(-error, error);
    const ArmVector inside = broughtInside(limits, reading);
    EXPECT_LE(largestViolation(limits, inside), 1e-15);
    // With two measured tubes, each moves the next one by up to twice the error.
    EXPECT_LE((inside - reading).cwiseAbs().maxCoeff(), 2.0 * error * limits.jointCount());
  }
}

TEST(Readings, AreOutsideBeyondRestAndTheirError) {
  ArmLimits limits = makeTubeLimits(paperSpec());
  ArmVector q = ArmVector::Zero(6);
  q << -0.1, -0.08, 0.5 * kPositionTolerance, 0.0, 0.0, 0.0;
  EXPECT_EQ(readOutside(limits, q).amount, 0.0) << "at standstill at its limit";
  q[2] = 1.5 * kPositionTolerance;
  EXPECT_EQ(readOutside(limits, q).joint, 2);
  EXPECT_DOUBLE_EQ(readOutside(limits, q).amount, 1.5 * kPositionTolerance);
  limits.joints[2].reading_error = kPositionTolerance;
  EXPECT_EQ(readOutside(limits, q).amount, 0.0);
  q[2] = std::nan("");
  EXPECT_FALSE(readOutside(limits, q).amount <= 0.0);
}

TEST(TubeLimits, MarginsNarrowTheRows) {
  TubeLimitSpec spec = paperSpec();
  spec.carriage_spacing = {0.004, 0.006};
  spec.minimum_extension = {0.002, 0.003};
  const ArmLimits limits = makeTubeLimits(spec);
  ASSERT_EQ(limits.rows.size(), 4u);
  ArmVector q(6);
  q << -0.1, -0.096, -0.05, 0, 0, 0;
  EXPECT_NEAR(rowValue(limits.rows[0], q) - limits.rows[0].b, 0.0, 1e-15);
  q << -0.2, -0.2 + 0.431 - 0.332 - 0.002, -0.05, 0, 0, 0;
  EXPECT_NEAR(rowValue(limits.rows[1], q) - limits.rows[1].b, 0.0, 1e-15);
  EXPECT_EQ(describe(limits.rows[0]), "tube 2 against tube 1 (carriage spacing)");
  EXPECT_EQ(describe(limits.rows[3]), "tube 3 against tube 2 (minimum extension)");
  EXPECT_EQ(limits.rows[3].inner_joint, 1);
  EXPECT_EQ(limits.rows[3].outer_joint, 2);
}

TEST(TubeLimits, RefuseWhatLeavesNoRoom) {
  const auto refused = [](auto change) {
    TubeLimitSpec spec = paperSpec();
    change(spec);
    try {
      makeTubeLimits(spec);
    } catch (const std::invalid_argument&) {
      return true;
    }
    return false;
  };
  EXPECT_FALSE(refused([](TubeLimitSpec&) {}));
  EXPECT_TRUE(refused([](TubeLimitSpec& s) { s.tube_length.clear(); }));
  EXPECT_TRUE(refused([](TubeLimitSpec& s) { s.tube_length[1] = 0.5; }));
  EXPECT_TRUE(refused([](TubeLimitSpec& s) { s.tube_length[1] = NAN; }));
  EXPECT_TRUE(refused([](TubeLimitSpec& s) { s.carriage_spacing.pop_back(); }));
  EXPECT_TRUE(refused([](TubeLimitSpec& s) { s.carriage_spacing[0] = -0.001; }));
  EXPECT_TRUE(refused([](TubeLimitSpec& s) { s.carriage_spacing[0] = 0.2; }));
  EXPECT_TRUE(refused([](TubeLimitSpec& s) { s.stage_maximum[0] = -0.5; }));
  EXPECT_TRUE(refused([](TubeLimitSpec& s) { s.stage_minimum[2] = 0.1; }));
  EXPECT_TRUE(refused([](TubeLimitSpec& s) {
    s.stage_minimum[0] = -0.01;
    s.carriage_spacing[0] = 0.02;
  }));
  EXPECT_TRUE(refused([](TubeLimitSpec& s) { s.translation.velocity = 0.0; }));
  EXPECT_TRUE(refused([](TubeLimitSpec& s) { s.rotation.stop_deceleration = NAN; }));
  EXPECT_TRUE(refused([](TubeLimitSpec& s) {
    s.rotation.lower = 1.0;
    s.rotation.upper = -1.0;
  }));
}

}  // namespace
}  // namespace tandem::safety
