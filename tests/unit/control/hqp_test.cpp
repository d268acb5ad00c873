// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <cstdio>

#include "control/resolver.h"
#include "control/velocity_bounds.h"
#include "tests/unit/control/largest_share.h"
#include "tests/unit/support/ark_problem.h"

namespace tandem::test {
namespace {

using control::Method;
using control::MethodParameters;
using control::SolveStatus;

constexpr double kTaskSpeed = 3e-3;  // m/s

/// Least singular value of Jacobians, translations weighted as in hqp, m/rad: distance from singularity.
double leastLever(Eigen::MatrixXd J) {
  for (const int j : {0, 1, 2, 6, 7, 8})
    J.col(j) *= MethodParameters{}.spread_distance;
  return Eigen::JacobiSVD<Eigen::MatrixXd>(J).singularValues().minCoeff();
}

constexpr double kReserve = 0.02;  ///< share that a task leaves to lower-priority ones

/// The largest scale of the first task, computed with the interior-point solver.
double largestShareOf(const control::StepProblem& problem, const control::VelocityBounds& bounds) {
  control::QpSolution solution;
  const auto judge = control::makeQpBackend(control::Backend::kIpopt);
  judge->solve(largestShare(problem, bounds, 1.0 / (1.0 - kReserve), 1e-9), solution);
  return solution.status == control::QpStatus::kSolved ? solution.x[problem.joint_count] : std::nan("");
}

TEST(Hqp, KeepsLimitsAndOptimalityEverywhere) {
  const auto resolver = control::makeResolver(Method::kHqp, {});
  for (const double speed : {kTaskSpeed, 0.1}) {
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
    const double expected = largestShareOf(ark.problem, solution.bounds);
    ASSERT_TRUE(std::isfinite(expected));
    EXPECT_NEAR(solution.scale[0], (1.0 - kReserve) * expected, 1e-5);
    // Exactly that share, in the task's direction.
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
    // A very different second task must not affect the first one.
    ark.problem.task[1].velocity *= -20.0;
    resolver->solve(ark.problem, without);
    const Eigen::VectorXd again = ark.problem.task[0].jacobian * without.velocity;
    EXPECT_NEAR(with.scale[0], without.scale[0], 1e-9);
    EXPECT_LT((first - again).norm(), 1e-8);
    ++compared;
  }
  EXPECT_GT(compared, 200);
}

/// A motion with many changes of the active limits: joints and tasks change smoothly with t.
bool setAlong(ArkProblem& ark, const Eigen::VectorXd& q, const Eigen::VectorXd& d, const Eigen::Matrix3d& v, double t) {
  const Eigen::VectorXd at = q + t * d;
  const Eigen::Vector3d along = std::sin(3.0 * t) * v.col(0) + std::cos(2.0 * t) * v.col(1);
  return ark.set(at.head(6), at.tail(6), along, v.col(2) * std::cos(t) + v.col(0));
}

/// A sequence of problems with their solutions.
struct Motion {
  ArkProblem ark;
  Eigen::VectorXd q{12}, d{12};
  Eigen::Matrix3d v;
  std::unique_ptr<control::Resolver> resolver = control::makeResolver(Method::kHqp, {});

  explicit Motion(Random& random) {
    q << randomInside(ark.limits, random), randomInside(ark.limits, random);
    for (int j = 0; j < 12; ++j)
      d[j] = (j % 6 < 3 ? 1e-3 : 0.3) * random.uniform(-1.0, 1.0);
    v << anyVector(random, 0.05), anyVector(random, 0.05), anyVector(random, 0.05);
  }

  struct Answer {
    double t = 0.0;
    Eigen::MatrixXd jacobian{6, 12};  ///< of both tasks, for which the velocity is the solution
    Eigen::VectorXd velocity;
    int active = 0;
  };
  /// False if the model has no solution.
  bool at(double t, Answer& answer) {
    if (!setAlong(ark, q, d, v, t))
      return false;
    control::Solution solution;
    resolver->solve(ark.problem, solution);
    EXPECT_EQ(solution.status, SolveStatus::kSolved);
    answer.t = t;
    answer.jacobian << ark.problem.task[0].jacobian, ark.problem.task[1].jacobian;
    answer.velocity = solution.velocity;
    answer.active = solution.active_count;
    return true;
  }
};

double jump(const Motion::Answer& a, const Motion::Answer& b) {
  return (a.velocity - b.velocity).cwiseAbs().maxCoeff();
}

/// Bisection between two different solutions, with the larger difference: a continuous change, however steep, converges
/// to zero, a jump remains.
void closeIn(Motion& motion, double different, Motion::Answer& low, Motion::Answer& high) {
  constexpr int kHalvings = 36;
  Motion::Answer middle;
  for (int k = 0; k < kHalvings && jump(low, high) > different; ++k) {
    if (!motion.at(0.5 * (low.t + high.t), middle))
      return;
    (jump(low, middle) > jump(middle, high) ? high : low) = middle;
  }
}

TEST(Hqp, IsContinuousWhereActiveLimitsSwitch) {
  constexpr int kSteps = 400;
  // More than the perturbation that moves planar arms out of their plane, 1e-4 rad per period in either direction
  // (resolver.cpp).
  constexpr double kDifferent = 2.5e-3;
  int switches = 0, followed = 0, singular = 0, jumps_of_the_model = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 24; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Motion motion(random);
    Motion::Answer before, next;
    bool known = false;
    for (int i = 0; i <= kSteps; ++i) {
      const bool answered = motion.at(static_cast<double>(i) / kSteps, next);
      if (known && answered && jump(before, next) > kDifferent) {
        Motion::Answer low = before, high = next;
        closeIn(motion, kDifferent, low, high);
        // A rigid arm's Jacobian jumps where tube ends pass each other: no method can be continuous there.
        const bool model = jump(low, high) > kDifferent && (low.jacobian - high.jacobian).cwiseAbs().maxCoeff() > 1e-6;
        jumps_of_the_model += model ? 1 : 0;
        EXPECT_TRUE(model || jump(low, high) <= kDifferent)
            << "t = " << low.t << " + " << high.t - low.t << ": " << jump(low, high) << ", least lever "
            << leastLever(low.jacobian) << ", " << low.active << " and " << high.active << " limits";
        ++followed;
        singular += leastLever(low.jacobian) < 1e-6 ? 1 : 0;
      }
      switches += known && answered && before.active != next.active ? 1 : 0;
      before = next;
      known = answered;
    }
  }
  std::printf("  %d switches of limits; %d changes closed in on, %d of them at singular poses, %d the model's own\n",
              switches, followed, singular, jumps_of_the_model);
  EXPECT_GT(switches, 20);
  EXPECT_GT(followed, 300);
  EXPECT_LT(jumps_of_the_model, followed / 10);
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
    // One margin that the motion would reduce, and one that has to grow.
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
    // 0.05/s is always feasible: six rotations may turn at 2 rad/s.
    EXPECT_GE(ark.problem.barrier[1].gradient.dot(kept.velocity), 0.05 - 1e-6);
    ++grown;
  }
  EXPECT_GT(bound, 50);
  EXPECT_GT(grown, 200);
}

}  // namespace
}  // namespace tandem::test
