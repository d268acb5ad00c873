// SPDX-License-Identifier: Apache-2.0
/** @file The energy of unloaded tubes on a fine grid, its Hessian's inertia, and the determinant of the angles. */
#pragma once

#include <Eigen/Core>
#include <vector>

#include "kinematics/arm_model.h"

namespace tandem::test {

/** Energy of an unloaded arm over the angles psi_i(s), on a grid that holds every boundary:
 *
 *   sum_i integral c_i (psi_i' - tau_i)^2 / 2 ds - integral |sum_i b_i exp(i psi_i)|^2 / (2 K) ds
 *   + sum_i (psi_i(0) - alpha_i - integral of tau_i behind s = 0)^2 / (2 F_i)
 *
 * without the part that does not depend on psi. Shares no code with kinematics/ but the tubes' data. */
class EnergyOracle {
 public:
  using Angles = Eigen::MatrixXd;  ///< tubes x nodes, rad; undefined beyond a tube's end

  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kinematics::kMaxTubes, 1>;
  using Square = Eigen::
      Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kinematics::kMaxTubes, kinematics::kMaxTubes>;

  EnergyOracle(const kinematics::ConcentricTubeArm& arm, const Eigen::VectorXd& q, double longest_element);

  int nodes() const { return static_cast<int>(element_.size()) + 1; }
  double place(int node) const { return node == 0 ? 0.0 : element_[node - 1].end; }  ///< s, m
  /// Whether a tube reaches to a node.
  bool reaches(int tube, int node) const;

  /// The equilibrium with end angles theta, by the Runge-Kutta method; sets the corresponding motor angles.
  Angles shoot(const Vector& theta);
  const Vector& motors() const { return alpha_; }  ///< rad
  /// Determinant of d psi(s) / d theta, minimum over the nodes and the transmission; of the last shoot().
  double smallestDeterminant() const;
  /// d alpha / d theta of the last shoot().
  Square baseByEnd() const { return byEnd(-1e3); }

  /// Angles at the nodes of a shape that was sampled densely, by cubic interpolation.
  Angles interpolate(const std::vector<kinematics::ShapePoint>& shape) const;

  double value(const Angles& psi) const;  ///< J
  /// Number of directions in which the energy decreases from an equilibrium: negative eigenvalues of the Hessian.
  int negativeDirections(const Angles& psi) const;

 private:
  struct Element {
    double begin = 0.0, end = 0.0, stiffness = 0.0;
    Vector b, torsion, helix;  ///< K_i kappa_i, c_i, tau_i; 0 beyond the tube's end
  };
  /// Columns [psi, d psi / d theta], rows [angles, moments].
  using State = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 8, 5>;
  Square torqueByAngle(const Element& element, const Vector& psi) const;
  Vector torque(const Element& element, const Vector& psi) const;
  State slope(const Element& element, const State& x) const;
  Square byEnd(double s) const;  ///< d psi(s) / d theta in the transmission, s below zero

  kinematics::ConcentricTubeArm arm_;
  int n_;
  Vector beta_, alpha_, compliance_, turn_;
  std::vector<Element> element_;
  double smallest_determinant_ = 1.0;  ///< over the nodes
  State entry_;                        ///< at the entry point
};

}  // namespace tandem::test
