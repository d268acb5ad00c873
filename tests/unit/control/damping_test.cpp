// SPDX-License-Identifier: Apache-2.0
/** @file Closed-form methods near singular poses. */
#include "control/damping.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include "control/limit_weights.h"
#include "control/resolver.h"
#include "tests/unit/support/ark_problem.h"

namespace tandem::test {
namespace {

using control::Method;
using control::MethodParameters;

Eigen::MatrixXd orthogonal(int n, Random& random) {
  return Eigen::MatrixXd(Eigen::MatrixXd::NullaryExpr(n, n, [&] { return random.uniform(-1, 1); }))
      .householderQr()
      .householderQ();
}

TEST(Damping, BoundsTheGainAndTouchesNothingAboveTheThreshold) {
  constexpr double kThreshold = 0.02;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 2000; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Eigen::MatrixXd sigma = Eigen::MatrixXd::Zero(3, 6);
    double least = 1.0;
    for (int i = 0; i < 3; ++i)
      least = std::min(least, sigma(i, i) = random.chance(0.1) ? 0.0 : std::pow(10.0, random.uniform(-6, 1)));
    const Eigen::MatrixXd A = orthogonal(3, random) * sigma * orthogonal(6, random);
    const control::TaskGram plain = A * A.transpose();
    control::TaskGram damped = plain;
    control::dampSingularDirections(plain, kThreshold, damped);
    if (least > 1.001 * kThreshold) {
      EXPECT_EQ(damped, plain);
    }
    const Eigen::MatrixXd inverse = A.transpose() * damped.llt().solve(Eigen::MatrixXd::Identity(3, 3));
    EXPECT_LE(Eigen::JacobiSVD<Eigen::MatrixXd>(inverse).singularValues()[0],
              2.0 / (std::sqrt(3.0) * kThreshold) * (1.0 + 1e-6));
  }
}

/// Straight arms, arms in one plane, arms almost withdrawn: a step moves the tips by at most twice the requested
/// distance (nspwln assigns the first task to both arms), and no tube turns faster than rotation_velocity.
TEST(Damping, StepsStayInTheTrustRegionNearSingularPoses) {
  const MethodParameters parameters;
  for (int m = 0; m < control::kMethodCount; ++m) {
    const auto method = static_cast<Method>(m);
    const auto resolver = control::makeResolver(method, parameters);
    ArkProblem ark;
    control::Solution solution;
    int singular = 0;
    for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 600; ++seed) {
      SCOPED_TRACE(trace(seed));
      Random random(seed);
      Eigen::VectorXd q_a = randomInside(ark.limits, random), q_b = randomInside(ark.limits, random);
      const double off = random.chance(0.5) ? 0.0 : std::pow(10.0, random.uniform(-8, -2));
      for (Eigen::VectorXd* q : {&q_a, &q_b}) {
        if (random.chance(0.5))
          q->tail(3).setConstant((*q)[3]);
        if (random.chance(0.5))
          q->head(3) << -0.431, -0.3125, -0.1965;  // a few mm are extended: rotations hardly move the tip
        for (int j = 3; j < 6; ++j)
          (*q)[j] += off * random.uniform(-1, 1);
      }
      const Eigen::Vector3d v_ab(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
      const Eigen::Vector3d v_a(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
      const double speed = 3e-3;
      if (!ark.set(q_a, q_b, speed * v_ab, speed * v_a))
        continue;
      const control::TaskJacobian own = ark.problem.task[1].jacobian.leftCols(6);
      const control::TaskGram plain = control::plainGram(ark.problem, parameters, 0, own);
      const double least = Eigen::SelfAdjointEigenSolver<control::TaskGram>(plain).eigenvalues()[0];
      singular += least < std::pow(control::singularThreshold(parameters), 2) ? 1 : 0;
      resolver->solve(ark.problem, solution);
      ASSERT_TRUE(solution.velocity.allFinite());
      const double asked = speed * (v_ab.norm() + v_a.norm());
      // (3) projects the solution of the second task alone into the null space of the first, which may reverse it.
      for (int k = 0; k < 2 && method != Method::kNsp; ++k)
        EXPECT_LE((ark.problem.task[k].jacobian * solution.velocity).norm(), 4.0 * asked) << control::name(method);
      for (int j = 0; j < 12; ++j) {
        if (ark.problem.joint[j].kind == control::JointKind::kRotation) {
          EXPECT_LE(std::abs(solution.velocity[j]), parameters.rotation_velocity + 1e-9) << control::name(method);
        }
      }
    }
    EXPECT_GT(singular, 100) << control::name(method);
  }
}

}  // namespace
}  // namespace tandem::test
