// SPDX-License-Identifier: Apache-2.0
#include "control/detail/active_set.h"

namespace tandem::control {

void ActiveSet::remember() {
  remembered_active_ = 0;
  for (int k = active_equalities_; k < factors_.active(); ++k)
    remembered_id_[remembered_active_++] = active_[k];
}

/** Warm start: activates the inequalities of the last solution together and solves once. Those whose multipliers are
 * then negative are dropped; what is left is the optimum of a smaller problem, as every iterate is. The slacks are
 * those at the point before, from which the multipliers follow. */
void ActiveSet::recall() {
  constexpr double kIndependent = 1e-7;  // as kDependent, with a reserve: what is left out is added later if necessary
  if (remembered_active_ == 0)
    return;
  recalled_slack_.setZero(n_);
  for (int k = 0; k < remembered_active_ && factors_.active() < n_; ++k) {
    const int id = remembered_id_[k];
    takeNormal(id);
    if (factors_.outside() <= kIndependent * kIndependent * factors_.whole())
      continue;
    recalled_slack_[factors_.active()] = slack(id);
    if (activate(id, 0.0))
      ++iterations_;
  }
  while (factors_.active() > active_equalities_) {
    recalled_x_ = x_;
    const QpVector& added = factors_.meet(recalled_slack_, recalled_x_);
    const int before = factors_.active();
    recalled_multiplier_ = multiplier_ + added;
    for (int i = before - 1; i >= active_equalities_; --i) {
      if (recalled_multiplier_[i] >= 0.0)
        continue;
      for (int j = i; j + 1 < factors_.active(); ++j)
        recalled_slack_[j] = recalled_slack_[j + 1];
      drop(i);
    }
    if (factors_.active() < before)
      continue;
    x_ = recalled_x_;
    multiplier_ = recalled_multiplier_;
    return;
  }
}

/// Solves the problem with H + shift I and gradient_; without a warm start if it fails with one.
QpStatus ActiveSet::solveStrictly(double shift) {
  QpStatus status = solveFrom(shift);
  if (status != QpStatus::kSolved && remembered_active_ > 0) {
    remembered_active_ = 0;
    status = solveFrom(shift);
  }
  if (status == QpStatus::kSolved && qp_ == &scaled_.program())
    polish(shift);
  return status;
}

QpStatus ActiveSet::solveFrom(double shift) {
  is_active_.fill(false);
  is_met_.fill(false);
  active_equalities_ = 0;
  if (!factors_.factorise(qp_->H, shift, remembered_active_ > 0))
    return QpStatus::kNotConvex;
  normal_.resize(n_);
  factors_.unconstrainedMinimum(gradient_, x_);
  size_ = 0.0;
  const QpStatus status = addEqualities();
  if (status != QpStatus::kSolved)
    return status;
  recall();
  return addInequalities();
}

}  // namespace tandem::control
