// SPDX-License-Identifier: Apache-2.0
#include "control/quadratic_program.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "control/detail/active_set.h"
#include "control/detail/ipopt_backend.h"
#include "control/detail/sized.h"

namespace tandem::control {

void QuadraticProgram::resize(int variables, int equalities, int rows) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  H.setZero(variables, variables);
  g.setZero(variables);
  E.setZero(equalities, variables);
  e.setZero(equalities);
  lower.setConstant(variables, -kInf);
  upper.setConstant(variables, kInf);
  A.setZero(rows, variables);
  b.setZero(rows);
}

std::string_view describe(QpStatus status) {
  switch (status) {
    case QpStatus::kSolved:
      return "solved";
    case QpStatus::kInfeasible:
      return "infeasible";
    case QpStatus::kUnbounded:
      return "unbounded";
    case QpStatus::kIterationLimit:
      return "iteration limit";
    case QpStatus::kNotConvex:
      return "not convex";
    case QpStatus::kNotFinite:
      return "not finite";
    case QpStatus::kFailed:
      return "failed";
  }
  return "unknown";
}

double kktResidual(const QuadraticProgram& qp, const QpSolution& s) noexcept {
  const int n = qp.variables();
  double largest = 0.0, size = 1e-300;
  withSize(n, [&]<int N>() {
    using Array = Eigen::Array<double, N, 1, Eigen::ColMajor, N == Eigen::Dynamic ? kMaxVariables : N, 1>;
    Array sum = sized<N>(qp.g.data(), n), sizes = sum.abs();
    const auto add = [&](const Array& term) {
      sum += term;
      sizes = sizes.max(term.abs());
    };
    add(sized<N>(s.z.data(), n));
    for (int j = 0; j < n; ++j)
      add(s.x[j] * sized<N>(&qp.H(0, j), n).array());  // H is symmetric
    for (int j = 0; j < qp.equalities(); ++j)
      add(s.y[j] * qp.E.row(j).transpose().array());
    for (int j = 0; j < qp.rows(); ++j) {
      if (s.w[j] != 0.0)
        add(s.w[j] * qp.A.row(j).transpose().array());
    }
    largest = n > 0 ? sum.abs().maxCoeff() : 0.0;
    size = n > 0 ? std::max(size, sizes.maxCoeff()) : size;
  });
  double worst = largest / size;
  const double x_size = std::max(s.x.size() > 0 ? s.x.cwiseAbs().maxCoeff() : 0.0, 1e-6);
  double dual_size = std::max(s.z.size() > 0 ? s.z.cwiseAbs().maxCoeff() : 0.0, 1e-30);
  for (int j = 0; j < qp.rows(); ++j)
    dual_size = std::max(dual_size, std::abs(s.w[j]));
  const auto primal = [&](double violation) { worst = std::max(worst, violation / x_size); };
  const auto complementary = [&](double multiplier, double slack) {
    worst = std::max(worst, std::min(std::abs(multiplier) / dual_size, std::abs(slack) / x_size));
  };
  for (int j = 0; j < qp.equalities(); ++j)
    primal(std::abs(qp.E.row(j).dot(s.x) - qp.e[j]));
  for (int i = 0; i < n; ++i) {
    primal(std::max(qp.lower[i] - s.x[i], s.x[i] - qp.upper[i]));
    if (s.z[i] > 0.0)
      complementary(s.z[i], qp.upper[i] - s.x[i]);
    if (s.z[i] < 0.0)
      complementary(s.z[i], s.x[i] - qp.lower[i]);
  }
  const RowVector slacks = qp.b - qp.A.lazyProduct(s.x);
  for (int j = 0; j < qp.rows(); ++j) {
    const double slack = slacks[j];
    primal(-slack);
    worst = std::max(worst, -s.w[j] / dual_size);
    complementary(s.w[j], slack);
  }
  return worst;
}

double certificateResidual(const QuadraticProgram& qp, const QpSolution& s) noexcept {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  if (s.crossed >= 0)
    return qp.lower[s.crossed] > qp.upper[s.crossed] ? 0.0 : kInf;
  double worst = 0.0, size = 1e-300, value = 0.0, value_size = 1e-300;
  for (int i = 0; i < qp.variables(); ++i) {
    double sum = s.z[i];
    size = std::max(size, std::abs(s.z[i]));
    for (int j = 0; j < qp.equalities(); ++j) {
      sum += qp.E(j, i) * s.y[j];
      size = std::max(size, std::abs(qp.E(j, i) * s.y[j]));
    }
    for (int j = 0; j < qp.rows(); ++j) {
      sum += qp.A(j, i) * s.w[j];
      size = std::max(size, std::abs(qp.A(j, i) * s.w[j]));
    }
    worst = std::max(worst, std::abs(sum));
  }
  worst /= size;
  const auto add = [&](double multiplier, double bound) {
    if (multiplier == 0.0)
      return;
    value += multiplier * bound;
    value_size = std::max(value_size, std::abs(multiplier * bound));
  };
  for (int i = 0; i < qp.variables(); ++i)
    add(s.z[i], s.z[i] > 0.0 ? qp.upper[i] : qp.lower[i]);
  for (int j = 0; j < qp.equalities(); ++j)
    add(s.y[j], qp.e[j]);
  for (int j = 0; j < qp.rows(); ++j) {
    add(s.w[j], qp.b[j]);
    worst = std::max(worst, -s.w[j] / size);
  }
  return value < -1e-12 * value_size ? worst : kInf;
}

bool provesInfeasible(const QuadraticProgram& qp, const QpSolution& s) noexcept {
  constexpr double kRounding = 1e-10, kDistinct = 1e-9;
  if (!(s.w.array() >= 0.0).all())
    return false;
  QpVector sum = s.z;
  double largest = s.z.size() > 0 ? s.z.cwiseAbs().maxCoeff() : 0.0;
  double least = 0.0, sizes = 0.0;  // of r^T x - c, and of its terms
  const auto subtract = [&](double multiplier, double bound) {
    least -= multiplier * bound;
    sizes += std::abs(multiplier * bound);
  };
  const auto add = [&](double multiplier, const auto& row, double bound) {
    if (multiplier == 0.0)
      return;
    for (int i = 0; i < sum.size(); ++i) {
      const double term = multiplier * row[i];
      sum[i] += term;
      largest = std::max(largest, std::abs(term));
    }
    subtract(multiplier, bound);
  };
  for (int j = 0; j < qp.equalities(); ++j)
    add(s.y[j], qp.E.row(j), qp.e[j]);
  for (int j = 0; j < qp.rows(); ++j)
    add(s.w[j], qp.A.row(j), qp.b[j]);
  for (int i = 0; i < sum.size(); ++i) {
    if (!(std::abs(sum[i]) <= kRounding * largest))
      return false;
    if (s.z[i] != 0.0)
      subtract(s.z[i], s.z[i] > 0.0 ? qp.upper[i] : qp.lower[i]);
    const double bound = sum[i] > 0.0 ? qp.lower[i] : qp.upper[i];
    if (std::isfinite(bound))
      subtract(-sum[i], bound);
  }
  return least > kDistinct * sizes;
}

std::unique_ptr<QpBackend> makeQpBackend(Backend backend) {
  if (backend == Backend::kIpopt)
    return std::make_unique<IpoptBackend>();
  return std::make_unique<ActiveSet>();
}

}  // namespace tandem::control
