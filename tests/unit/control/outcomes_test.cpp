// SPDX-License-Identifier: Apache-2.0
/** @file Results of all methods at limits and singular poses. */
#include <gtest/gtest.h>

#include "control/conflict.h"
#include "control/detail/active_set.h"
#include "control/resolver.h"
#include "tests/unit/control/largest_share.h"
#include "tests/unit/support/ark_problem.h"

namespace tandem::test {
namespace {

using control::Method;
using control::MethodParameters;
using control::SolveStatus;

/// Random joints: inside, at corners of limits, in one plane, sometimes outside by some millimetres.
Eigen::VectorXd awkwardJoints(const safety::ArmLimits& limits, Random& random) {
  Eigen::VectorXd q = randomInside(limits, random);
  if (random.chance(0.2))
    q.tail(3).setConstant(q[3]);
  if (random.chance(0.3))
    q[1] = q[0];  // carriages that touch
  if (random.chance(0.2))
    q[2] = 0.0;
  if (random.chance(0.2))
    q[random.integer(0, 2)] += random.uniform(-5e-3, 5e-3);
  return q;
}

TEST(Outcomes, EveryProblemHasAnAnswerWithinTheLimits) {
  for (const Method method : {Method::kNspqp, Method::kSnsqp}) {
    const auto resolver = control::makeResolver(method, {});
    ArkProblem ark;
    control::Solution solution;
    int solved = 0, infeasible = 0;
    for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(2000); ++seed) {
      SCOPED_TRACE(trace(seed));
      Random random(seed);
      const double speed = std::pow(10.0, random.uniform(-4, -1));
      if (!ark.set(awkwardJoints(ark.limits, random), awkwardJoints(ark.limits, random), anyVector(random, speed),
                   anyVector(random, speed)))
        continue;
      resolver->solve(ark.problem, solution);
      ASSERT_TRUE(solution.status == SolveStatus::kSolved || solution.status == SolveStatus::kInfeasible)
          << control::name(solution.status);
      ASSERT_TRUE(method == Method::kNspqp || solution.status == SolveStatus::kSolved);
      (solution.status == SolveStatus::kSolved ? solved : infeasible) += 1;
      EXPECT_LT(excess(ark.problem, solution), 1e-10);
      EXPECT_LT(solution.kkt_residual, 1e-8);
      for (int j = 0; j < 12; ++j) {
        const bool rotation = ark.problem.joint[j].kind == control::JointKind::kRotation;
        EXPECT_TRUE(!rotation || std::abs(solution.velocity[j]) <= MethodParameters{}.rotation_velocity + 1e-9);
      }
      if (solution.status == SolveStatus::kInfeasible) {
        EXPECT_GT(solution.conflict.count, 0);
        EXPECT_FALSE(control::describe(ark.problem, solution.conflict, {"a", "b"}).empty());
      }
    }
    EXPECT_GT(solved, 500) << control::name(method);
    EXPECT_TRUE(method == Method::kSnsqp || infeasible > 100);
  }
}

/// No velocity within the limits achieves more of the infeasible task.
TEST(Outcomes, TheNearestVelocityIsTheNearest) {
  const auto resolver = control::makeResolver(Method::kNspqp, {});
  ArkProblem ark;
  control::Solution solution;
  int compared = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(300); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    if (!ark.set(randomInside(ark.limits, random), randomInside(ark.limits, random), anyVector(random, 0.05),
                 anyVector(random, 0.01)))
      continue;
    resolver->solve(ark.problem, solution);
    if (solution.status != SolveStatus::kInfeasible)
      continue;
    ++compared;
    const auto& task = ark.problem.task[0];
    const auto error = [&](const Eigen::VectorXd& qdot) { return (task.jacobian * qdot - task.velocity).norm(); };
    const double best = error(solution.velocity);
    EXPECT_LE(best, task.velocity.norm() + 1e-12);
    control::Solution other = solution;
    for (int k = 0; k < 200; ++k) {  // any other point of the feasible set, which is convex
      for (int j = 0; j < 12; ++j)
        other.velocity[j] = random.uniform(solution.bounds.lower[j], solution.bounds.upper[j]);
      double part = 1.0;
      while (part > 1e-3) {
        control::Solution nearby = solution;
        nearby.velocity = solution.velocity + part * (other.velocity - solution.velocity);
        if (excess(ark.problem, nearby) <= 1e-12) {
          EXPECT_GE(error(nearby.velocity), best - 1e-5 * task.velocity.norm());
          break;
        }
        part *= 0.5;
      }
    }
  }
  EXPECT_GT(compared, 50);
}

TEST(Outcomes, AnArmOutsideItsLimitsComesBack) {
  for (const Method method : {Method::kNspqp, Method::kSnsqp}) {
    const auto resolver = control::makeResolver(method, {});
    ArkProblem ark;
    control::Solution solution;
    int brought_back = 0;
    for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(40); ++seed) {
      SCOPED_TRACE(trace(seed));
      Random random(seed);
      Eigen::VectorXd q(12);
      q << randomInside(ark.limits, random), randomInside(ark.limits, random);
      q[random.integer(0, 2)] += random.uniform(-6e-3, 6e-3);
      q[6 + random.integer(0, 2)] += random.uniform(-6e-3, 6e-3);
      const auto violation = [&] {
        return std::max(safety::largestViolation(ark.limits, q.head(6)),
                        safety::largestViolation(ark.limits, q.tail(6)));
      };
      double before = violation();
      if (before < 1e-6)
        continue;
      for (int step = 0; step < 400 && violation() > 1e-9; ++step) {
        ark.problem.setPosition(q);  // no model has solutions everywhere outside the limits; any Jacobian is sufficient
        ark.problem.task_count = 2;
        for (control::Task& task : ark.problem.task) {
          task.jacobian = Eigen::MatrixXd::NullaryExpr(3, 12, [&] { return random.uniform(-1.0, 1.0); });
          task.velocity = anyVector(random, 2e-3);
        }
        resolver->solve(ark.problem, solution);
        ASSERT_TRUE(solution.status == SolveStatus::kSolved || solution.status == SolveStatus::kInfeasible);
        q += 0.1 * solution.velocity;
        EXPECT_LE(violation(), before + 1e-9) << "step " << step;
        before = violation();
      }
      EXPECT_LT(violation(), 1e-6);
      ++brought_back;
    }
    EXPECT_GT(brought_back, 10) << control::name(method);
  }
}

/// With a small zeta, the task scale of (8) is the largest feasible one: that of a linear programme, whose optimum is
/// proven by its multipliers.
TEST(Outcomes, SnsqpTaskScaleIsTheLargestThatTheLimitsAllow) {
  MethodParameters parameters;
  parameters.snsqp_zeta = 1e-6;
  const auto resolver = control::makeResolver(Method::kSnsqp, parameters);
  ArkProblem ark;
  control::Solution solution;
  control::ActiveSet solver;
  int slowed = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(500); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    if (!ark.setRandom(random, 0.5))
      continue;
    resolver->solve(ark.problem, solution);
    ASSERT_EQ(solution.status, SolveStatus::kSolved);
    control::QpSolution best;
    solver.solve(largestShare(ark.problem, solution.bounds), best);
    ASSERT_EQ(best.status, control::QpStatus::kSolved);
    ASSERT_LT(best.residual, 1e-9);
    EXPECT_NEAR(solution.scale[0], best.x[12], 1e-9);
    slowed += best.x[12] < 0.999 ? 1 : 0;
  }
  EXPECT_GT(slowed, 50);
}

/// All tubes in one plane, with a desired tip velocity straight towards the axis: where translations are blocked,
/// rotations have no first-order effect. At 1 mm/s a step moves at most 0.09 mm; far more steps than the distance
/// requires mean that the method waited for rounding errors to break the symmetry.
TEST(Outcomes, APlanarArmLeavesTheSaddleAtOnce) {
  struct Case {
    int configuration;
    double part;  ///< of the distance to the axis
    int steps;
  };
  for (const auto& [configuration, part, steps] :
       {Case{0, 0.5, 400}, Case{2, 0.5, 280}, Case{2, 0.9, 600}, Case{2, 1.2, 800}}) {
    for (const Method method : {Method::kNspqp, Method::kSnsqp}) {
      const auto resolver = control::makeResolver(method, {});
      ArkProblem ark;
      control::Solution solution;
      Eigen::VectorXd q(12);
      q << arkStart(configuration, 0), arkStart(configuration, 1);
      kinematics::Tip tip_a, tip_b;
      ASSERT_EQ(ark.a.tip(q.head(6), tip_a), kinematics::ModelStatus::kOk);
      ASSERT_EQ(ark.b.tip(q.tail(6), tip_b), kinematics::ModelStatus::kOk);
      const Eigen::Vector3d from = tip_a.pose.translation(), axis(0.0, 0.005, from.z());
      const Eigen::Vector3d goal = from + part * (axis - from), relative = from - tip_b.pose.translation();
      double error = 1.0;
      int step = 0;
      for (; step < 2000 && error > 1e-4; ++step) {
        ASSERT_EQ(ark.a.tip(q.head(6), tip_a), kinematics::ModelStatus::kOk);
        ASSERT_EQ(ark.b.tip(q.tail(6), tip_b), kinematics::ModelStatus::kOk);
        const Eigen::Vector3d to_go = goal - tip_a.pose.translation();
        error = to_go.norm();
        const Eigen::Vector3d ab = relative - (tip_a.pose.translation() - tip_b.pose.translation());
        ASSERT_TRUE(ark.set(q.head(6), q.tail(6), 5.0 * ab, 3.0 * to_go.normalized() * std::min(error, 3e-4)));
        resolver->solve(ark.problem, solution);
        q += 0.1 * solution.velocity;
        q.head(3) = q.head(3).cwiseMin(0.0);  // rounding
        q.segment(6, 3) = q.segment(6, 3).cwiseMin(0.0);
      }
      EXPECT_LT(step, steps) << control::name(method) << ", configuration " << configuration << ", " << part;
    }
  }
}

}  // namespace
}  // namespace tandem::test
