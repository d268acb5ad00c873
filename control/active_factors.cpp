// SPDX-License-Identifier: Apache-2.0
#include "control/detail/active_factors.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
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
    for (int k = 0; k < j; ++k) {
      if (N != Eigen::Dynamic || L(j, k) != 0.0)  // zero between arms that no task couples
        column -= L(j, k) * sized<N>(&L(0, k), n);
    }
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
      if (N == Eigen::Dynamic && rest[k] == 0.0)
        continue;
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

bool ActiveFactors::factorise(const QpMatrix& H, double shift, bool few) {
  n_ = static_cast<int>(H.rows());
  active_ = reflections_ = 0;
  R_.resize(n_, n_);
  w_.resize(n_, n_);
  for (QpVector* vector : {&h_, &direction_, &primal_, &dual_})
    vector->resize(n_);
  diagonal_ = isDiagonal(H);
  product_ = diagonal_ || few;
  if (diagonal_) {
    scale_ = H.diagonal().array() + shift;
    if (!(scale_.array() > 0.0).all())
      return false;
    scale_ = scale_.cwiseSqrt().cwiseInverse();
    return true;
  }
  if (isLast(H, shift)) {
    J_ = last_inverse_;
    return true;
  }
  J_.setZero(n_, n_);
  bool definite = false;
  withSize(n_, [&]<int N>() {
    definite = cholesky<N>(H, shift, R_);
    if (definite)
      invert<N>(R_, J_);
  });
  last_hessian_.resize(0, 0);
  if (definite) {
    last_hessian_ = H;
    last_inverse_ = J_;
    last_shift_ = shift;
  }
  return definite;
}

bool ActiveFactors::isLast(const QpMatrix& H, double shift) const {
  return last_hessian_.rows() == n_ && shift == last_shift_ &&
         std::equal(H.data(), H.data() + static_cast<std::ptrdiff_t>(n_) * n_, last_hessian_.data());
}

void ActiveFactors::unconstrainedMinimum(const QpVector& g, QpVector& x) {
  take(g);
  x.resize(n_);
  withSize(n_, [&]<int N>() { combine<N>(direction_, x); });
  x = -x;
}

/// Q^T times a direction, in place.
template <int N>
void ActiveFactors::turn(QpVector& direction) const {
  for (int k = 0; k < reflections_; ++k) {
    std::swap(direction[first_[k]], direction[largest_[k]]);
    auto d = sized<N>(direction.data(), n_);
    const auto w = sized<N>(&w_(0, k), n_);
    const double share = w.dot(d) / h_[k];
    if (share != 0.0)  // normals of some arms have no part in the reflections of others
      d -= share * w;
  }
}

/// Sum of the columns of J_ from `first` on, each times its entry of the direction.
template <int N>
auto ActiveFactors::sum(const QpVector& direction, int first) const {
  SizedVector<N> total = SizedVector<N>::Zero(n_);
  for (int j = first; j < n_; ++j)
    total += direction[j] * sized<N>(&J_(0, j), n_);
  return total;
}

/// J times a direction, which becomes Q times itself.
template <int N>
void ActiveFactors::combine(QpVector& direction, QpVector& combined) const {
  for (int k = reflections_ - 1; k >= 0; --k) {
    auto d = sized<N>(direction.data(), n_);
    const auto w = sized<N>(&w_(0, k), n_);
    const double share = w.dot(d) / h_[k];
    if (share != 0.0)
      d -= share * w;
    std::swap(direction[first_[k]], direction[largest_[k]]);
  }
  if (diagonal_) {
    sized<N>(combined.data(), n_) = sized<N>(scale_.data(), n_).cwiseProduct(sized<N>(direction.data(), n_));
    return;
  }
  sized<N>(combined.data(), n_) = sum<N>(direction, 0);
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
    if (diagonal_) {
      sized<N>(direction_.data(), n_) = sized<N>(scale_.data(), n_).cwiseProduct(given);
    } else {
      for (int j = 0; j < n_; ++j)
        direction_[j] = sized<N>(&J_(0, j), n_).dot(given);
    }
    if (reflections_ > 0)
      turn<N>(direction_);
  });
  loadDirection();
}

void ActiveFactors::takeUnit(int i, double sign) {
  if (diagonal_) {
    direction_.setZero();
    direction_[i] = sign * scale_[i];
  } else {
    for (int j = 0; j < n_; ++j)
      direction_[j] = sign * J_(i, j);
  }
  if (reflections_ > 0)
    withSize(n_, [&]<int N>() { turn<N>(direction_); });
  loadDirection();
}

const QpVector& ActiveFactors::primalStep() {
  withSize(n_, [&]<int N>() {
    if (product_) {
      QpVector outside = direction_;
      outside.head(active_).setZero();
      combine<N>(outside, primal_);
    } else {
      sized<N>(primal_.data(), n_) = sum<N>(direction_, active_);
    }
  });
  return primal_;
}

const QpVector& ActiveFactors::dualStep() {
  for (int i = 0; i < active_; ++i)
    dual_[i] = direction_[i];
  divideByR();
  return dual_;
}

/// dual_ = R^-1 dual_.
void ActiveFactors::divideByR() {
  for (int j = active_ - 1; j >= 0; --j) {
    const double* const column = &R_(0, j);
    dual_[j] /= column[j];
    for (int i = 0; i < j; ++i)
      dual_[i] -= column[i] * dual_[j];
  }
}

/// A reflection I - w w^T / h maps d_2 = J_2^T n to a multiple of the first unit vector. The largest entry of d_2 is
/// first, so that columns of very different sizes keep their accuracy.
bool ActiveFactors::append() {
  const double length = std::sqrt(outside_);
  if (!(length > 0.0))
    return false;
  int largest = active_;
  for (int j = active_ + 1; j < n_; ++j) {
    if (std::abs(direction_[j]) > std::abs(direction_[largest]))
      largest = j;
  }
  std::swap(direction_[active_], direction_[largest]);
  const double first = direction_[active_], turned = first > 0.0 ? -length : length;
  const double h = length * (length + std::abs(first));
  direction_[active_] = first - turned;  // w
  if (product_)
    keep(largest, h);
  else
    reflect(largest, turned, h);
  double* const column = &R_(0, active_);
  for (int i = 0; i < active_; ++i)
    column[i] = direction_[i];
  column[active_] = turned;
  ++active_;
  return true;
}

/// As a factor of the product.
void ActiveFactors::keep(int largest, double h) {
  const int k = reflections_++;
  first_[k] = active_;
  largest_[k] = largest;
  h_[k] = h;
  double* const w = &w_(0, k);
  for (int j = 0; j < n_; ++j)
    w[j] = j < active_ ? 0.0 : direction_[j];
}

/// In J itself: J_2 w follows from J_2 d_2.
void ActiveFactors::reflect(int largest, double turned, double h) {
  if (largest != active_)
    J_.col(active_).swap(J_.col(largest));
  withSize(n_, [&]<int N>() {
    const SizedVector<N> turn =
        (sized<N>(primal_.data(), n_) - turned * sized<N>(&J_(0, active_), n_)) / h;  // J_2 w / h
    for (int j = active_; j < n_; ++j)
      sized<N>(&J_(0, j), n_) -= direction_[j] * turn;
  });
}

/// Puts the reflections into J_.
void ActiveFactors::multiplyOut() {
  product_ = false;
  if (diagonal_) {
    J_.setZero(n_, n_);
    J_.diagonal() = scale_;
    diagonal_ = false;
  }
  withSize(n_, [&]<int N>() {
    for (int k = 0; k < reflections_; ++k) {
      if (first_[k] != largest_[k])
        J_.col(first_[k]).swap(J_.col(largest_[k]));
      SizedVector<N> turned = SizedVector<N>::Zero(n_);
      for (int j = first_[k]; j < n_; ++j) {
        if (w_(j, k) != 0.0)
          turned += w_(j, k) * sized<N>(&J_(0, j), n_);
      }
      turned /= h_[k];
      for (int j = first_[k]; j < n_; ++j) {
        if (w_(j, k) != 0.0)
          sized<N>(&J_(0, j), n_) -= w_(j, k) * turned;
      }
    }
  });
  reflections_ = 0;
}

const QpVector& ActiveFactors::meet(const QpVector& residual, QpVector& x) {
  for (int j = 0; j < active_; ++j) {  // R^T u = -residual, x += J_1 u
    double sum = -residual[j];
    for (int i = 0; i < j; ++i)
      sum -= R_(i, j) * dual_[i];
    dual_[j] = sum / R_(j, j);
  }
  QpVector inside = dual_;
  inside.tail(n_ - active_).setZero();
  withSize(n_, [&]<int N>() { combine<N>(inside, primal_); });
  x += primal_;
  divideByR();
  return dual_;
}

void ActiveFactors::descend(const QpVector& gradient, QpVector& x, QpVector& multiplier) {
  take(gradient);
  x -= primalStep();
  multiplier.head(active_) = dualStep().head(active_);
}

void ActiveFactors::remove(int position) {
  multiplyOut();
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
