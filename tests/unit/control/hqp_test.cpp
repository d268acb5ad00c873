// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <cstdio>

#include "control/quadratic_program.h"
#include "control/resolver.h"
#include "control/velocity_bounds.h"
#include "tests/unit/support/ark_problem.h"

namespace tandem::test {
namespace {

using control::Method;
using control::MethodParameters;
using control::SolveStatus;

constexpr double kSpeed = 3e-3;  // m/s

/// Least singular value of Jacobians, translations weighed as by hqp, m/rad: how far from singular.
double leastLever(Eigen::MatrixXd J) {
  for (const int j : {0, 1, 2, 6, 7, 8})
    J.col(j) *= MethodParameters{}.spread_distance;
  return Eigen::JacobiSVD<Eigen::MatrixXd>(J).singularValues().minCoeff();
}

constexpr double kReserve = 0.02;  ///< what a task leaves to those after it

/// The linear programme max s, J qdot = s v inside all limits, by the interior-point judge.
double largestShare(const control::StepProblem& problem, const control::VelocityBounds& bounds) {
  const int n = problem.joint_count;
  control::QuadraticProgram lp;
  lp.resize(n + 1, 3, bounds.row_count);
  lp.g[n] = -1.0;
  lp.H.diagonal().setConstant(1e-9);
  lp.E.leftCols(n) = problem.task[0].jacobian;
  lp.E.col(n) = -problem.task[0].velocity;
  lp.lower << bounds.lower, 0.0;
  lp.upper << bounds.upper, 1.0 / (1.0 - kReserve);
  for (int i = 0; i < bounds.row_count; ++i) {
    lp.A(i, problem.row[i].first) = problem.row[i].a_first;
    lp.A(i, problem.row[i].second) = problem.row[i].a_second;
    lp.b[i] = bounds.row_rate[i];
  }
  control::QpSolution solution;
  const auto judge = control::makeQpBackend(control::Backend::kIpopt);
  judge->solve(lp, solution);
  return solution.status == control::QpStatus::kSolved ? solution.x[n] : std::nan("");
}

TEST(Hqp, KeepsLimitsAndOptimalityEverywhere) {
  const auto resolver = control::makeResolver(Method::kHqp, {});
  for (const double speed : {kSpeed, 0.1}) {
    ArkProblem ark;
    control::Solution solution;
    for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 500; ++seed) {
      SCOPED_TRACE(trace(seed));
      Random random(seed);
      if (!ark.setRandom(random, speed))
        continue;
      resolver->solve(ark.problem, solution);
      ASSERT_EQ(solution.status, SolveStatus::kSolved);
      EXPECT_LT(excess(ark.problem, solution), 1e-9);
      EXPECT_LT(solution.kkt_residual, 1e-8);
    }
  }
}

TEST(Hqp, ScaleOfTheFirstTaskIsThatOfTheLinearProgramme) {
  MethodParameters exact;
  exact.hqp_zeta = 1e-6;
  const auto resolver = control::makeResolver(Method::kHqp, exact);
  ArkProblem ark;
  control::Solution solution;
  int compared = 0, limited = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 150; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    if (!ark.setRandom(random, 0.3) || leastLever(ark.problem.task[0].jacobian) < 2e-3)
      continue;
    resolver->solve(ark.problem, solution);
    ASSERT_EQ(solution.status, SolveStatus::kSolved);
    const double expected = largestShare(ark.problem, solution.bounds);
    ASSERT_TRUE(std::isfinite(expected));
    EXPECT_NEAR(solution.scale[0], (1.0 - kReserve) * expected, 1e-5);
    // All of that share, in the task's own direction.
    const Eigen::VectorXd done = ark.problem.task[0].jacobian * solution.velocity;
    EXPECT_LT((done - solution.scale[0] * ark.problem.task[0].velocity).norm(), 1e-8);
    ++compared;
    limited += expected < 0.99 ? 1 : 0;
  }
  EXPECT_GT(compared, 50);
  EXPECT_GT(limited, 20);
}

TEST(Hqp, ALowerTaskNeverChangesAHigherOne) {
  const auto resolver = control::makeResolver(Method::kHqp, {});
  ArkProblem ark;
  control::Solution with, without;
  int compared = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 300; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    if (!ark.setRandom(random, 0.03))
      continue;
    resolver->solve(ark.problem, with);
    const Eigen::VectorXd first = ark.problem.task[0].jacobian * with.velocity;
    // Another second task, as far away as can be, must not be felt by the first one.
    ark.problem.task[1].velocity *= -20.0;
    resolver->solve(ark.problem, without);
    const Eigen::VectorXd again = ark.problem.task[0].jacobian * without.velocity;
    EXPECT_NEAR(with.scale[0], without.scale[0], 1e-9);
    EXPECT_LT((first - again).norm(), 1e-8);
    ++compared;
  }
  EXPECT_GT(compared, 200);
}

/// A motion through many switches of active limits: joints and tasks change smoothly with t.
bool setAlong(ArkProblem& ark, const Eigen::VectorXd& q, const Eigen::VectorXd& d, const Eigen::Matrix3d& v, double t) {
  const Eigen::VectorXd at = q + t * d;
  const Eigen::Vector3d along = std::sin(3.0 * t) * v.col(0) + std::cos(2.0 * t) * v.col(1);
  return ark.set(at.head(6), at.tail(6), along, v.col(2) * std::cos(t) + v.col(0));
}

TEST(Hqp, IsContinuousWhereActiveLimitsSwitch) {
  const auto resolver = control::makeResolver(Method::kHqp, {});
  // The largest jump between neighbouring steps falls with the step, as that of a continuous function does.
  std::array<double, 2> jump{};
  int switches = 0;
  for (int refinement = 0; refinement < 2; ++refinement) {
    const int steps = refinement == 0 ? 400 : 6400;
    for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 12; ++seed) {
      Random random(seed);
      ArkProblem ark;
      Eigen::VectorXd q(12), d(12);
      q << randomInside(ark.limits, random), randomInside(ark.limits, random);
      for (int j = 0; j < 12; ++j)
        d[j] = (j % 6 < 3 ? 1e-3 : 0.3) * random.uniform(-1.0, 1.0);
      Eigen::Matrix3d v;
      v << anyVector(random, 0.05), anyVector(random, 0.05), anyVector(random, 0.05);
      control::Solution solution;
      Eigen::VectorXd before;
      int active = -1;
      for (int i = 0; i <= steps; ++i) {
        if (!setAlong(ark, q, d, v, static_cast<double>(i) / steps)) {
          before.resize(0);
          continue;
        }
        // Near singular poses the least damped direction alone makes steep slopes.
        Eigen::MatrixXd both(6, 12);
        both << ark.problem.task[0].jacobian, ark.problem.task[1].jacobian;
        if (leastLever(both) < 3e-3) {
          before.resize(0);
          continue;
        }
        resolver->solve(ark.problem, solution);
        ASSERT_EQ(solution.status, SolveStatus::kSolved) << trace(seed);
        if (before.size() > 0) {
          jump[static_cast<std::size_t>(refinement)] =
              std::max(jump[static_cast<std::size_t>(refinement)], (solution.velocity - before).cwiseAbs().maxCoeff());
          switches += active != solution.active_count ? 1 : 0;
        }
        before = solution.velocity;
        active = solution.active_count;
      }
    }
  }
  std::printf("  largest jump: %.3g at 400 steps, %.3g at 6400; %d switches\n", jump[0], jump[1], switches);
  EXPECT_GT(switches, 20);
  EXPECT_LT(jump[1], 0.25 * jump[0]);
}

TEST(Hqp, KeepsMarginsAheadOfAllTasks) {
  const auto resolver = control::makeResolver(Method::kHqp, {});
  ArkProblem ark;
  control::Solution free, kept;
  int bound = 0, grown = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 300; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    ark.problem.barrier_count = 0;
    if (!ark.setRandom(random, 0.03))
      continue;
    resolver->solve(ark.problem, free);
    // One margin that the motion would take away, and one that has to grow.
    ark.problem.barrier_count = 2;
    for (int i = 0; i < 2; ++i) {
      ark.problem.barrier[static_cast<std::size_t>(i)].gradient.resize(12);
      for (int j = 0; j < 12; ++j)
        ark.problem.barrier[static_cast<std::size_t>(i)].gradient[j] = random.uniform(-1.0, 1.0);
    }
    auto& margin = ark.problem.barrier[0];
    margin.rate = -0.3 * std::abs(margin.gradient.dot(free.velocity));
    ark.problem.barrier[1].rate = 0.05;
    resolver->solve(ark.problem, kept);
    ASSERT_EQ(kept.status, SolveStatus::kSolved);
    EXPECT_LT(excess(ark.problem, kept), 1e-9);
    EXPECT_GE(margin.gradient.dot(kept.velocity), margin.rate - 1e-9);
    bound += margin.gradient.dot(free.velocity) < margin.rate ? 1 : 0;
    // 0.05/s can always be had: six rotations may turn at 2 rad/s.
    EXPECT_GE(ark.problem.barrier[1].gradient.dot(kept.velocity), 0.05 - 1e-6);
    ++grown;
  }
  EXPECT_GT(bound, 50);
  EXPECT_GT(grown, 200);
}

}  // namespace
}  // namespace tandem::test
