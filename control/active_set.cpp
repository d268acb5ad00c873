// SPDX-License-Identifier: Apache-2.0
#include "control/active_set.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::control {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
/// A normal whose part outside the span of the active ones is smaller than this share of it counts as dependent.
constexpr double kDependent = 1e-11;
/// Relative size of a violation that rounding explains, of a constraint by itself and against the largest variable.
constexpr double kRounding = 1e-13, kGlobalRounding = 1e-14;
/// A violation of this size against the largest variable, which no step can reduce, is rounding that has added up where
/// more constraints meet than there are dimensions; a larger one is infeasibility.
constexpr double kUnreachable = 1e-10;

}  // namespace

ActiveSet::Constraint ActiveSet::decode(int id) const {
  if (id < equalities_)
    return {Kind::kEquality, id};
  id -= equalities_;
  if (id < n_)
    return {Kind::kLower, id};
  id -= n_;
  if (id < n_)
    return {Kind::kUpper, id};
  return {Kind::kRow, id - n_};
}

double ActiveSet::slack(int id) const {
  const auto [kind, i] = decode(id);
  switch (kind) {
    case Kind::kEquality:
      return qp_->E.row(i).dot(x_) - qp_->e[i];
    case Kind::kLower:
      return x_[i] - qp_->lower[i];
    case Kind::kUpper:
      return qp_->upper[i] - x_[i];
    case Kind::kRow:
      return qp_->b[i] - qp_->A.row(i).dot(x_);
  }
  return 0.0;
}

double ActiveSet::slackTolerance(int id) const {
  const auto [kind, i] = decode(id);
  const double global = kGlobalRounding * size_;
  switch (kind) {
    case Kind::kEquality:
      return global + kRounding * (std::abs(qp_->e[i]) + qp_->E.row(i).cwiseAbs().dot(x_.cwiseAbs()));
    case Kind::kLower:
      return global + kRounding * (std::abs(qp_->lower[i]) + std::abs(x_[i]));
    case Kind::kUpper:
      return global + kRounding * (std::abs(qp_->upper[i]) + std::abs(x_[i]));
    case Kind::kRow:
      return global + kRounding * (std::abs(qp_->b[i]) + qp_->A.row(i).cwiseAbs().dot(x_.cwiseAbs()));
  }
  return 0.0;
}

void ActiveSet::loadNormal(int id) {
  const auto [kind, i] = decode(id);
  switch (kind) {
    case Kind::kEquality:
      normal_ = qp_->E.row(i).transpose();
      break;
    case Kind::kLower:
      normal_.setZero(n_);
      normal_[i] = 1.0;
      break;
    case Kind::kUpper:
      normal_.setZero(n_);
      normal_[i] = -1.0;
      break;
    case Kind::kRow:
      normal_ = -qp_->A.row(i).transpose();
      break;
  }
  direction_.noalias() = J_.transpose().lazyProduct(normal_);
}

bool ActiveSet::prepare() {
  // H = L L^T, J = L^-T, x = -H^-1 g = -J J^T g.
  R_ = qp_->H;
  for (int j = 0; j < n_; ++j) {
    double pivot = R_(j, j);
    for (int k = 0; k < j; ++k)
      pivot -= R_(j, k) * R_(j, k);
    if (!(pivot > 0.0))
      return false;
    const double root = std::sqrt(pivot);
    R_(j, j) = root;
    for (int i = j + 1; i < n_; ++i) {
      double sum = R_(i, j);
      for (int k = 0; k < j; ++k)
        sum -= R_(i, k) * R_(j, k);
      R_(i, j) = sum / root;
    }
  }
  J_.setZero(n_, n_);
  for (int c = 0; c < n_; ++c) {  // J^T = L^-1: forward substitution, column c of L^-1 is row c of J
    for (int i = c; i < n_; ++i) {
      double sum = i == c ? 1.0 : 0.0;
      for (int k = c; k < i; ++k)
        sum -= R_(i, k) * J_(c, k);
      J_(c, i) = sum / R_(i, i);
    }
  }
  direction_.noalias() = J_.transpose().lazyProduct(qp_->g);
  x_.noalias() = -(J_.lazyProduct(direction_));
  R_.setZero(n_, n_);
  return true;
}

void ActiveSet::steps() {
  // Primal direction: J_2 J_2^T n; change of the active multipliers: -R^-1 J_1^T n.
  step_.setZero(n_);
  for (int j = active_count_; j < n_; ++j) {
    for (int i = 0; i < n_; ++i)
      step_[i] += J_(i, j) * direction_[j];
  }
  dual_step_.resize(active_count_);
  for (int i = active_count_ - 1; i >= 0; --i) {
    double sum = direction_[i];
    for (int j = i + 1; j < active_count_; ++j)
      sum -= R_(i, j) * dual_step_[j];
    dual_step_[i] = sum / R_(i, i);
  }
}

bool ActiveSet::pushActive(int id, double multiplier) {
  // Rotates direction_'s tail into its first entry; the same rotations on J's columns.
  for (int j = n_ - 1; j > active_count_; --j) {
    const double a = direction_[j - 1], b = direction_[j];
    if (b == 0.0)
      continue;
    const double h = std::hypot(a, b);
    const double c = a / h, s = b / h;
    direction_[j - 1] = h;
    direction_[j] = 0.0;
    for (int i = 0; i < n_; ++i) {
      const double left = J_(i, j - 1), right = J_(i, j);
      J_(i, j - 1) = c * left + s * right;
      J_(i, j) = c * right - s * left;
    }
  }
  if (direction_[active_count_] == 0.0)
    return false;
  for (int i = 0; i <= active_count_; ++i)
    R_(i, active_count_) = direction_[i];
  active_[active_count_] = id;
  multiplier_[active_count_] = multiplier;
  is_active_[id] = true;
  ++active_count_;
  return true;
}

void ActiveSet::dropActive(int position) {
  is_active_[active_[position]] = false;
  for (int j = position; j + 1 < active_count_; ++j) {
    active_[j] = active_[j + 1];
    multiplier_[j] = multiplier_[j + 1];
    for (int i = 0; i <= j + 1; ++i)
      R_(i, j) = R_(i, j + 1);
  }
  --active_count_;
  for (int j = position; j < active_count_; ++j) {
    const double a = R_(j, j), b = R_(j + 1, j);
    if (b == 0.0)
      continue;
    const double h = std::hypot(a, b);
    const double c = a / h, s = b / h;
    for (int k = j; k < active_count_; ++k) {
      const double up = R_(j, k), down = R_(j + 1, k);
      R_(j, k) = c * up + s * down;
      R_(j + 1, k) = c * down - s * up;
    }
    for (int i = 0; i < n_; ++i) {
      const double left = J_(i, j), right = J_(i, j + 1);
      J_(i, j) = c * left + s * right;
      J_(i, j + 1) = c * right - s * left;
    }
  }
}

QpStatus ActiveSet::addEqualities() {
  for (int id = 0; id < equalities_; ++id) {
    loadNormal(id);
    const double residual = slack(id);
    steps();
    double outside = 0.0, whole = 0.0;
    for (int j = 0; j < n_; ++j) {
      whole += direction_[j] * direction_[j];
      if (j >= active_count_)
        outside += direction_[j] * direction_[j];
    }
    if (outside <= kDependent * kDependent * whole) {  // says again what others say, or contradicts them
      const double scale = std::abs(qp_->e[id]) + qp_->E.row(id).cwiseAbs().dot(x_.cwiseAbs());
      if (std::abs(residual) > 1e-9 * std::max(scale, 1e-12))
        return QpStatus::kInfeasible;
      continue;
    }
    const double length = -residual / outside;
    x_ += length * step_;
    for (int i = 0; i < active_count_; ++i)
      multiplier_[i] -= length * dual_step_[i];
    if (!pushActive(id, length))
      return QpStatus::kFailed;
    ++active_equalities_;
  }
  return QpStatus::kSolved;
}

int ActiveSet::mostViolated() {
  size_ = x_.cwiseAbs().maxCoeff();
  int worst = -1, worst_warm = -1;
  double amount = 0.0, amount_warm = 0.0;
  for (int id = equalities_; id < constraints_; ++id) {
    if (is_active_[id] || is_met_[id])
      continue;
    const double s = slack(id);
    if (!(s < 0.0) || s >= -slackTolerance(id))
      continue;
    if (s < amount) {
      amount = s;
      worst = id;
    }
    if (was_active_[id] && s < amount_warm) {
      amount_warm = s;
      worst_warm = id;
    }
  }
  return worst_warm >= 0 ? worst_warm : worst;
}

void ActiveSet::save(State& state) const {
  state.J = J_;
  state.R = R_;
  state.x = x_;
  state.multiplier = multiplier_;
  state.active = active_;
  state.is_active = is_active_;
  state.active_count = active_count_;
}

void ActiveSet::restore(const State& state) {
  J_ = state.J;
  R_ = state.R;
  x_ = state.x;
  multiplier_ = state.multiplier;
  active_ = state.active;
  is_active_ = state.is_active;
  active_count_ = state.active_count;
}

QpStatus ActiveSet::enforce(int id) {
  double multiplier = 0.0;
  const bool perhaps_met = slack(id) >= -kUnreachable * size_;
  if (perhaps_met)
    save(before_);
  for (;;) {
    if (++iterations_ > iteration_limit_)
      return QpStatus::kIterationLimit;
    loadNormal(id);
    steps();
    // Longest dual step before a multiplier of an inequality turns negative.
    double dual_length = kInf;
    int blocking = -1;
    for (int i = active_equalities_; i < active_count_; ++i) {
      if (dual_step_[i] <= 0.0)
        continue;
      const double length = multiplier_[i] / dual_step_[i];
      if (length < dual_length) {
        dual_length = length;
        blocking = i;
      }
    }
    double outside = 0.0, whole = 0.0;
    for (int j = 0; j < n_; ++j) {
      whole += direction_[j] * direction_[j];
      if (j >= active_count_)
        outside += direction_[j] * direction_[j];
    }
    const bool reachable = outside > kDependent * kDependent * whole;
    const double primal_length = reachable ? -slack(id) / outside : kInf;
    const double length = std::min(dual_length, primal_length);
    if (!std::isfinite(length)) {
      if (!perhaps_met)
        return QpStatus::kInfeasible;
      restore(before_);  // the steps made for it balance a multiplier that it will not have
      is_met_[id] = true;
      return QpStatus::kSolved;
    }
    if (reachable)
      x_ += length * step_;
    for (int i = 0; i < active_count_; ++i)
      multiplier_[i] -= length * dual_step_[i];
    multiplier += length;
    if (reachable && primal_length <= dual_length) {
      return pushActive(id, multiplier) ? QpStatus::kSolved : QpStatus::kFailed;
    }
    dropActive(blocking);
  }
}

QpStatus ActiveSet::addInequalities() {
  for (;;) {
    const int id = mostViolated();
    if (id < 0)
      return QpStatus::kSolved;
    const QpStatus status = enforce(id);
    if (status != QpStatus::kSolved)
      return status;
  }
}

void ActiveSet::report(QpSolution& solution) {
  solution.x = x_;
  solution.y.setZero(equalities_);
  solution.z.setZero(n_);
  solution.w.setZero(rows_);
  for (int k = 0; k < active_count_; ++k) {
    const auto [kind, i] = decode(active_[k]);
    switch (kind) {
      case Kind::kEquality:
        solution.y[i] = -multiplier_[k];
        break;
      case Kind::kLower:
        solution.z[i] -= multiplier_[k];
        solution.x[i] = qp_->lower[i];
        break;
      case Kind::kUpper:
        solution.z[i] += multiplier_[k];
        solution.x[i] = qp_->upper[i];
        break;
      case Kind::kRow:
        solution.w[i] = multiplier_[k];
        break;
    }
  }
  // What rounding left outside a bound is not worth a multiplier, but it must not reach the joints either.
  for (int i = 0; i < n_; ++i)
    solution.x[i] = std::clamp(solution.x[i], qp_->lower[i], qp_->upper[i]);
}

void ActiveSet::solve(const QuadraticProgram& qp, QpSolution& solution) noexcept {
  qp_ = &qp;
  n_ = qp.variables();
  equalities_ = qp.equalities();
  rows_ = qp.rows();
  constraints_ = equalities_ + 2 * n_ + rows_;
  if (remembered_ != constraints_)
    was_active_.fill(false);
  is_active_.fill(false);
  is_met_.fill(false);
  active_count_ = active_equalities_ = iterations_ = 0;
  iteration_limit_ = 20 * (n_ + constraints_);
  multiplier_.setZero(n_);

  solution.x.setZero(n_);
  solution.y.setZero(equalities_);
  solution.z.setZero(n_);
  solution.w.setZero(rows_);
  const bool finite = qp.H.allFinite() && qp.g.allFinite() && qp.E.allFinite() && qp.e.allFinite() &&
                      qp.A.allFinite() && !qp.b.hasNaN() && !qp.lower.hasNaN() && !qp.upper.hasNaN();
  if (!finite) {
    solution.status = QpStatus::kNotFinite;
  } else if ((qp.lower.array() > qp.upper.array()).any()) {
    solution.status = QpStatus::kInfeasible;
  } else if (!prepare()) {
    solution.status = QpStatus::kNotConvex;
  } else {
    solution.status = addEqualities();
    if (solution.status == QpStatus::kSolved)
      solution.status = addInequalities();
  }
  solution.iterations = iterations_ + active_equalities_;
  remembered_ = 0;
  if (solution.status == QpStatus::kSolved) {
    report(solution);
    was_active_ = is_active_;
    remembered_ = constraints_;
  }
  qp_ = nullptr;
}

}  // namespace tandem::control
