// SPDX-License-Identifier: Apache-2.0
#include "control/detail/active_set.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::control {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
/// A normal counts as dependent if its part outside the span of the active ones is smaller than this fraction of it.
constexpr double kDependent = 1e-11;
/// Violation due to rounding, relative to the constraint's own terms and to the largest variable.
constexpr double kRowRounding = 1e-13, kGlobalRounding = 1e-14;
/// A violation of this size relative to the largest variable, which no step can reduce, is accumulated rounding where
/// more constraints are active than there are dimensions; a larger one is infeasibility.
constexpr double kUnreachable = 1e-10;
/// Residual of a solution that is accepted without a second attempt.
constexpr double kExact = 5e-9;

/// Whether all values are finite: zero times an infinite value or NaN is not zero.
bool finite(const auto& numbers) { return (numbers.array() * 0.0).sum() == 0.0; }

bool finite(const QuadraticProgram& qp) {
  return finite(qp.H) && finite(qp.g) && finite(qp.E) && finite(qp.e) && finite(qp.A) && !qp.b.hasNaN() &&
         !qp.lower.hasNaN() && !qp.upper.hasNaN();
}

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
      return global + kRowRounding * (std::abs(qp_->e[i]) + qp_->E.row(i).cwiseAbs().dot(x_.cwiseAbs()));
    case Kind::kLower:
      return global + kRowRounding * (std::abs(qp_->lower[i]) + std::abs(x_[i]));
    case Kind::kUpper:
      return global + kRowRounding * (std::abs(qp_->upper[i]) + std::abs(x_[i]));
    case Kind::kRow:
      return global + kRowRounding * (std::abs(qp_->b[i]) + qp_->A.row(i).cwiseAbs().dot(x_.cwiseAbs()));
  }
  return 0.0;
}

void ActiveSet::takeNormal(int id) {
  const auto [kind, i] = decode(id);
  switch (kind) {
    case Kind::kEquality:
      normal_ = qp_->E.row(i).transpose();
      factors_.take(normal_);
      break;
    case Kind::kLower:
      factors_.takeUnit(i, 1.0);
      break;
    case Kind::kUpper:
      factors_.takeUnit(i, -1.0);
      break;
    case Kind::kRow:
      normal_ = -qp_->A.row(i).transpose();
      factors_.take(normal_);
      break;
  }
}

void ActiveSet::moveMultipliers(const QpVector& dual_step, double length) {
  for (int i = 0; i < factors_.active(); ++i)
    multiplier_[i] -= length * dual_step[i];
}

bool ActiveSet::activate(int id, double multiplier) {
  const int position = factors_.active();
  if (!factors_.append())
    return false;
  active_[position] = id;
  multiplier_[position] = multiplier;
  is_active_[id] = true;
  return true;
}

void ActiveSet::drop(int position) {
  is_active_[active_[position]] = false;
  for (int j = position; j + 1 < factors_.active(); ++j) {
    active_[j] = active_[j + 1];
    multiplier_[j] = multiplier_[j + 1];
  }
  factors_.remove(position);
}

/// n = sum of dual_step_i n_i, an unsatisfiable combination: these multipliers are the certificate.
void ActiveSet::certify(int id, double sign, const QpVector& dual_step) {
  certified_ = factors_.active() + 1;
  for (int i = 0; i < factors_.active(); ++i)
    multiplier_[i] = -sign * dual_step[i];
  // With all n_ dimensions active the certificate has one entry too many: the smallest moves to extra_entry_.
  if (certified_ > n_) {
    int least = 0;
    for (int i = 1; i < n_; ++i) {
      if (std::abs(multiplier_[i]) < std::abs(multiplier_[least]))
        least = i;
    }
    extra_entry_ = {active_[least], multiplier_[least]};
    active_[least] = id;
    multiplier_[least] = sign;
    certified_ = n_;
    return;
  }
  active_[certified_ - 1] = id;
  multiplier_[certified_ - 1] = sign;
}

QpStatus ActiveSet::addEqualities() {
  for (int id = 0; id < equalities_; ++id) {
    takeNormal(id);
    const double residual = slack(id);
    const QpVector& dual_step = factors_.dualStep();
    if (factors_.outside() <= kDependent * kDependent * factors_.whole()) {  // redundant or contradictory
      const double scale = std::abs(qp_->e[id]) + qp_->E.row(id).cwiseAbs().dot(x_.cwiseAbs());
      if (std::abs(residual) > 1e-9 * std::max(scale, 1e-12)) {
        certify(id, residual > 0.0 ? -1.0 : 1.0, dual_step);
        return QpStatus::kInfeasible;
      }
      continue;
    }
    const double length = -residual / factors_.outside();
    x_ += length * factors_.primalStep();
    moveMultipliers(dual_step, length);
    if (!activate(id, length))
      return QpStatus::kFailed;
    ++active_equalities_;
  }
  return QpStatus::kSolved;
}

void ActiveSet::propose(int id, double slack) {
  if (!(slack < amount_) || is_active_[id] || is_met_[id] || slack >= -slackTolerance(id))
    return;
  amount_ = slack;
  worst_ = id;
}

int ActiveSet::mostViolated() {
  const double size = x_.cwiseAbs().maxCoeff();
  size_ = qp_ == &scaled_.program() ? std::max(size_, size) : size;
  worst_ = -1;
  amount_ = 0.0;
  const int lower = equalities_, upper = lower + n_, row = upper + n_;
  const auto look = [this](int id, double slack) {
    if (slack < 0.0)
      propose(id, slack);
  };
  for (int i = 0; i < n_; ++i) {
    look(lower + i, x_[i] - qp_->lower[i]);
    look(upper + i, qp_->upper[i] - x_[i]);
  }
  if (rows_ > 0) {
    row_slack_ = qp_->b;
    for (int j = 0; j < n_; ++j) {
      const double* const column = &qp_->A(0, j);
      const double x = x_[j];
      if (!in_rows_[j])
        continue;
      for (int i = 0; i < rows_; ++i)
        row_slack_[i] -= column[i] * x;
    }
    for (int i = 0; i < rows_; ++i)
      look(row + i, row_slack_[i]);
  }
  return worst_;
}

void ActiveSet::save(State& state) const {
  state.factors = factors_;
  state.x = x_;
  state.multiplier = multiplier_;
  state.active = active_;
  state.is_active = is_active_;
}

void ActiveSet::restore(const State& state) {
  factors_ = state.factors;
  x_ = state.x;
  multiplier_ = state.multiplier;
  active_ = state.active;
  is_active_ = state.is_active;
}

QpStatus ActiveSet::enforce(int id) {
  double multiplier = 0.0;
  const bool perhaps_met = slack(id) >= -kUnreachable * size_;
  if (perhaps_met)
    save(before_);
  for (;;) {
    if (++iterations_ > iteration_limit_)
      return QpStatus::kIterationLimit;
    takeNormal(id);
    const QpVector& dual_step = factors_.dualStep();
    // Longest dual step before the multiplier of an inequality becomes negative.
    double dual_length = kInf;
    int blocking = -1;
    for (int i = active_equalities_; i < factors_.active(); ++i) {
      if (dual_step[i] > 0.0 && multiplier_[i] < dual_length * dual_step[i]) {
        dual_length = multiplier_[i] / dual_step[i];
        blocking = i;
      }
    }
    const bool reachable = factors_.outside() > kDependent * kDependent * factors_.whole();
    const double primal_length = reachable ? -slack(id) / factors_.outside() : kInf;
    const double length = std::min(dual_length, primal_length);
    if (!std::isfinite(length)) {
      if (!perhaps_met) {
        certify(id, 1.0, dual_step);
        return QpStatus::kInfeasible;
      }
      restore(before_);  // undoes the steps made for a constraint that gets no multiplier
      is_met_[id] = true;
      return QpStatus::kSolved;
    }
    if (reachable)
      x_ += length * factors_.primalStep();
    moveMultipliers(dual_step, length);
    multiplier += length;
    if (reachable && primal_length <= dual_length)
      return activate(id, multiplier) ? QpStatus::kSolved : QpStatus::kFailed;
    drop(blocking);
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

void ActiveSet::report(QpSolution& solution) const {
  const int count = solution.status == QpStatus::kInfeasible ? certified_ : factors_.active();
  const auto set = [&](int id, double multiplier) {
    const auto [kind, i] = decode(id);
    switch (kind) {
      case Kind::kEquality:
        solution.y[i] = -multiplier;
        break;
      case Kind::kLower:
        solution.z[i] -= multiplier;
        break;
      case Kind::kUpper:
        solution.z[i] += multiplier;
        break;
      case Kind::kRow:
        solution.w[i] = multiplier;
        break;
    }
    return Constraint{kind, i};
  };
  for (int k = 0; k < count; ++k) {
    const auto [kind, i] = set(active_[k], multiplier_[k]);
    if (kind == Kind::kLower)
      solution.x[i] = qp_->lower[i];
    if (kind == Kind::kUpper)
      solution.x[i] = qp_->upper[i];
  }
  if (solution.status == QpStatus::kInfeasible && extra_entry_.id >= 0)
    set(extra_entry_.id, extra_entry_.multiplier);
}

void ActiveSet::attempt(const QuadraticProgram& qp, bool strictly, QpSolution& solution) {
  qp_ = &qp;
  for (int j = 0; j < n_; ++j)
    in_rows_[j] = (qp.A.col(j).array() != 0.0).any();
  iteration_limit_ = iterations_ + 20 * (n_ + constraints_);
  extra_entry_ = {};
  certified_ = 0;
  solution.x.setZero(n_);
  solution.y.setZero(equalities_);
  solution.z.setZero(n_);
  solution.w.setZero(rows_);
  solution.crossed = -1;
  gradient_ = qp.g;
  solution.status = strictly ? solveStrictly(0.0) : solveSemidefinite();
  solution.residual = kInf;
  if (solution.status == QpStatus::kSolved) {
    solution.x = x_;
    report(solution);
    // Violations of bounds by rounding need no multiplier, but they must not reach the joints.
    for (int i = 0; i < n_; ++i)
      solution.x[i] = std::clamp(solution.x[i], qp_->lower[i], qp_->upper[i]);
    solution.residual = kktResidual(qp, solution);
  } else if (solution.status == QpStatus::kInfeasible) {
    report(solution);
    solution.x.setZero(n_);
    solution.residual = certificateResidual(qp, solution);
  }
  qp_ = nullptr;
}

void ActiveSet::solve(const QuadraticProgram& qp, QpSolution& solution) noexcept {
  n_ = qp.variables();
  equalities_ = qp.equalities();
  rows_ = qp.rows();
  constraints_ = equalities_ + 2 * n_ + rows_;
  if (remembered_ != constraints_)
    remembered_active_ = 0;
  remembered_ = iterations_ = active_equalities_ = 0;
  multiplier_.resize(n_);
  int crossed = -1;
  for (int i = 0; i < n_; ++i) {
    if (qp.lower[i] > qp.upper[i])
      crossed = i;
  }
  if (!finite(qp) || crossed >= 0) {
    solution = QpSolution{};
    solution.status = crossed >= 0 ? QpStatus::kInfeasible : QpStatus::kNotFinite;
    solution.x.setZero(n_);
    solution.y.setZero(equalities_);
    solution.z.setZero(n_);
    solution.w.setZero(rows_);
    solution.crossed = crossed;
    return;
  }
  attempt(qp, true, solution);
  const bool certain = solution.status == QpStatus::kInfeasible
                           ? provesInfeasible(qp, solution)
                           : solution.status == QpStatus::kSolved && solution.residual <= kExact;
  if (!certain) {
    remembered_active_ = 0;
    tryScaled(qp, solution);
  }
  solution.iterations = iterations_ + active_equalities_;
  if (solution.status == QpStatus::kSolved) {
    remember();
    remembered_ = constraints_;
  }
}

void ActiveSet::tryScaled(const QuadraticProgram& qp, QpSolution& solution) {
  scaled_.set(qp);
  attempt(scaled_.program(), solution.status != QpStatus::kNotConvex, again_);
  if (again_.status != QpStatus::kInfeasible && !(again_.residual <= kExact))
    attempt(scaled_.program(), false, again_);
  scaled_.restore(again_);
  // If both are solved, compares the residuals in the units of the problem.
  if (again_.status == QpStatus::kSolved && solution.status == QpStatus::kSolved)
    again_.residual = kktResidual(qp, again_);
  if (!std::isfinite(solution.residual) || again_.residual < solution.residual)
    solution = again_;
}

}  // namespace tandem::control
