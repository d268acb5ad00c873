// SPDX-License-Identifier: Apache-2.0
/** @file Posture task in the null space of the tasks. */
#include "control/posture.h"

#include <gtest/gtest.h>

#include "control/resolver.h"
#include "tests/unit/control/step_allocations.h"

namespace tandem::test {
namespace {

using control::Method;
using control::MethodParameters;
using control::SolveStatus;

/// A random problem with a posture inside the limits, or somewhat outside of them.
bool setWithPosture(ArkProblem& ark, Random& random, double speed) {
  if (!ark.setRandom(random, speed))
    return false;
  control::RobotVector posture(12);
  posture << randomInside(ark.limits, random), randomInside(ark.limits, random);
  if (random.chance(0.2))
    posture[random.integer(0, 2)] += random.uniform(-5e-3, 5e-3);
  ark.problem.posture = posture;
  return true;
}

TEST(Posture, LimitsAndOptimalityHoldAsWithoutOne) {
  for (const Method method : {Method::kNspqp, Method::kSnsqp}) {
    const auto resolver = control::makeResolver(method, {});
    ArkProblem ark;
    control::Solution solution;
    int answered = 0;
    for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(1000); ++seed) {
      SCOPED_TRACE(trace(seed));
      Random random(seed);
      if (!setWithPosture(ark, random, std::pow(10.0, random.uniform(-4, -1))))
        continue;
      resolver->solve(ark.problem, solution);
      ASSERT_TRUE(solution.status == SolveStatus::kSolved ||
                  (method == Method::kNspqp && solution.status == SolveStatus::kInfeasible))
          << control::name(solution.status);
      EXPECT_LT(excess(ark.problem, solution), 1e-10);
      EXPECT_LT(solution.kkt_residual, 1e-8);
      EXPECT_TRUE(solution.status == SolveStatus::kSolved || solution.conflict.count > 0);
      ++answered;
    }
    EXPECT_GT(answered, 500) << control::name(method);
  }
}

/// Away from limits, a posture has no significant effect on the tasks.
TEST(Posture, DisturbsNoTask) {
  for (int m = 0; m < control::kMethodCount; ++m) {
    const auto method = static_cast<Method>(m);
    const auto resolver = control::makeResolver(method, {});
    ArkProblem ark;
    control::Solution with, without;
    for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 100; ++seed) {
      SCOPED_TRACE(trace(seed));
      Random random(seed);
      ASSERT_TRUE(ark.set(arkStart(1, 0), arkStart(1, 1), {1e-4, 0, -1e-4}, {2e-4, 1e-4, 0}));
      resolver->solve(ark.problem, without);
      ark.problem.posture.resize(12);
      ark.problem.posture << arkStart(1, 0), arkStart(1, 1);
      for (int j = 0; j < 12; ++j)
        ark.problem.posture[j] += (j % 6 < 3 ? 2e-3 : 0.05) * random.uniform(-1, 1);
      resolver->solve(ark.problem, with);
      ASSERT_EQ(with.status, SolveStatus::kSolved);
      EXPECT_GT((with.velocity - without.velocity).norm(), 1e-4);
      for (int k = 0; k < 2; ++k)
        EXPECT_NEAR(with.residual[k], without.residual[k], 1e-5) << control::name(method) << ", task " << k;
      ark.problem.posture.resize(0);
    }
  }
}

TEST(Posture, SpeedIsLimitedAndStraight) {
  ArkProblem ark;
  Random random(baseSeed());
  for (int i = 0; i < 200; ++i) {
    if (!setWithPosture(ark, random, 1e-3))
      continue;
    const auto velocity = control::postureVelocity(ark.problem, {}, 0.5);
    control::RobotVector displacement(12);
    for (int j = 0; j < 12; ++j) {
      displacement[j] = ark.problem.posture[j] - ark.problem.joint[j].position;
      EXPECT_LE(std::abs(velocity[j]), (j % 6 < 3 ? 5e-3 : 0.5) + 1e-12);
    }
    EXPECT_NEAR(velocity.normalized().dot(displacement.normalized()), 1.0, 1e-12);
  }
}

TEST(Posture, RefusesOneThatIsNotFiniteOrOfAnotherSize) {
  for (int m = 0; m < control::kMethodCount; ++m) {
    const auto resolver = control::makeResolver(static_cast<Method>(m), {});
    ArkProblem ark;
    control::Solution solution;
    ASSERT_TRUE(ark.set(arkStart(0, 0), arkStart(0, 1), {0, 0, 0}, {0, 0, 0}));
    ark.problem.posture.setZero(11);
    resolver->solve(ark.problem, solution);
    EXPECT_EQ(solution.status, SolveStatus::kNotFinite);
    ark.problem.posture.setConstant(12, std::nan(""));
    resolver->solve(ark.problem, solution);
    EXPECT_EQ(solution.status, SolveStatus::kNotFinite);
    EXPECT_TRUE(solution.velocity.isZero(0.0));
  }
}

TEST(Posture, AllocatesNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  expectStepsAllocateNothing([](ArkProblem& ark, Random& random) { return setWithPosture(ark, random, 3e-3); });
}

}  // namespace
}  // namespace tandem::test
