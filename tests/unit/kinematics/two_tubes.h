// SPDX-License-Identifier: Apache-2.0
/** @file Two tubes that are curved wherever they overlap and end together, in closed form. */
#pragma once

#include <array>
#include <boost/math/special_functions/jacobi_elliptic.hpp>
#include <cmath>
#include <numbers>

#include "tests/unit/kinematics/arms.h"

namespace tandem::test {

/** delta = psi_1 - psi_2 obeys delta'' = lambda sin delta, lambda = (1 / c_1 + 1 / c_2) b_1 b_2 / K, with delta' = 0 at
 * the end: an inverted pendulum (Dupont et al. 2010). With eta = pi - delta, amplitude eta_L at the end
 * and sigma running backwards from it:
 *
 *   sin(eta / 2) = k cd(w sigma | k),  eta' = -2 k sqrt(1 - k^2) w sd(w sigma | k),  k = sin(eta_L / 2), w =
 * sqrt(lambda).
 */
struct TwoTubes {
  struct State {
    std::array<double, 2> psi;  ///< rad
    double moment;              ///< in tube 1; tube 2 has the opposite one, N m
  };

  kinematics::ConcentricTubeArm arm;
  double length;                     ///< beyond the entry point, m
  std::array<double, 2> beta, c, f;  ///< m; N m^2; compliance of the transmission, rad / (N m)
  double w;                          ///< 1/m

  explicit TwoTubes(Random& random, double most_behind = 0.2) {
    length = random.uniform(0.03, 0.15);
    arm.tubes = {{1.5e-3, 1.3e-3, 58e9, random.uniform(0.2, 0.6), {}},
                 {random.uniform(1.7e-3, 2.2e-3), 1.6e-3, 58e9, random.uniform(0.2, 0.6), {}}};
    double b = 1.0, total = 0.0;
    for (int i = 0; i < 2; ++i) {
      const double behind = random.chance(0.2) ? 0.0 : random.uniform(0.0, most_behind),
                   curvature = random.uniform(4.0, 20.0);
      // The part behind the entry point is straightened there, curved or not.
      const double curved_behind = random.uniform(0.0, 1.0) * behind;
      if (behind - curved_behind > 0.0)
        arm.tubes[i].addSection(behind - curved_behind, 0.0);
      arm.tubes[i].addSection(length + curved_behind, curvature);
      beta[i] = length - arm.tubes[i].length();
      c[i] = arm.tubes[i].torsionalStiffness();
      f[i] = -beta[i] / c[i];
      b *= arm.tubes[i].bendingStiffness() * curvature;
      total += arm.tubes[i].bendingStiffness();
    }
    w = std::sqrt((1.0 / c[0] + 1.0 / c[1]) * b / total);
  }

  /// Angles and moment at a distance `sigma` from the end, where the angle between the tubes is `apart` = delta.
  State at(double apart, double turn, double sigma) const {
    const double turns = 2.0 * std::numbers::pi * std::floor(apart / (2.0 * std::numbers::pi));
    const double k = std::cos(0.5 * (apart - turns)), modulus = std::abs(k);
    const double eta = 2.0 * std::asin(k * boost::math::jacobi_cd(modulus, w * sigma));
    const double rate = -2.0 * k * std::sqrt(1.0 - k * k) * w * boost::math::jacobi_sd(modulus, w * sigma);
    const double delta = turns + std::numbers::pi - eta, sum = c[0] + c[1];
    const Eigen::VectorXd theta = ends(apart, turn);
    const double kept = (c[0] * theta[0] + c[1] * theta[1]) / sum;  // no torque acts on both tubes together
    return {{kept + c[1] / sum * delta, kept - c[0] / sum * delta}, c[0] * c[1] / sum * rate};
  }

  Eigen::Vector2d ends(double apart, double turn) const { return {turn + apart, turn}; }

  /// Joints for which this is an equilibrium.
  Eigen::VectorXd joints(double apart, double turn) const {
    const State entry = at(apart, turn, length);
    Eigen::VectorXd q(4);
    q << beta[0], beta[1], entry.psi[0] - entry.moment * f[0], entry.psi[1] + entry.moment * f[1];
    return q;
  }

  /// alpha_1 - alpha_2 of that equilibrium, rad.
  double motors(double apart) const {
    const Eigen::VectorXd q = joints(apart, 0.0);
    return q[2] - q[3];
  }
  /// Its derivative by `apart`, the determinant at the motors, by finite differences of high order.
  double motorByEnd(double apart) const {
    const double h = 1e-3;
    return (8.0 * (motors(apart + h) - motors(apart - h)) - (motors(apart + 2 * h) - motors(apart - 2 * h))) / (12 * h);
  }
  /// The smallest end angle at which the curve has a fold; pi if it has none.
  double foldOfEnds() const {
    double low = 0.0, high = std::numbers::pi;
    for (int k = 0; k < 60; ++k) {
      const double middle = 0.5 * (low + high);
      (motorByEnd(middle) > 0.0 ? low : high) = middle;
    }
    return low;
  }
  /// alpha_1 - alpha_2 at which tubes snap that are rotated away from alignment, rad.
  double snapAngle() const { return motors(foldOfEnds()); }

  /// A branch at an equilibrium.
  static kinematics::Branch standingAt(const Eigen::VectorXd& q, const Eigen::VectorXd& end_angle) {
    kinematics::Branch branch;
    branch.known = true;
    branch.q = q;
    branch.end_angle.head(end_angle.size()) = end_angle;
    return branch;
  }
  /// The same at q = joints(apart, turn) for any turn.
  kinematics::Branch standingAt(const Eigen::VectorXd& q, double apart) const {
    const Eigen::Vector2d untwisted = ends(apart, 0.0);
    // The sum of c_i psi_i is constant along a tube pair; it gives the turn.
    const State entry = at(apart, 0.0, length);
    const double turn = q[2] + entry.moment * f[0] - entry.psi[0];
    return standingAt(q, (untwisted.array() + turn).matrix());
  }
  /// motorByEnd() for tubes that bend to opposite sides, apart = pi.
  double oppositeDeterminant() const {
    const double phase = w * length;
    return std::cos(phase) - c[0] * c[1] / (c[0] + c[1]) * (f[0] + f[1]) * w * std::sin(phase);
  }
};

}  // namespace tandem::test
