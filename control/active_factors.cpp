// SPDX-License-Identifier: Apache-2.0
#include "control/detail/active_factors.h"

#include <cmath>
#include <utility>

#include "control/detail/sized.h"

namespace tandem::control {
namespace {

/// Lower triangle L of H + shift I, into `L`, zeros above. A pivot within rounding counts as zero.
template <int N>
bool cholesky(const QpMatrix& H, double shift, QpMatrix& L) {
  constexpr double kRounding = 1e-13;
  const int n = static_cast<int>(H.rows());
  for (int j = 0; j < n; ++j) {
    // Whole columns: entries above the diagonal are unused, and loops of one length need no remainder.
    SizedVector<N> column = sized<N>(&H(0, j), n);
    column[j] += shift;
    const double before = column[j];
    for (int k = 0; k < j; ++k)
      column -= L(j, k) * sized<N>(&L(0, k), n);
    if (!(column[j] > kRounding * before))
      return false;
    column *= 1.0 / std::sqrt(column[j]);
    for (int i = 0; i < j; ++i)
      column[i] = 0.0;
    sized<N>(&L(0, j), n) = column;
  }
  return true;
}

/// The transposed inverse of L, into `J`.
template <int N>
void invert(const QpMatrix& L, QpMatrix& J) {
  const int n = static_cast<int>(L.rows());
  for (int i = 0; i < n; ++i) {
    SizedVector<N> rest = SizedVector<N>::Zero(n);
    rest[i] = 1.0;
    for (int k = i; k < n; ++k) {
      const double solved = rest[k] / L(k, k);
      rest -= solved * sized<N>(&L(0, k), n);
      J(i, k) = solved;
    }
  }
}

bool isDiagonal(const QpMatrix& H) {
  const int n = static_cast<int>(H.rows());
  for (int j = 0; j < n; ++j) {
    for (int i = j + 1; i < n; ++i) {
      if (H(i, j) != 0.0)
        return false;
    }
  }
  return true;
}

}  // namespace

bool ActiveFactors::factorise(const QpMatrix& H, double shift) {
  n_ = static_cast<int>(H.rows());
  active_ = 0;
  J_.setZero(n_, n_);
  R_.resize(n_, n_);
  direction_.resize(n_);
  primal_.resize(n_);
  dual_.resize(n_);
  if (isDiagonal(H)) {
    for (int i = 0; i < n_; ++i) {
      const double pivot = H(i, i) + shift;
      if (!(pivot > 0.0))
        return false;
      J_(i, i) = 1.0 / std::sqrt(pivot);
    }
    return true;
  }
  bool definite = false;
  withSize(n_, [&]<int N>() {
    definite = cholesky<N>(H, shift, R_);
    if (definite)
      invert<N>(R_, J_);
  });
  return definite;
}

void ActiveFactors::unconstrainedMinimum(const QpVector& g, QpVector& x) {
  take(g);
  x.resize(n_);
  withSize(n_, [&]<int N>() { combine<N>(0, x); });
  x = -x;
}

/// Sum of the columns of J from `first` on, each times its entry of the direction.
template <int N>
void ActiveFactors::combine(int first, QpVector& sum) const {
  SizedVector<N> total = SizedVector<N>::Zero(n_);
  for (int j = first; j < n_; ++j)
    total += direction_[j] * sized<N>(&J_(0, j), n_);
  sized<N>(sum.data(), n_) = total;
}

void ActiveFactors::loadDirection() {
  outside_ = whole_ = 0.0;
  for (int j = 0; j < active_; ++j)
    whole_ += direction_[j] * direction_[j];
  for (int j = active_; j < n_; ++j)
    outside_ += direction_[j] * direction_[j];
  whole_ += outside_;
}

void ActiveFactors::take(const QpVector& normal) {
  withSize(n_, [&]<int N>() {
    const SizedVector<N> given = sized<N>(normal.data(), n_);
    for (int j = 0; j < n_; ++j)
      direction_[j] = sized<N>(&J_(0, j), n_).dot(given);
  });
  loadDirection();
}

void ActiveFactors::takeUnit(int i, double sign) {
  for (int j = 0; j < n_; ++j)
    direction_[j] = sign * J_(i, j);
  loadDirection();
}

const QpVector& ActiveFactors::primalStep() {
  withSize(n_, [&]<int N>() { combine<N>(active_, primal_); });
  return primal_;
}

const QpVector& ActiveFactors::dualStep() {
  for (int i = 0; i < active_; ++i)
    dual_[i] = direction_[i];
  for (int j = active_ - 1; j >= 0; --j) {
    const double* const column = &R_(0, j);
    dual_[j] /= column[j];
    for (int i = 0; i < j; ++i)
      dual_[i] -= column[i] * dual_[j];
  }
  return dual_;
}

/// A reflection I - w w^T / h maps d_2 = J_2^T n to a multiple of the first unit vector; J_2 w follows from J_2 d_2.
/// The largest entry of d_2 is first, so that columns of very different sizes keep their accuracy.
bool ActiveFactors::append() {
  const double length = std::sqrt(outside_);
  if (!(length > 0.0))
    return false;
  int largest = active_;
  for (int j = active_ + 1; j < n_; ++j) {
    if (std::abs(direction_[j]) > std::abs(direction_[largest]))
      largest = j;
  }
  if (largest != active_) {
    std::swap(direction_[active_], direction_[largest]);
    J_.col(active_).swap(J_.col(largest));
  }
  const double first = direction_[active_], turned = first > 0.0 ? -length : length;
  direction_[active_] = first - turned;  // w
  const double h = length * (length + std::abs(first));
  withSize(n_, [&]<int N>() {
    const SizedVector<N> turn =
        (sized<N>(primal_.data(), n_) - turned * sized<N>(&J_(0, active_), n_)) / h;  // J_2 w / h
    for (int j = active_; j < n_; ++j)
      sized<N>(&J_(0, j), n_) -= direction_[j] * turn;
  });
  double* const column = &R_(0, active_);
  for (int i = 0; i < active_; ++i)
    column[i] = direction_[i];
  column[active_] = turned;
  ++active_;
  return true;
}

void ActiveFactors::meet(const QpVector& residual, QpVector& x) {
  for (int j = 0; j < active_; ++j) {  // R^T u = -residual, x += J_1 u
    double sum = -residual[j];
    for (int i = 0; i < j; ++i)
      sum -= R_(i, j) * dual_[i];
    dual_[j] = sum / R_(j, j);
    x += J_.col(j) * dual_[j];
  }
}

void ActiveFactors::descend(const QpVector& gradient, QpVector& x, QpVector& multiplier) {
  take(gradient);
  x -= primalStep();
  multiplier.head(active_) = dualStep().head(active_);
}

void ActiveFactors::remove(int position) {
  for (int j = position; j + 1 < active_; ++j) {
    for (int i = 0; i <= j + 1; ++i)
      R_(i, j) = R_(i, j + 1);
  }
  --active_;
  for (int j = position; j < active_; ++j) {
    const double a = R_(j, j), b = R_(j + 1, j);
    const double h = std::sqrt(a * a + b * b);
    if (b == 0.0 || h == 0.0)
      continue;
    const double c = a / h, s = b / h;
    for (int k = j; k < active_; ++k) {
      const double up = R_(j, k), down = R_(j + 1, k);
      R_(j, k) = c * up + s * down;
      R_(j + 1, k) = c * down - s * up;
    }
    double* const left = &J_(0, j);
    double* const right = &J_(0, j + 1);
    for (int i = 0; i < n_; ++i) {
      const double l = left[i], r = right[i];
      left[i] = c * l + s * r;
      right[i] = c * r - s * l;
    }
  }
}

}  // namespace tandem::control
