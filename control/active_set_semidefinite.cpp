// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "control/detail/active_set.h"

namespace tandem::control {

/// Removes accumulated rounding from the solution; for problems with values of magnitude one.
void ActiveSet::polish(double shift) {
  for (int k = 0; k < factors_.active(); ++k)
    normal_[k] = slack(active_[k]);
  factors_.meet(normal_, x_);
  const QpVector gradient = qp_->H.lazyProduct(x_) + shift * x_ + gradient_;
  factors_.descend(gradient, x_, multiplier_);
}

/// Whether a direction is feasible without bound, has no cost in H, and decreases the objective. @param negligible
/// fraction of the direction below which entries count as zero
bool ActiveSet::isUnbounded(const QpVector& displacement, double negligible) const {
  const double small = negligible * displacement.cwiseAbs().maxCoeff();
  if (!(qp_->g.dot(displacement) < -small * qp_->g.cwiseAbs().maxCoeff()))
    return false;
  for (int i = 0; i < n_; ++i) {
    if (std::abs(qp_->H.row(i).dot(displacement)) > small ||
        (displacement[i] > small && std::isfinite(qp_->upper[i])) ||
        (displacement[i] < -small && std::isfinite(qp_->lower[i])))
      return false;
  }
  for (int j = 0; j < equalities_; ++j) {
    if (std::abs(qp_->E.row(j).dot(displacement)) > small)
      return false;
  }
  for (int j = 0; j < rows_; ++j) {
    if (qp_->A.row(j).dot(displacement) > small)
      return false;
  }
  return true;
}

/// The proximal point method on a problem with values of magnitude one.
QpStatus ActiveSet::solveSemidefinite() {
  constexpr double kFirstShift = 1e-3, kLastShift = 1e-6, kConverged = 1e-11;
  constexpr int kMaxRounds = 60, kStrictRounds = 10;
  double shift = kFirstShift;
  QpVector last = QpVector::Zero(n_);
  for (int round = 0; round < kMaxRounds; ++round) {
    gradient_ = qp_->g - shift * last;
    iteration_limit_ = iterations_ + 20 * (n_ + constraints_);
    if (const QpStatus status = solveStrictly(shift); status != QpStatus::kSolved)
      return status;
    remember();
    const QpVector displacement = x_ - last;
    const double size = std::max(qp_->g.cwiseAbs().maxCoeff(), x_.cwiseAbs().maxCoeff());
    if (shift * displacement.cwiseAbs().maxCoeff() <= kConverged * size)
      return QpStatus::kSolved;
    // A variable that moves slowly towards a distant bound hides an unbounded one.
    if (isUnbounded(displacement, round < kStrictRounds ? 1e-7 : 1e-4))
      return QpStatus::kUnbounded;
    last = x_;
    shift = std::max(kLastShift, 0.1 * shift);
  }
  return QpStatus::kIterationLimit;
}

}  // namespace tandem::control
