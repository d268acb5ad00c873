// SPDX-License-Identifier: Apache-2.0
#include "control/detail/active_set.h"

#include <gtest/gtest.h>

#include <cmath>

#include "control/detail/ipopt_backend.h"
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
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(2000); ++seed) {
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

/// A warm start has the active constraints at once, also where they have changed, and never needs many more steps.
TEST(ActiveSet, WarmStartTakesUpTheActiveConstraintsTogether) {
  int cold_steps = 0, warm_steps = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(2000); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    auto qp = feasibleProblem(random);
    control::ActiveSet warm, cold;
    control::QpSolution ours, expected;
    warm.solve(qp, ours);
    const double change = std::pow(10.0, random.uniform(-3.0, 1.0));  // up to programmes of other active constraints
    for (int i = 0; i < qp.variables(); ++i)
      qp.g[i] += change * random.uniform(-1.0, 1.0);
    warm.solve(qp, ours);
    cold.solve(qp, expected);
    ASSERT_EQ(ours.status, QpStatus::kSolved);
    EXPECT_LT(control::kktResidual(qp, ours), 1e-8);
    EXPECT_LT((ours.x - expected.x).norm(), 1e-6 * (1.0 + expected.x.norm()));
    cold_steps += expected.iterations;
    warm_steps += ours.iterations;
  }
  EXPECT_LT(warm_steps, 1.2 * cold_steps);
}

/// Properties of real problems: a rank-deficient Hessian, dependent rows or rows of twelve orders of magnitude, bounds
/// of zero width.
control::QuadraticProgram awkwardProblem(Random& random) {
  auto qp = feasibleProblem(random);
  const int n = qp.variables();
  if (random.chance(0.5)) {  // of rank r, down to none at all: a linear programme
    const int rank = random.integer(0, n - 1);
    const Eigen::MatrixXd root = Eigen::MatrixXd::NullaryExpr(rank, n, [&] { return random.uniform(-1.0, 1.0); });
    qp.H.setZero();
    if (rank > 0)
      qp.H = root.transpose() * root;
  }
  for (int i = 0; i < qp.rows(); ++i) {
    if (i > 0 && random.chance(0.3)) {
      const double factor = std::pow(10.0, random.uniform(-3, 3));
      qp.A.row(i) = factor * qp.A.row(i - 1);
      qp.b[i] = factor * qp.b[i - 1];
    }
  }
  if (random.chance(0.5)) {
    for (int i = 0; i < n; ++i) {  // different units for every variable
      const double unit = std::pow(10.0, random.uniform(-3, 3));
      qp.H.row(i) *= unit;
      qp.H.col(i) *= unit;
      qp.g[i] *= unit;
      qp.E.col(i) *= unit;
      qp.A.col(i) *= unit;
      qp.lower[i] /= unit;
      qp.upper[i] /= unit;
    }
  }
  return qp;
}

TEST(ActiveSet, SolvesDegenerateProblems) {
  control::ActiveSet solver;
  int unbounded = 0, solved = 0, given_up = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(3000); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto qp = awkwardProblem(random);
    control::QpSolution solution;
    solver.solve(qp, solution);
    if (solution.status == QpStatus::kIterationLimit) {
      ++given_up;
      continue;
    }
    ASSERT_TRUE(solution.status == QpStatus::kSolved || solution.status == QpStatus::kUnbounded)
        << control::describe(solution.status);
    if (solution.status == QpStatus::kUnbounded) {
      ++unbounded;
      const bool boxed = qp.lower.allFinite() && qp.upper.allFinite();
      EXPECT_FALSE(boxed);
      continue;
    }
    ++solved;
    const double raw = control::kktResidual(qp, solution);
    control::ScaledProgram scaled;
    scaled.set(qp);
    scaled.scale(solution);
    EXPECT_LT(std::min(raw, control::kktResidual(scaled.program(), solution)), 1e-8);
  }
  EXPECT_LE(given_up, static_cast<int>(cases(3000) / 3000));
  EXPECT_GT(solved, unbounded);
  EXPECT_GT(unbounded, 10);
}

/// Problems made infeasible by a random certificate, which need not be the one that the solver finds.
control::QuadraticProgram contradiction(Random& random) {
  auto qp = feasibleProblem(random);
  const int n = qp.variables(), last = qp.rows() - 1;
  if (last < 0)
    return qp;
  // The last row is minus a combination of others, and requires slightly more than they permit.
  qp.A.row(last).setZero();
  qp.b[last] = 0.0;
  const auto use = [&](const auto& row, double bound, double weight) {
    qp.A.row(last) -= weight * row;
    qp.b[last] -= weight * bound;
  };
  for (int i = 0; i < last; ++i)
    use(qp.A.row(i), qp.b[i], random.chance(0.5) ? random.uniform(0.1, 1.0) : 0.0);
  for (int i = 0; i < qp.equalities(); ++i)
    use(qp.E.row(i), qp.e[i], random.uniform(-1.0, 1.0));
  for (int i = 0; i < n; ++i) {
    const Eigen::RowVectorXd unit = Eigen::RowVectorXd::Unit(n, i);
    if (std::isfinite(qp.upper[i]) && random.chance(0.5))
      use(unit, qp.upper[i], random.uniform(0.1, 1.0));
    else if (std::isfinite(qp.lower[i]) && random.chance(0.5))
      use(-unit, -qp.lower[i], random.uniform(0.1, 1.0));
  }
  qp.b[last] -= std::pow(10.0, random.uniform(-5, 0));
  return qp;
}

TEST(ActiveSet, ProvesInfeasibility) {
  control::ActiveSet solver;
  control::IpoptBackend judge;
  int judged = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(3000); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    auto qp = contradiction(random);
    if (qp.rows() == 0 || qp.A.row(qp.rows() - 1).norm() < 1e-3)
      continue;
    control::QpSolution solution;
    solver.solve(qp, solution);
    ASSERT_EQ(solution.status, QpStatus::kInfeasible) << control::describe(solution.status);
    EXPECT_LT(control::certificateResidual(qp, solution), 1e-8);
    if (seed % 500 == 0) {
      control::QpSolution theirs;
      judge.solve(qp, theirs);
      EXPECT_NE(theirs.status, QpStatus::kSolved);
      ++judged;
    }
  }
  EXPECT_GT(judged, 2);
}

/// Farkas' lemma by plain arithmetic: largest entry of the sum of all constraints relative to its largest term, the sum
/// of their bounds, and by how much it is below zero relative to its terms; -1 with a multiplier of an inequality below
/// zero.
struct PlainCertificate {
  long double sum = 0.0L, value = 0.0L, below = 0.0L;

  PlainCertificate(const control::QuadraticProgram& qp, const control::QpSolution& s) {
    long double size = 1e-300L, values = 1e-300L;
    const auto add = [&](long double multiplier, long double bound) {
      if (multiplier == 0.0L)
        return;
      value += multiplier * bound;
      values += std::abs(multiplier * bound);
    };
    for (int i = 0; i < qp.variables(); ++i) {
      long double entry = s.z[i];
      size = std::max(size, std::abs(entry));
      const auto take = [&](long double term) {
        entry += term;
        size = std::max(size, std::abs(term));
      };
      for (int j = 0; j < qp.equalities(); ++j)
        take(static_cast<long double>(qp.E(j, i)) * s.y[j]);
      for (int j = 0; j < qp.rows(); ++j)
        take(static_cast<long double>(qp.A(j, i)) * s.w[j]);
      sum = std::max(sum, std::abs(entry));
      add(s.z[i], s.z[i] > 0.0 ? qp.upper[i] : qp.lower[i]);
    }
    for (int j = 0; j < qp.equalities(); ++j)
      add(s.y[j], qp.e[j]);
    for (int j = 0; j < qp.rows(); ++j)
      add(s.w[j], qp.b[j]);
    sum /= size;
    below = (s.w.array() < 0.0).any() ? -1.0L : -value / values;
  }
};

TEST(ActiveSet, CertificatesAreRightByPlainArithmetic) {
  control::ActiveSet solver;
  int count = 0, steps = 0, feasible_steps = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(3000); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    auto qp = contradiction(random);
    const int last = qp.rows() - 1;
    if (qp.rows() == 0 || qp.A.row(last).norm() < 1e-3)
      continue;
    control::QpSolution solution, wrong, apart;
    solver.solve(qp, solution);
    EXPECT_TRUE(control::provesInfeasible(qp, solution));
    const PlainCertificate plain(qp, solution);
    EXPECT_LT(plain.sum, 1e-10L);
    EXPECT_GT(plain.below, 1e-9L);
    ++count;
    steps += solution.iterations;

    wrong = solution;
    wrong.y *= -1.0;
    wrong.z *= -1.0;
    wrong.w *= -1.0;
    EXPECT_FALSE(control::provesInfeasible(qp, wrong)) << "of the other sign";
    wrong = solution;
    wrong.w[last] *= 1.001;
    EXPECT_FALSE(control::provesInfeasible(qp, wrong)) << "the sum of the constraints is not zero";
    ASSERT_GT(solution.w[last], 0.0);
    qp.b[last] -= static_cast<double>(plain.value / solution.w[last]);
    EXPECT_FALSE(control::provesInfeasible(qp, solution)) << "the constraints touch";
    qp.b[last] += 0.1;
    solver.solve(qp, apart);
    feasible_steps += apart.iterations;
  }
  EXPECT_GT(count, 1000);
  EXPECT_LT(steps, 1.5 * feasible_steps) << "without a second attempt";
}

TEST(ActiveSet, NoMultipliersProveThatAFeasibleProgrammeHasNoSolution) {
  control::ActiveSet solver;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(3000); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto qp = random.chance(0.5) ? feasibleProblem(random) : awkwardProblem(random);
    control::QpSolution solution;
    solver.solve(qp, solution);
    EXPECT_NE(solution.status, QpStatus::kInfeasible);
    EXPECT_FALSE(control::provesInfeasible(qp, solution));
    for (int trial = 0; trial < 5; ++trial) {
      // Any multipliers of rows and equalities, and those of bounds that make the sum zero: the strongest of that kind.
      for (int j = 0; j < qp.equalities(); ++j)
        solution.y[j] = random.uniform(-1.0, 1.0);
      for (int j = 0; j < qp.rows(); ++j)
        solution.w[j] = random.chance(0.5) ? random.uniform(0.0, 1.0) : 0.0;
      solution.z = -qp.E.transpose() * solution.y - qp.A.transpose() * solution.w;
      EXPECT_FALSE(control::provesInfeasible(qp, solution));
    }
  }
}

TEST(ActiveSet, NamesTheInfeasibleConstraints) {
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

TEST(ActiveSet, RefusesNonConvexProblems) {
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
