// SPDX-License-Identifier: Apache-2.0
/** @file Tubes and arms of concentric tubes, as a designer describes them. */
#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace tandem::kinematics {

/** One tube: a straight part, then a part of constant precurvature. SI units. */
struct Tube {
  double outer_diameter = 0.0;   ///< m
  double inner_diameter = 0.0;   ///< m
  double youngs_modulus = 0.0;   ///< Pa
  double poisson_ratio = 0.0;    ///< serves only in G = E / (2 (1 + nu))
  double straight_length = 0.0;  ///< L_s, m
  double curved_length = 0.0;    ///< L_c, m
  double curvature = 0.0;        ///< kappa, 1/m; alpha = 0 bends toward +x of the arm's base frame

  double length() const { return straight_length + curved_length; }
  /// E I, N m^2, with I = pi (d_o^4 - d_i^4) / 64.
  double bendingStiffness() const;
  /// G J, N m^2, with J = 2 I.
  double torsionalStiffness() const;
};

/** One arm: tubes from the innermost (tube 1, longest) outwards, where it stands and what it holds. */
struct ConcentricTubeArm {
  std::vector<Tube> tubes;  ///< 2 to 4
  Eigen::Isometry3d base =
      Eigen::Isometry3d::Identity();  ///< robot base frame <- arm base frame (s = 0, z into the body)
  Eigen::Isometry3d tool = Eigen::Isometry3d::Identity();  ///< tube 1's end frame <- tool tip frame

  int tubeCount() const { return static_cast<int>(tubes.size()); }
  int jointCount() const { return 2 * tubeCount(); }
};

}  // namespace tandem::kinematics
