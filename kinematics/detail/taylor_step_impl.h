// SPDX-License-Identifier: Apache-2.0
/** @file Template implementation of TaylorStep. All series are in x = sigma / h. */
#pragma once

#include "kinematics/taylor_step.h"

namespace tandem::kinematics {

template <int NC, class Scalar>
TaylorStep<NC, Scalar>::TaylorStep(const CurvedTubes<NC, Scalar>& tubes, const Scalar& length, StepDepth depth)
    : h_(length) {
  expandAngles(tubes);
  expandColumns(tubes);
  transition_.template topRows<NC>() = psiByState(1.0);
  transition_.template bottomRows<NC>() = rateByState(1.0);
  if (depth == StepDepth::kPose) {
    expandPose(tubes);
    integrateTwists(tubes);
  }
}

/// Order at which the series of the linear parts, bounded by exp(mu x), have converged; shortens the step if no order
/// is sufficient.
template <int NC, class Scalar>
int TaylorStep<NC, Scalar>::leastOrder(const CurvedTubes<NC, Scalar>& tubes) {
  using std::abs, std::max, std::sqrt;
  double b_sum = 0.0, g_max = 0.0, twist = 0.0;
  for (int i = 0; i < NC; ++i) {
    b_sum += abs(tubes.b[i]);
    g_max = max(g_max, abs(tubes.g[i]));
    twist = max(twist, abs(valueOf(tubes.rate[i])));
  }
  const double rate = max(sqrt(b_sum * g_max), b_sum / tubes.stiffness + twist);
  constexpr double kLargest = 1.5;  // exp(1.5 x) needs 17 terms
  double mu = rate * valueOf(h_);
  if (mu > kLargest) {
    fraction_ = kLargest / mu;
    h_ *= fraction_;
    mu = kLargest;
  }
  int order = 0;
  for (double term = 1.0; term > kTolerance && order < kMaxOrder; term *= mu / order)
    ++order;
  return order;
}

template <int NC, class Scalar>
void TaylorStep<NC, Scalar>::expandAngle(const CurvedTubes<NC, Scalar>& tubes, int k) {
  using std::cos, std::sin;
  Row<NC> force;
  force.fill(Scalar(0.0));  // numbers with derivatives are not initialised by default
  int pair = 0;
  for (int i = 0; i < NC; ++i) {
    for (int j = i + 1; j < NC; ++j, ++pair) {
      if (k == 0) {
        sin_[0][pair] = sin(a_[0][i] - a_[0][j]);
        cos_[0][pair] = cos(a_[0][i] - a_[0][j]);
      } else {
        Scalar s(0.0), c(0.0);
        for (int l = 1; l <= k; ++l) {
          const Scalar weighted = static_cast<double>(l) * (a_[l][i] - a_[l][j]);
          s += weighted * cos_[k - l][pair];
          c -= weighted * sin_[k - l][pair];
        }
        sin_[k][pair] = s / static_cast<double>(k);
        cos_[k][pair] = c / static_cast<double>(k);
      }
      force[i] += tubes.b[j] * sin_[k][pair];
      force[j] -= tubes.b[i] * sin_[k][pair];
    }
  }
  const Scalar scale = h_ * h_ / static_cast<double>((k + 1) * (k + 2));
  for (int i = 0; i < NC; ++i)
    a_[k + 2][i] = scale * tubes.g[i] * force[i];
}

/// Adds terms until two in a row are below the tolerance; shortens the step if that needs more terms than kMaxOrder.
template <int NC, class Scalar>
void TaylorStep<NC, Scalar>::expandAngles(const CurvedTubes<NC, Scalar>& tubes) {
  const int least = leastOrder(tubes);
  for (int i = 0; i < NC; ++i) {
    a_[0][i] = tubes.psi[i];
    a_[1][i] = h_ * tubes.rate[i];
  }
  double before = 1.0, last = 1.0;
  for (int k = 0; k <= kMaxOrder; ++k) {
    expandAngle(tubes, k);
    order_ = k;
    before = last;
    last = 0.0;
    for (int i = 0; i < NC; ++i)
      last = std::max(last, std::abs(valueOf(a_[k + 1][i])));
    for (int pair = 0; pair < kPairs; ++pair)
      last = std::max({last, std::abs(valueOf(sin_[k][pair])), std::abs(valueOf(cos_[k][pair]))});
    if (k >= least && std::max(last, before) < kTolerance)
      return;
  }
  if (std::max(last, before) >= kTolerance)
    shorten(0.8 * std::pow(kTolerance / std::max(last, before), 1.0 / kMaxOrder));
}

template <int NC, class Scalar>
void TaylorStep<NC, Scalar>::shorten(double ratio) {
  fraction_ *= ratio;
  h_ *= ratio;
  double power = 1.0;
  for (int k = 0; k <= kMaxOrder + 2; ++k, power *= ratio) {
    for (Scalar& a : a_[k])
      a *= power;
    if (k > kMaxOrder)
      continue;
    for (int pair = 0; pair < kPairs; ++pair) {
      sin_[k][pair] *= power;
      cos_[k][pair] *= power;
    }
  }
}

template <int NC, class Scalar>
void TaylorStep<NC, Scalar>::expandColumns(const CurvedTubes<NC, Scalar>& tubes) {
  for (int c = 0; c < kColumns; ++c) {
    for (int i = 0; i < NC; ++i) {
      const bool unit = i == 1 + c % (NC - 1);
      column_[0][c * NC + i] = unit && c < NC - 1 ? Scalar(1.0) : Scalar(0.0);
      column_[1][c * NC + i] = unit && c >= NC - 1 ? h_ : Scalar(0.0);
    }
  }
  for (int k = 0; k <= order_; ++k) {
    const Scalar scale = h_ * h_ / static_cast<double>((k + 1) * (k + 2));
    for (int c = 0; c < kColumns; ++c) {
      Row<NC> force;
      force.fill(Scalar(0.0));  // numbers with derivatives are not initialised by default
      int pair = 0;
      for (int i = 0; i < NC; ++i) {
        for (int j = i + 1; j < NC; ++j, ++pair) {
          Scalar product(0.0);
          for (int l = 0; l <= k; ++l)
            product += cos_[k - l][pair] * (column_[l][c * NC + i] - column_[l][c * NC + j]);
          force[i] += tubes.b[j] * product;
          force[j] -= tubes.b[i] * product;
        }
      }
      for (int i = 0; i < NC; ++i)
        column_[k + 2][c * NC + i] = scale * tubes.g[i] * force[i];
    }
  }
}

template <int NC, class Scalar>
auto TaylorStep<NC, Scalar>::psiByState(double x) const -> ByState {
  ByState result;
  result.col(0).setConstant(Scalar(1.0));
  result.col(NC).setConstant(h_ * x);
  for (int c = 0; c < kColumns; ++c) {
    const int state = c < NC - 1 ? 1 + c : NC + 1 + (c - (NC - 1));
    for (int i = 0; i < NC; ++i)
      result(i, state) = horner(
          x, [&](int k) { return column_[k][c * NC + i]; }, order_ + 3);
    result.col(state < NC ? 0 : NC) -= result.col(state);
  }
  return result;
}

template <int NC, class Scalar>
Scalar TaylorStep<NC, Scalar>::rate(int tube, double x) const {
  return horner(
             x, [&](int k) { return Scalar(a_[k + 1][tube] * static_cast<double>(k + 1)); }, order_ + 2) /
         h_;
}

template <int NC, class Scalar>
auto TaylorStep<NC, Scalar>::rateByState(double x) const -> ByState {
  ByState result;
  result.col(0).setConstant(Scalar(0.0));
  result.col(NC).setConstant(Scalar(1.0));
  for (int c = 0; c < kColumns; ++c) {
    const int state = c < NC - 1 ? 1 + c : NC + 1 + (c - (NC - 1));
    for (int i = 0; i < NC; ++i) {
      const auto coefficient = [&](int k) { return Scalar(static_cast<double>(k + 1) * column_[k + 1][c * NC + i]); };
      result(i, state) = horner(x, coefficient, order_ + 2) / h_;
    }
    result.col(state < NC ? 0 : NC) -= result.col(state);
  }
  return result;
}

template <int NC, class Scalar>
void TaylorStep<NC, Scalar>::expandPose(const CurvedTubes<NC, Scalar>& tubes) {
  using std::cos, std::sin;
  std::array<Scalar, kMaxOrder + 1> ux, uy;
  for (int k = 0; k <= order_; ++k) {
    ux[k] = uy[k] = Scalar(0.0);
    for (int i = 0; i < NC; ++i) {
      if (k == 0) {
        tube_sin_[0][i] = sin(a_[0][i]);
        tube_cos_[0][i] = cos(a_[0][i]);
      } else {
        Scalar s(0.0), c(0.0);
        for (int l = 1; l <= k; ++l) {
          const Scalar weighted = static_cast<double>(l) * a_[l][i];
          s += weighted * tube_cos_[k - l][i];
          c -= weighted * tube_sin_[k - l][i];
        }
        tube_sin_[k][i] = s / static_cast<double>(k);
        tube_cos_[k][i] = c / static_cast<double>(k);
      }
      ux[k] -= tubes.b[i] / tubes.stiffness * tube_sin_[k][i];
      uy[k] += tubes.b[i] / tubes.stiffness * tube_cos_[k][i];
    }
  }
  quaternion_[0] = {Scalar(1.0), Scalar(0.0), Scalar(0.0), Scalar(0.0)};
  p_[0] = {Scalar(0.0), Scalar(0.0), Scalar(0.0)};
  for (int k = 0; k <= order_; ++k) {
    Row<4> q;
    q.fill(Scalar(0.0));  // numbers with derivatives are not initialised by default
    Row<3> tangent;
    tangent.fill(Scalar(0.0));  // numbers with derivatives are not initialised by default
    for (int l = 0; l <= k; ++l) {
      const auto& [w, x, y, z] = quaternion_[l];
      q[0] -= x * ux[k - l] + y * uy[k - l];
      q[1] += w * ux[k - l] - z * uy[k - l];
      q[2] += w * uy[k - l] + z * ux[k - l];
      q[3] += x * uy[k - l] - y * ux[k - l];
      const auto& [w2, x2, y2, z2] = quaternion_[k - l];
      tangent[0] += 2.0 * (x * z2 + w * y2);
      tangent[1] += 2.0 * (y * z2 - w * x2);
      tangent[2] += w * w2 + z * z2 - x * x2 - y * y2;
    }
    const Scalar scale = h_ / static_cast<double>(k + 1);
    for (int i = 0; i < 4; ++i)
      quaternion_[k + 1][i] = -0.5 * scale * q[i];
    for (int i = 0; i < 3; ++i)
      p_[k + 1][i] = -scale * tangent[i];
  }
  rotation_ = rotationAt(1.0);
  position_ = positionAt(1.0);
}

template <int NC, class Scalar>
Eigen::Matrix<Scalar, 3, 3> TaylorStep<NC, Scalar>::rotationAt(double x) const {
  Row<4> q;
  for (int i = 0; i < 4; ++i)
    q[i] = horner(
        x, [&](int k) { return quaternion_[k][i]; }, order_ + 2);
  return Eigen::Quaternion<Scalar>(q[0], q[1], q[2], q[3]).toRotationMatrix();
}

template <int NC, class Scalar>
Eigen::Matrix<Scalar, 3, 1> TaylorStep<NC, Scalar>::positionAt(double x) const {
  Eigen::Matrix<Scalar, 3, 1> p;
  for (int i = 0; i < 3; ++i)
    p[i] = horner(
        x, [&](int k) { return p_[k][i]; }, order_ + 2);
  return p;
}

/// twist = -integral of Ad(G(sigma)) (0; du(sigma)) d sigma with du = sum_j b_j / K (-cos psi_j, -sin psi_j) dpsi_j.
template <int NC, class Scalar>
void TaylorStep<NC, Scalar>::integrateTwists(const CurvedTubes<NC, Scalar>& tubes) {
  twist_.setConstant(Scalar(0.0));
  const GaussLegendre& rule = GaussLegendre::rule(std::min(order_ / 2 + 2, GaussLegendre::kMaxNodes));
  for (int node = 0; node < rule.count; ++node) {
    const double x = rule.node[node];
    const Eigen::Matrix<Scalar, 3, 3> rotation = rotationAt(x);
    const Eigen::Matrix<Scalar, 3, 1> p = positionAt(x);
    Eigen::Matrix<Scalar, 6, NC> effect;
    for (int i = 0; i < NC; ++i) {
      const double share = rule.weight[node] * tubes.b[i] / tubes.stiffness;
      const Scalar c = horner(
          x, [&](int k) { return tube_cos_[k][i]; }, order_ + 1);
      const Scalar s = horner(
          x, [&](int k) { return tube_sin_[k][i]; }, order_ + 1);
      const Eigen::Matrix<Scalar, 3, 1> turn = (rotation.col(0) * c + rotation.col(1) * s) * (h_ * share);
      effect.template block<3, 1>(3, i) = turn;
      effect.template block<3, 1>(0, i) = p.cross(turn);
    }
    twist_ += effect * psiByState(x);
  }
}

}  // namespace tandem::kinematics
