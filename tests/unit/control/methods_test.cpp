// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <cstdio>

#include "control/limit_weights.h"
#include "control/resolver.h"
#include "control/velocity_bounds.h"
#include "tests/unit/control/step_allocations.h"

namespace tandem::test {
namespace {

using control::Method;
using control::MethodParameters;
using control::SolveStatus;

constexpr double kSpeed = 3e-3;  // m/s

TEST(QpMethods, KeepLimitsAndOptimalityEverywhere) {
  for (const Method method : {Method::kNspqp, Method::kSnsqp}) {
    const auto resolver = control::makeResolver(method, {});
    ArkProblem ark;
    control::Solution solution;
    int solved = 0;
    for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 500; ++seed) {
      SCOPED_TRACE(trace(seed));
      Random random(seed);
      if (!ark.setRandom(random, kSpeed))
        continue;
      resolver->solve(ark.problem, solution);
      // Level 1 of (8) is always feasible with s = 0; (7) may be infeasible under limits, and then reports it.
      ASSERT_TRUE(method == Method::kNspqp || solution.status == SolveStatus::kSolved);
      if (solution.status != SolveStatus::kSolved) {
        EXPECT_EQ(solution.status, SolveStatus::kInfeasible);
        EXPECT_TRUE(solution.velocity.isZero(0.0));
        continue;
      }
      ++solved;
      EXPECT_LT(excess(ark.problem, solution), 1e-12);
      EXPECT_LT(solution.kkt_residual, 1e-8);
      for (int k = 0; k < 2; ++k) {
        EXPECT_GE(solution.scale[k], 0.0);
        EXPECT_LE(solution.scale[k], 1.0);
      }
      const Eigen::VectorXd done = ark.problem.task[0].jacobian * solution.velocity;
      EXPECT_LT((done - solution.scale[0] * ark.problem.task[0].velocity).norm(), 1e-12);
    }
    EXPECT_GT(solved, 200) << control::name(method);
  }
}

TEST(Sns, KeepsLimitsAndOrderAndIsWithinTheOptimum) {
  const auto resolver = control::makeResolver(Method::kSns, {});
  MethodParameters same;
  same.snsqp_zeta = 1e-5;
  same.snsqp_rotation_velocity = same.rotation_velocity;
  const auto optimum = control::makeResolver(Method::kSnsqp, same);
  for (const double speed : {kSpeed, 0.1}) {
    ArkProblem ark;
    control::Solution solution, best;
    int compared = 0, reached = 0, full = 0;
    for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 500; ++seed) {
      SCOPED_TRACE(trace(seed));
      Random random(seed);
      if (!ark.setRandom(random, speed))
        continue;
      resolver->solve(ark.problem, solution);
      optimum->solve(ark.problem, best);
      ASSERT_EQ(solution.status, SolveStatus::kSolved);
      EXPECT_LT(excess(ark.problem, solution), 1e-10);
      if (best.status != SolveStatus::kSolved)
        continue;
      ++compared;
      // The largest feasible scale is that of the linear programme; the analytic form may be smaller.
      EXPECT_LE(solution.scale[0], best.scale[0] + 1e-3);
      reached += solution.scale[0] > 0.99 * best.scale[0] ? 1 : 0;
      full += best.scale[0] > 0.999 ? 1 : 0;
    }
    std::printf("  speed %g m/s: %d steps, %d of them feasible, scale of the optimum in %d\n", speed, compared, full,
                reached);
    EXPECT_GT(compared, 200);
    EXPECT_GT(reached, 0.8 * compared);
  }
}

TEST(Sns, IsThePseudoinverseWithoutActiveLimits) {
  const auto resolver = control::makeResolver(Method::kSns, {});
  ArkProblem ark;
  control::Solution solution;
  int compared = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 300; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    if (!ark.setRandom(random, 1e-5))
      continue;
    resolver->solve(ark.problem, solution);
    if (solution.active_count > 0 || solution.scale[0] < 1.0 || solution.scale[1] < 1.0)
      continue;
    Eigen::MatrixXd both(6, 12);
    both << ark.problem.task[0].jacobian, ark.problem.task[1].jacobian;
    Eigen::VectorXd wanted(6);
    wanted << ark.problem.task[0].velocity, ark.problem.task[1].velocity;
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(both, Eigen::ComputeThinU | Eigen::ComputeThinV);
    if (svd.singularValues().minCoeff() < 5e-3)
      continue;
    EXPECT_LT((both * solution.velocity - wanted).norm(), 1e-12);
    const Eigen::VectorXd first = ark.problem.task[0].jacobian.completeOrthogonalDecomposition().solve(
        Eigen::VectorXd(ark.problem.task[0].velocity));
    // The least joint change level by level, which is not always the least velocity for both.
    const Eigen::MatrixXd J = ark.problem.task[0].jacobian;
    const Eigen::MatrixXd free =
        Eigen::MatrixXd::Identity(12, 12) - J.completeOrthogonalDecomposition().pseudoInverse() * J;
    const Eigen::MatrixXd second = ark.problem.task[1].jacobian * free;
    const Eigen::VectorXd expected =
        first + second.completeOrthogonalDecomposition().pseudoInverse() *
                    (Eigen::VectorXd(ark.problem.task[1].velocity) - ark.problem.task[1].jacobian * first);
    EXPECT_LT((solution.velocity - expected).norm(), 1e-9 * (1.0 + expected.norm()));
    ++compared;
  }
  EXPECT_GT(compared, 100);
}

TEST(QpMethods, NextPositionStaysInsideEquationOne) {
  const auto resolver = control::makeResolver(Method::kSnsqp, {});
  ArkProblem ark;
  control::Solution solution;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 300; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    if (!ark.setRandom(random, 0.1))
      continue;  // far beyond the limits
    resolver->solve(ark.problem, solution);
    ASSERT_EQ(solution.status, SolveStatus::kSolved);
    for (int arm = 0; arm < 2; ++arm) {
      Eigen::VectorXd q(6);
      for (int j = 0; j < 6; ++j)
        q[j] = ark.problem.joint[6 * arm + j].position + 0.1 * solution.velocity[6 * arm + j];
      EXPECT_LE(safety::largestViolation(ark.limits, q), 1e-12);
    }
  }
}

TEST(QpMethods, BackendsAgree) {
  MethodParameters ipopt;
  ipopt.backend = control::Backend::kIpopt;
  for (const Method method : {Method::kNspqp, Method::kSnsqp}) {
    const auto ours = control::makeResolver(method, {}), judge = control::makeResolver(method, ipopt);
    ArkProblem ark;
    control::Solution a, b;
    for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 15; ++seed) {
      SCOPED_TRACE(trace(seed));
      Random random(seed);
      if (!ark.setRandom(random, kSpeed))
        continue;
      ours->solve(ark.problem, a);
      judge->solve(ark.problem, b);
      if (a.status != SolveStatus::kSolved || b.status != SolveStatus::kSolved)
        continue;
      // In sequential levels, the second one inherits Ipopt's error of the first, which nearly dependent rows enlarge.
      const double tolerance = method == Method::kSnsqp ? 2e-5 : 2e-7;
      EXPECT_LT((ark.problem.task[1].jacobian * (a.velocity - b.velocity)).norm(), tolerance) << control::name(method);
      EXPECT_NEAR(a.scale[1], b.scale[1], 1e-2);
    }
  }
}

TEST(VelocityBounds, FrozenIsThePapersFormulaLiterally) {
  ArkProblem ark;
  control::VelocityBounds bounds;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 200; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const Eigen::VectorXd q = randomInside(ark.limits, random);
    if (!ark.set(q, arkStart(0, 1), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()))
      continue;
    control::velocityBounds(ark.problem, control::BoundsKind::kFrozen, 0.1, bounds);
    const double length[] = {0.437, 0.317, 0.199};
    for (int i = 0; i < 3; ++i) {
      const double min = i == 0 ? -length[0] : std::max(-length[i], q[i - 1]);
      const double max = i == 0 ? 0.0 : std::min(q[i - 1] + length[i - 1] - length[i], 0.0);
      const double lower = std::max({(min - q[i]) / 0.1, -5e-3, -std::sqrt(2 * 1e-3 * std::max(0.0, q[i] - min))});
      const double upper = std::min({(max - q[i]) / 0.1, 5e-3, std::sqrt(2 * 1e-3 * std::max(0.0, max - q[i]))});
      EXPECT_NEAR(bounds.lower[i], std::min(0.0, lower), 1e-9);
      EXPECT_NEAR(bounds.upper[i], std::max(0.0, upper), 1e-9);
      EXPECT_EQ(bounds.upper[3 + i], safety::kUnlimited);
    }
  }
}

TEST(Nspwln, IsEquationSixAsPrinted) {
  // The printed matrices, implemented literally and inverted by LU.
  const MethodParameters p;
  const auto resolver = control::makeResolver(Method::kNspwln, p);
  ArkProblem ark;
  control::Solution solution;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 50; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    if (!ark.setRandom(random, kSpeed))
      continue;
    const auto weights = control::limitWeights(ark.problem, p, control::kAsPrinted);
    if (weights.maxCoeff() > 1e5)
      continue;  // at a limit the literal matrices lose all precision
    const auto inverse = [&](const Eigen::MatrixXd& J, int begin) {
      const Eigen::MatrixXd W = Eigen::VectorXd(weights.segment(begin, 6)).asDiagonal();
      return Eigen::MatrixXd(
          (p.track_weight * J.transpose() * J + W).fullPivLu().solve(p.track_weight * J.transpose()));
    };
    const Eigen::MatrixXd Jr = ark.problem.task[0].jacobian, Ja = ark.problem.task[1].jacobian;
    Eigen::MatrixXd inv(12, 3);
    inv << inverse(Jr.leftCols(6), 0), inverse(Jr.rightCols(6), 6);
    Eigen::VectorXd second = Eigen::VectorXd::Zero(12);
    second.head(6) = inverse(Ja.leftCols(6), 0) * ark.problem.task[1].velocity;
    const Eigen::VectorXd expected = inv * ark.problem.task[0].velocity + second - inv * (Jr * second);
    resolver->solve(ark.problem, solution);
    ASSERT_EQ(solution.status, SolveStatus::kSolved);
    EXPECT_LT((solution.velocity - expected).norm(), 1e-4 * (1e-3 + expected.norm()));
  }
}

TEST(Nspwln, AnswersThePrimaryTaskTwiceAndTheCorrectedLawOnce) {
  for (const auto& [method, factor] : {std::pair{Method::kNspwln, 2.0}, std::pair{Method::kNspwlnJoint, 1.0}}) {
    const auto resolver = control::makeResolver(method, {});
    ArkProblem ark;
    control::Solution solution;
    const Eigen::Vector3d v_ab(1e-3, -2e-3, 1e-3);
    ASSERT_TRUE(ark.set(arkStart(1, 0), arkStart(1, 1), v_ab, Eigen::Vector3d::Zero()));
    ark.problem.task_count = 1;
    resolver->solve(ark.problem, solution);
    const Eigen::Vector3d done = ark.problem.task[0].jacobian * solution.velocity;
    EXPECT_LT((done - factor * v_ab).norm(), 0.02 * v_ab.norm()) << control::name(method);
  }
}

TEST(NspwlnJoint, DoesBothTasks) {
  const auto resolver = control::makeResolver(Method::kNspwlnJoint, {});
  ArkProblem ark;
  control::Solution solution;
  ASSERT_TRUE(ark.set(arkStart(1, 0), arkStart(1, 1), {1e-3, 0, -1e-3}, {2e-3, 1e-3, 0}));
  resolver->solve(ark.problem, solution);
  EXPECT_LT(solution.residual[0], 1e-5);
  EXPECT_LT(solution.residual[1], 1e-4);
}

TEST(Nsp, SecondTaskDoesNotDisturbTheFirst) {
  MethodParameters p;
  p.nsp_damping = 1e-7;
  const auto resolver = control::makeResolver(Method::kNsp, p);
  ArkProblem ark;
  control::Solution solution;
  ASSERT_TRUE(ark.set(arkStart(1, 0), arkStart(1, 1), {1e-3, 0, -1e-3}, {2e-3, 1e-3, 0}));
  resolver->solve(ark.problem, solution);
  EXPECT_LT(solution.residual[0], 1e-9);
}

TEST(Resolver, RefusesNumbersThatAreNotFinite) {
  for (int m = 0; m < control::kMethodCount; ++m) {
    const auto resolver = control::makeResolver(static_cast<Method>(m), {});
    ArkProblem ark;
    control::Solution solution;
    ASSERT_TRUE(ark.set(arkStart(0, 0), arkStart(0, 1), {std::nan(""), 0, 0}, {0, 0, 0}));
    resolver->solve(ark.problem, solution);
    EXPECT_EQ(solution.status, SolveStatus::kNotFinite);
    EXPECT_TRUE(solution.velocity.isZero(0.0));
  }
  MethodParameters p;
  p.period = 0.0;
  EXPECT_THROW(control::makeResolver(Method::kNspqp, p), std::invalid_argument);
}

TEST(Resolver, AllocatesNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  expectStepsAllocateNothing([](ArkProblem& ark, Random& random) { return ark.setRandom(random, kSpeed); });
}

}  // namespace
}  // namespace tandem::test
