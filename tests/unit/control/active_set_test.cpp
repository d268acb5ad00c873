// SPDX-License-Identifier: Apache-2.0
#include "control/active_set.h"

#include <gtest/gtest.h>

#include "control/ipopt_backend.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::test {
namespace {

using control::QpStatus;

double objective(const control::QuadraticProgram& qp, const control::QpVector& x) {
  return 0.5 * x.dot(qp.H * x) + qp.g.dot(x);
}

/// A strictly convex problem around a point that satisfies all constraints.
control::QuadraticProgram feasibleProblem(Random& random) {
  const int n = random.integer(2, 14), equalities = random.integer(0, n / 3), rows = random.integer(0, 10);
  control::QuadraticProgram qp;
  qp.resize(n, equalities, rows);
  const auto entry = [&] { return random.uniform(-1.0, 1.0); };
  const Eigen::MatrixXd root = Eigen::MatrixXd::NullaryExpr(n, n, entry);
  qp.H = root.transpose() * root + std::pow(10.0, random.uniform(-6, 0)) * Eigen::MatrixXd::Identity(n, n);
  qp.g = Eigen::VectorXd::NullaryExpr(n, entry);
  const Eigen::VectorXd inside = Eigen::VectorXd::NullaryExpr(n, entry);
  if (equalities > 0)
    qp.E = Eigen::MatrixXd::NullaryExpr(equalities, n, entry);
  if (equalities > 0)
    qp.e = qp.E * inside;
  if (rows > 0)
    qp.A = Eigen::MatrixXd::NullaryExpr(rows, n, entry);
  for (int i = 0; i < rows; ++i)
    qp.b[i] = qp.A.row(i).dot(inside) + (random.chance(0.3) ? 0.0 : random.uniform(0, 0.5));
  for (int i = 0; i < n; ++i) {
    if (random.chance(0.7))
      qp.lower[i] = inside[i] - (random.chance(0.2) ? 0.0 : random.uniform(0, 0.5));
    if (random.chance(0.7))
      qp.upper[i] = inside[i] + (random.chance(0.2) ? 0.0 : random.uniform(0, 0.5));
  }
  return qp;
}

TEST(ActiveSet, SatisfiesTheOptimalityConditions) {
  control::ActiveSet solver;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 2000; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto qp = feasibleProblem(random);
    control::QpSolution solution;
    solver.solve(qp, solution);
    ASSERT_EQ(solution.status, QpStatus::kSolved);
    EXPECT_LT(control::kktResidual(qp, solution), 1e-8);
  }
}

TEST(ActiveSet, AgreesWithIpopt) {
  control::ActiveSet solver;
  control::IpoptBackend judge;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 60; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto qp = feasibleProblem(random);
    control::QpSolution ours, theirs;
    solver.solve(qp, ours);
    judge.solve(qp, theirs);
    ASSERT_EQ(ours.status, QpStatus::kSolved);
    if (theirs.status != QpStatus::kSolved)
      continue;  // zero-width feasible sets have no interior: Ipopt may give up
    const double scale = 1.0 + std::abs(objective(qp, theirs.x));
    EXPECT_NEAR(objective(qp, ours.x), objective(qp, theirs.x), 1e-6 * scale);
  }
}

TEST(ActiveSet, WarmStartChangesStepsNotAnswers) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 100; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    auto qp = feasibleProblem(random);
    control::ActiveSet warm;
    control::QpSolution a, b;
    warm.solve(qp, a);
    qp.g *= 1.01;
    warm.solve(qp, a);
    control::ActiveSet cold;
    cold.solve(qp, b);
    ASSERT_EQ(a.status, b.status);
    EXPECT_LT((a.x - b.x).norm(), 1e-6 * (1.0 + b.x.norm()));
  }
}

TEST(ActiveSet, SaysWhatIsInfeasible) {
  control::QuadraticProgram qp;
  control::ActiveSet solver;
  control::QpSolution solution;
  qp.resize(2, 0, 1);
  qp.H.setIdentity();
  qp.lower << 1.0, 1.0;
  qp.A << 1.0, 1.0;
  qp.b << 1.5;  // x + y <= 1.5 with x, y >= 1
  solver.solve(qp, solution);
  EXPECT_EQ(solution.status, QpStatus::kInfeasible);

  qp.resize(2, 2, 0);
  qp.H.setIdentity();
  qp.E << 1, 1, 2, 2;
  qp.e << 1, 3;  // contradict each other
  solver.solve(qp, solution);
  EXPECT_EQ(solution.status, QpStatus::kInfeasible);
  qp.e << 1, 2;  // the same twice
  solver.solve(qp, solution);
  ASSERT_EQ(solution.status, QpStatus::kSolved);
  EXPECT_NEAR(solution.x[0], 0.5, 1e-12);

  qp.resize(1, 0, 0);
  qp.H << 1.0;
  qp.lower << 2.0;
  qp.upper << 1.0;
  solver.solve(qp, solution);
  EXPECT_EQ(solution.status, QpStatus::kInfeasible);
}

TEST(ActiveSet, RefusesWhatIsNoConvexProblem) {
  control::QuadraticProgram qp;
  control::ActiveSet solver;
  control::QpSolution solution;
  qp.resize(2, 0, 0);
  qp.H << 1, 0, 0, -1;
  solver.solve(qp, solution);
  EXPECT_EQ(solution.status, QpStatus::kNotConvex);
  qp.H << 1, 0, 0, std::nan("");
  solver.solve(qp, solution);
  EXPECT_EQ(solution.status, QpStatus::kNotFinite);
}

}  // namespace
}  // namespace tandem::test
