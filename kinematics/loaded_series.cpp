// SPDX-License-Identifier: Apache-2.0
#include "kinematics/loaded_series.h"

#include <algorithm>
#include <cmath>

namespace tandem::kinematics {
namespace {

template <class Term>
Term horner(double x, const LoadedSeries::Terms<Term>& terms, int count) {
  Term sum = terms[count - 1];
  for (int k = count - 2; k >= 0; --k)
    sum = sum * x + terms[k];
  return sum;
}

}  // namespace

Eigen::Vector2d LoadedState::bend(const LoadedPart& part) const {
  Eigen::Vector2d sum = moment;
  for (int c = 0; c < part.curved_count; ++c) {
    const int i = part.curved[c];
    sum += part.b[i] * Eigen::Vector2d(-std::sin(psi[i]), std::cos(psi[i]));
  }
  return sum / part.total;
}

TubeVector LoadedState::torque(const LoadedPart& part) const {
  const Eigen::Vector2d u = bend(part);
  TubeVector torque = TubeVector::Zero();
  for (int c = 0; c < part.curved_count; ++c) {
    const int i = part.curved[c];
    torque[i] = part.b[i] * (u.x() * std::cos(psi[i]) + u.y() * std::sin(psi[i]));
  }
  return torque;
}

LoadedSeries::LoadedSeries(const LoadedPart& part, const LoadedState& start, double length, const Tolerance& tolerance)
    : part_(part), start_(start), length_(length) {
  const int least = leastOrder(tolerance.derivatives);
  for (int c = 0; c < part_.curved_count; ++c) {
    a_.psi[0][c] = start_.psi[part_.curved[c]];
    a_.torsion[0][c] = start_.torsion[part_.curved[c]];
  }
  a_.mx[0] = start_.moment.x();
  a_.my[0] = start_.moment.y();
  a_.r1[0] = Eigen::Vector3d::UnitX();
  a_.r2[0] = Eigen::Vector3d::UnitY();
  a_.r3[0] = Eigen::Vector3d::UnitZ();
  a_.p[0] = Eigen::Vector3d::Zero();
  double before = 1.0, last = 1.0;
  for (int k = 0; k <= kMaxOrder; ++k) {
    expand(k);
    order_ = k;
    before = last;
    last = size(k);
    if (k >= least && std::max(last, before) < tolerance.terms)
      return;
  }
  if (std::max(last, before) >= tolerance.terms)
    shorten(0.8 * std::pow(tolerance.terms / std::max(last, before), 1.0 / kMaxOrder));
}

/// Order at which the derivatives' series, bounded by exp(mu x) past the polynomial by which a force shifts the end,
/// have converged; shortens the piece if no order is sufficient. So short a piece has no conjugate point of its own,
/// which needs pi.
int LoadedSeries::leastOrder(double of_derivatives) {
  constexpr double kLargest = 1.5;  // exp(1.5 x) needs 15 terms for 1e-10
  constexpr int kPolynomial = 4;    // force, moment, curvature, turn, shift
  double b_sum = 0.0, g_max = 0.0, twist = 0.0;
  for (int c = 0; c < part_.curved_count; ++c) {
    const int i = part_.curved[c];
    b_sum += std::abs(part_.b[i]);
    g_max = std::max(g_max, std::abs(part_.b[i]) * part_.compliance[i] / part_.total);
    twist = std::max(twist, std::abs(start_.torsion[i]) * part_.compliance[i] + std::abs(part_.helix[i]));
  }
  const double moment = std::hypot(start_.moment.x(), start_.moment.y(), start_.torsion.sum());
  const double rate = std::max(
      {std::sqrt(b_sum * g_max), std::sqrt(start_.force.norm() / part_.total), (b_sum + moment) / part_.total + twist});
  double mu = rate * length_;
  if (mu > kLargest) {
    length_ *= kLargest / mu;
    mu = kLargest;
  }
  int order = 0;
  for (double term = 1.0; term > of_derivatives && order + kPolynomial < kMaxOrder; term *= mu / order)
    ++order;
  return order + kPolynomial;
}

void LoadedSeries::expand(int k) {
  expandTubes(k);
  expandBackbone(k);
}

/// Terms k of angles' sines and cosines and of the curvature, then k + 1 of torsions and angles.
void LoadedSeries::expandTubes(int k) {
  const int count = part_.curved_count;
  double sx = a_.mx[k], sy = a_.my[k];
  for (int c = 0; c < count; ++c) {
    double cosine, sine;
    if (k == 0) {
      cosine = part_.b[part_.curved[c]] * std::cos(a_.psi[0][c]);
      sine = part_.b[part_.curved[c]] * std::sin(a_.psi[0][c]);
    } else {
      cosine = sine = 0.0;
      for (int l = 1; l <= k; ++l) {
        const double weighted = l * a_.psi[l][c];
        sine += weighted * a_.cosine[k - l][c];
        cosine -= weighted * a_.sine[k - l][c];
      }
      cosine /= k;
      sine /= k;
    }
    a_.cosine[k][c] = cosine;
    a_.sine[k][c] = sine;
    sx -= sine;
    sy += cosine;
  }
  a_.ux[k] = sx / part_.total;
  a_.uy[k] = sy / part_.total;
  const double scale = length_ / (k + 1);
  a_.mz[k] = 0.0;
  for (int c = 0; c < count; ++c) {
    double torque = 0.0, own = 0.0;
    for (int l = 0; l <= k; ++l) {
      torque += a_.ux[l] * a_.cosine[k - l][c] + a_.uy[l] * a_.sine[k - l][c];
      own += a_.uy[l] * a_.cosine[k - l][c] - a_.ux[l] * a_.sine[k - l][c];
    }
    a_.own[k][c] = own;
    a_.mz[k] += a_.torsion[k][c];
    a_.torsion[k + 1][c] = -scale * torque;
    a_.psi[k + 1][c] = -scale * part_.compliance[part_.curved[c]] * a_.torsion[k][c];
  }
  if (k == 0) {
    a_.mz[0] = start_.torsion.sum();
    for (int c = 0; c < count; ++c)
      a_.psi[1][c] -= scale * part_.helix[part_.curved[c]];
  }
}

/// Terms k of the force, then k + 1 of moment and frame.
void LoadedSeries::expandBackbone(int k) {
  const double scale = length_ / (k + 1);
  a_.nx[k] = a_.r1[k].dot(start_.force);
  a_.ny[k] = a_.r2[k].dot(start_.force);
  a_.nz[k] = a_.r3[k].dot(start_.force);
  double mx = -a_.ny[k], my = a_.nx[k];
  Eigen::Vector3d d1 = Eigen::Vector3d::Zero(), d2 = d1, d3 = d1;
  for (int l = 0; l <= k; ++l) {
    const double ux = a_.ux[k - l], uy = a_.uy[k - l];
    mx += uy * a_.mz[l];
    my -= ux * a_.mz[l];
    d1 += uy * a_.r3[l];
    d2 -= ux * a_.r3[l];
    d3 += ux * a_.r2[l] - uy * a_.r1[l];
  }
  a_.mx[k + 1] = scale * mx;
  a_.my[k + 1] = scale * my;
  a_.r1[k + 1] = scale * d1;
  a_.r2[k + 1] = scale * d2;
  a_.r3[k + 1] = scale * d3;
  a_.p[k + 1] = -scale * a_.r3[k];
}

/// Largest term of this order, as an angle.
double LoadedSeries::size(int k) const {
  double largest = length_ * std::max(std::abs(a_.ux[k]), std::abs(a_.uy[k]));
  for (int c = 0; c < part_.curved_count; ++c) {
    const double b = std::abs(part_.b[part_.curved[c]]);
    largest =
        std::max({largest, std::abs(a_.psi[k + 1][c]), std::abs(a_.cosine[k][c]) / b, std::abs(a_.sine[k][c]) / b});
  }
  return largest;
}

void LoadedSeries::shorten(double ratio) {
  length_ *= ratio;
  double power = 1.0;
  for (int k = 0; k <= order_ + 1; ++k, power *= ratio) {
    const auto scale = [&](auto&... terms) { ((terms[k] *= power), ...); };
    const auto scale_tubes = [&](auto&... terms) {
      for (int c = 0; c < part_.curved_count; ++c)
        ((terms[k][c] *= power), ...);
    };
    scale(a_.mx, a_.my, a_.r1, a_.r2, a_.r3, a_.p);
    scale_tubes(a_.psi, a_.torsion);
    if (k <= order_) {
      scale(a_.ux, a_.uy, a_.mz, a_.nx, a_.ny, a_.nz);
      scale_tubes(a_.cosine, a_.sine, a_.own);
    }
  }
}

LoadedPoint LoadedSeries::at(double x) const {
  LoadedPoint point;
  point.x = x;
  point.rotation << horner(x, a_.r1, order_ + 2), horner(x, a_.r2, order_ + 2), horner(x, a_.r3, order_ + 2);
  point.position = horner(x, a_.p, order_ + 2);
  LoadedState& state = point.state;
  state = start_;
  state.psi -= x * length_ * part_.compliance.cwiseProduct(start_.torsion);
  for (int c = 0; c < part_.curved_count; ++c) {
    double psi = 0.0, torsion = 0.0;
    for (int k = order_ + 1; k >= 0; --k) {
      psi = psi * x + a_.psi[k][c];
      torsion = torsion * x + a_.torsion[k][c];
    }
    state.psi[part_.curved[c]] = psi;
    state.torsion[part_.curved[c]] = torsion;
  }
  state.moment = {horner(x, a_.mx, order_ + 2), horner(x, a_.my, order_ + 2)};
  state.force = point.rotation.transpose() * start_.force;
  return point;
}

}  // namespace tandem::kinematics
