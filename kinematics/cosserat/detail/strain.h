// SPDX-License-Identifier: Apache-2.0
/** @file Constitutive law of a cross-section, rod and tendons together. */
#pragma once

#include "kinematics/cosserat/rod.h"

namespace tandem::kinematics::cosserat {

/** Cross-section law for the sweep: all numbers in units of a length and a stiffness, inputs included. */
struct SectionLaw {
  double length = 0.0;
  Eigen::Vector3d moment_compliance, force_compliance;  ///< 1 / K_me, 1 / K_ne
  Eigen::Vector3d curvature;                            ///< kappa^0 with the contribution of the curvature actuators
  Eigen::Vector3d force, moment;                        ///< densities, robot base frame
  int tendons = 0;                                      ///< number of tendons in this section
  std::array<int, kMaxActuators> actuator{};            ///< of each tendon
  std::array<Eigen::Vector3d, kMaxActuators> offset{};
  std::array<double, kMaxActuators> tension{};
  /// Derivative of kappa^0 by the inputs of curvature actuators.
  Eigen::Matrix<double, 3, kMaxActuators> by_input = Eigen::Matrix<double, 3, kMaxActuators>::Zero();
};

/** Strains of a cross-section and their derivatives by its load; vectors in the rod's frame. The result for one load,
 * extrapolated with the compliance, is the start of the search for the next one. */
struct Strain {
  Eigen::Vector3d u = Eigen::Vector3d::Zero();   ///< kappa
  Eigen::Vector3d v = Eigen::Vector3d::UnitZ();  ///< nu
  Vector6 load = Vector6::Zero();                ///< (m, n) of these strains
  Matrix6 compliance = Matrix6::Zero();          ///< (u, v) by (m, n)
  Eigen::Matrix<double, 6, kMaxActuators> by_input = Eigen::Matrix<double, 6, kMaxActuators>::Zero();
};

/** Solves for the strains under the moment m and the force n that rod and tendons carry together:
 *    K_me (u - u0) + sum tau_i r_i x w_i/|w_i| = m,   K_ne (v - e_z) + sum tau_i w_i/|w_i| = n,   w_i = v + u x r_i:
 * equations (12.c, d) with the tendons of Rucker and Webster 2011, whose tension acts along the tendon. The left sides
 * are the gradient of a convex function, so the solution is unique.
 * @param strain result for a similar load, or strains without compliance @return false if it does not converge */
bool solveStrain(const SectionLaw& law, const Eigen::Vector3d& m, const Eigen::Vector3d& n, Strain& strain) noexcept;

}  // namespace tandem::kinematics::cosserat
