// SPDX-License-Identifier: Apache-2.0
/** @file Derivatives by finite differences with refinement until convergence. */
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <vector>

namespace tandem::test {

/// A derivative and its estimated error.
struct Difference {
  Eigen::VectorXd value;
  double error = std::numeric_limits<double>::infinity();
};

/** Ridders' method: differences over decreasing steps, extrapolated to zero.
 * @param f from a step to a vector; empty if undefined
 * @param one_sided forward (step > 0) or backward (step < 0) differences instead of central ones */
template <class Function>
Difference differentiate(const Function& f, double step, bool one_sided = false) {
  constexpr int kLevels = 10;
  constexpr double kShrink = 1.6;
  const double power = one_sided ? kShrink : kShrink * kShrink;
  std::vector<std::vector<Eigen::VectorXd>> table(kLevels);
  Difference best;
  const Eigen::VectorXd here = one_sided ? Eigen::VectorXd(f(0.0)) : Eigen::VectorXd();
  for (int i = 0; i < kLevels; ++i, step /= kShrink) {
    const Eigen::VectorXd right = f(step), left = one_sided ? here : Eigen::VectorXd(f(-step));
    if (right.size() == 0 || left.size() == 0)
      return best;
    table[i].push_back((right - left) / (one_sided ? step : 2.0 * step));
    double factor = power;
    for (int k = 1; k <= i; ++k, factor *= power) {
      table[i].push_back((factor * table[i][k - 1] - table[i - 1][k - 1]) / (factor - 1.0));
      const double error = std::max((table[i][k] - table[i][k - 1]).norm(), (table[i][k] - table[i - 1][k - 1]).norm());
      if (error < best.error)
        best = {table[i][k], error};
    }
  }
  return best;
}

/// Twist (linear, angular; base frame) that takes `from` to `to`, for differences.
inline Eigen::Matrix<double, 6, 1> poseDifference(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to) {
  Eigen::Matrix<double, 6, 1> difference;
  const Eigen::Quaterniond turn(Eigen::Matrix3d(to.linear() * from.linear().transpose()));
  const double sine = turn.vec().norm(), angle = 2.0 * std::atan2(sine, turn.w());
  difference << to.translation() - from.translation(), turn.vec() * (sine > 0.0 ? angle / sine : 2.0);
  return difference;
}

}  // namespace tandem::test
