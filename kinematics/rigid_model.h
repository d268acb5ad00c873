// SPDX-License-Identifier: Apache-2.0
/** @file Concentric tubes that bend but do not twist: piecewise constant curvature, in closed form. */
#pragma once

#include <array>

#include "kinematics/arm_model.h"

namespace tandem::kinematics {

/** The torsionally rigid model (Webster et al. 2009, Sears & Dupont 2006).
 *
 * Where tubes overlap they share one curvature, the mean of their precurvatures weighted by bending stiffness:
 *   u(s) = sum_i E_i I_i R_z(alpha_i) [0, kappa_i(s), 0]^T / sum_i E_i I_i,
 * sums over the tubes present at s, kappa_i = 0 on the straight part. Between the points where a tube starts to curve
 * or ends, u is constant and the backbone is an arc of a circle.
 *
 * The Jacobian is exact. A rotation changes u of each section (Arc's derivatives). A translation moves the boundaries
 * that belong to the tube: a boundary at s_k with curvature u_l before and u_r behind adds the turn R(s_k)(u_l - u_r)
 * about p(s_k); the end of tube 1 adds R e_z along the backbone besides. Where boundaries of two tubes meet the
 * derivative jumps; the value given there is one-sided.
 */
class RigidModel final : public ArmModel {
 public:
  /// @throw std::invalid_argument for an arm without 2 to 4 tubes.
  explicit RigidModel(ConcentricTubeArm arm);

  const ConcentricTubeArm& arm() const override { return arm_; }
  ModelStatus tip(const JointsRef& q, Tip& tip) const noexcept override;
  ModelStatus shape(const JointsRef& q, int points, std::vector<ShapePoint>& shape) const override;

 private:
  enum class Part { kStraight, kCurved, kEnded };
  /// A piece of constant curvature that ends at `end`, where tube `owner` starts to curve or ends.
  struct Section {
    double start = 0.0;
    double end = 0.0;
    int owner = 0;
    Eigen::Vector3d u = Eigen::Vector3d::Zero();
    double stiffness = 0.0;  ///< sum of E I of the tubes present
    std::array<Part, kMaxTubes> part{};
  };
  /// At most two boundaries a tube.
  struct Sections {
    std::array<Section, 2 * kMaxTubes> section;
    int count = 0;
  };

  ModelStatus check(const JointsRef& q) const noexcept;
  Sections split(const JointsRef& q) const noexcept;

  ConcentricTubeArm arm_;
  std::array<double, kMaxTubes> stiffness_{};  ///< E I per tube, N m^2
};

}  // namespace tandem::kinematics
