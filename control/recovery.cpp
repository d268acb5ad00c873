// SPDX-License-Identifier: Apache-2.0
#include "control/recovery.h"

#include <algorithm>

namespace tandem::control {
namespace {

constexpr double kLeast = 1e-8;  ///< eps
/// Relative relaxation of a bound, so that rounding does not make it infeasible.
constexpr double kBoundRounding = 1e-9;

}  // namespace

void Recovery::limit(const StepProblem& problem, const VelocityBounds& bounds) {
  const int n = problem.joint_count;
  qp_.resize(n, 0, bounds.row_count);
  qp_.H.diagonal().setConstant(kLeast);
  const auto want = [&](int j, double wanted) {
    qp_.H(j, j) += 1.0;
    qp_.g[j] -= wanted;
  };
  for (int j = 0; j < n; ++j) {
    const double most = problem.joint[j].velocity;
    qp_.lower[j] = bounds.lower[j] > 0.0 ? 0.0 : bounds.lower[j];
    qp_.upper[j] = bounds.upper[j] < 0.0 ? 0.0 : bounds.upper[j];
    qp_.lower[j] = std::max(qp_.lower[j], -most);
    qp_.upper[j] = std::min(qp_.upper[j], most);
    if (bounds.lower[j] > 0.0)
      want(j, bounds.lower[j]);
    if (bounds.upper[j] < 0.0)
      want(j, bounds.upper[j]);
  }
  for (int i = 0; i < bounds.row_count; ++i) {
    const CoupledRow& row = problem.row[i];
    qp_.A(i, row.first) = row.a_first;
    qp_.A(i, row.second) = row.a_second;
    qp_.b[i] = std::max(0.0, bounds.row_rate[i]);
    if (bounds.row_rate[i] >= 0.0)
      continue;
    qp_.H(row.first, row.first) += row.a_first * row.a_first;
    qp_.H(row.second, row.second) += row.a_second * row.a_second;
    qp_.H(row.first, row.second) += row.a_first * row.a_second;
    qp_.H(row.second, row.first) += row.a_first * row.a_second;
    qp_.g[row.first] -= row.a_first * bounds.row_rate[i];
    qp_.g[row.second] -= row.a_second * bounds.row_rate[i];
  }
}

void Recovery::apply(const StepProblem& problem, VelocityBounds& bounds, RobotVector& velocity) noexcept {
  velocity.setZero(problem.joint_count);
  bool outside = (bounds.lower.array() > 0.0).any() || (bounds.upper.array() < 0.0).any();
  for (int i = 0; i < bounds.row_count; ++i)
    outside = outside || bounds.row_rate[i] < 0.0;
  if (!outside)
    return;
  limit(problem, bounds);
  backend_->solve(qp_, solution_);
  if (solution_.status == QpStatus::kSolved)
    velocity = solution_.x;
  const auto nearly = [](double value) { return (1.0 - kBoundRounding) * value; };
  for (int j = 0; j < problem.joint_count; ++j) {
    if (bounds.lower[j] > 0.0)
      bounds.lower[j] = std::min(bounds.lower[j], nearly(velocity[j]));
    if (bounds.upper[j] < 0.0)
      bounds.upper[j] = std::max(bounds.upper[j], nearly(velocity[j]));
  }
  for (int i = 0; i < bounds.row_count; ++i) {
    const CoupledRow& row = problem.row[i];
    if (bounds.row_rate[i] < 0.0) {
      const double rate = row.a_first * velocity[row.first] + row.a_second * velocity[row.second];
      bounds.row_rate[i] = std::max(bounds.row_rate[i], nearly(rate));
    }
  }
}

}  // namespace tandem::control
