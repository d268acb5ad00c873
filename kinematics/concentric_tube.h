// SPDX-License-Identifier: Apache-2.0
/** @file Parameters of concentric tubes and of arms made of them. */
#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace tandem::kinematics {

inline constexpr int kMaxTubes = 4;
/// Most sections that one tube can have.
inline constexpr int kMaxTubeSections = 8;

/// One number per tube, from the innermost; zero for tubes that an arm does not have.
using TubeVector = Eigen::Matrix<double, kMaxTubes, 1>;
using TubeMatrix = Eigen::Matrix<double, kMaxTubes, kMaxTubes>;

/// Translations and rotations of a joint vector [beta, alpha], m and rad.
struct TubeJoints {
  explicit TubeJoints(const Eigen::Ref<const Eigen::VectorXd>& q);
  TubeVector beta = TubeVector::Zero(), alpha = TubeVector::Zero();
};

/** Part of a tube with constant properties. */
struct TubeSection {
  double length = 0.0;               ///< m, above zero
  double curvature = 0.0;            ///< kappa, 1/m; at alpha = 0 positive bends toward +x of the arm's base frame
  double bending_stiffness = 0.0;    ///< E I, N m^2, above zero
  double torsional_stiffness = 0.0;  ///< G J, N m^2, above zero
  /// tau, rad/m: the free tube is a helix of this torsion, a circle at 0; toward the tip, the direction in which it
  /// bends turns about the tube's own axis by tau per length. 0 where the curvature is 0.
  double helix_torsion = 0.0;
};

/** One tube: sections of constant precurvature and stiffness, from the proximal end to the tip. SI units. */
struct Tube {
  double outer_diameter = 0.0;        ///< m
  double inner_diameter = 0.0;        ///< m
  double youngs_modulus = 0.0;        ///< Pa
  double poisson_ratio = 0.0;         ///< only used in G = E / (2 (1 + nu))
  std::vector<TubeSection> sections;  ///< 1 to kMaxTubeSections

  /// Sum of the sections' lengths, m.
  double length() const;
  /// E I of the tube's cross-section, N m^2, with I = pi (d_o^4 - d_i^4) / 64.
  double bendingStiffness() const;
  /// G J of the tube's cross-section, N m^2, with J = 2 I.
  double torsionalStiffness() const;
  /// Appends a section with the stiffness of the tube's cross-section. m, 1/m, rad/m.
  void addSection(double section_length, double curvature, double helix_torsion = 0.0);
  /// Angle by which the direction of bending turns over the first `along` of the tube, m: integral of tau, rad.
  double helixAngle(double along) const;
  bool isHelical() const;  ///< a section has a tau that is not 0
};

/** One arm: tubes from the innermost (tube 1, longest) outwards, its base and its tool. */
struct ConcentricTubeArm {
  std::vector<Tube> tubes;  ///< 2 to 4
  Eigen::Isometry3d base =
      Eigen::Isometry3d::Identity();  ///< robot base frame <- arm base frame (s = 0, z into the body)
  Eigen::Isometry3d tool = Eigen::Isometry3d::Identity();  ///< tube 1's end frame <- tool tip frame
  /// m: permitted distance of a tube's start in front of the entry point, or of its end beyond the tube inside it,
  /// where it is cut off. Rounding by default; more if joints are readings, or tube lengths differ from those of the
  /// limits.
  double tolerance = 1e-9;

  int tubeCount() const { return static_cast<int>(tubes.size()); }
  int jointCount() const { return 2 * tubeCount(); }
};

/** Checks the assumptions of every model.
 * @throw std::invalid_argument that names tube and section: not 2 to 4 tubes, no section or too many, a length or a
 * stiffness that is not above zero, a number that is not finite, a straight section with torsion. */
void checkArm(const ConcentricTubeArm& arm);

}  // namespace tandem::kinematics
