// SPDX-License-Identifier: Apache-2.0
/** @file Concentric tubes with bending but without torsion: piecewise constant curvature, in closed form. */
#pragma once

#include "kinematics/segmentation.h"

namespace tandem::kinematics {

/** The torsionally rigid model (Webster et al. 2009, Sears & Dupont 2006).
 *
 * Where tubes overlap they share one curvature, the mean of their precurvatures weighted by bending stiffness:
 *   u(s) = sum_i E_i I_i R_z(alpha_i) [0, kappa_i(s), 0]^T / sum_i E_i I_i,
 * sums over the tubes present at s, kappa_i(s) that of the tube's section. Between the points where a section of a tube
 * ends, u is constant and the backbone is an arc of a circle.
 *
 * The Jacobian is exact. A rotation changes u of each section (Arc's derivatives). A translation moves the boundaries
 * of the tube: a boundary at s_k with curvature u_l before and u_r behind adds the rotation R(s_k)(u_l - u_r)
 * about p(s_k); the end of tube 1 also adds R e_z along the backbone. If boundaries of two tubes coincide, the
 * derivative has a jump; the given value is one-sided.
 *
 * Along a helical tube the direction of bending turns: alpha_i plus the integral of tau_i from the motor replaces
 * alpha_i, and u turns with it. Then the backbone is the one that EndAngleSweep integrates for tubes whose torsional
 * stiffness is infinite (coupling 0), and derivatives of the backbone are central differences.
 */
class RigidModel final : public TubeModel {
 public:
  /// @throw std::invalid_argument as checkArm() does.
  explicit RigidModel(ConcentricTubeArm arm);

  using ArmModel::shape;
  using ArmModel::tip;
  ModelStatus tip(const JointsRef& q, Branch& branch, Tip& tip) const noexcept override;
  ModelStatus shape(const JointsRef& q,
                    const Wrench& wrench,
                    Branch& branch,
                    int points,
                    std::vector<ShapePoint>& shape) const override;
  /// Exact without helical tubes: a point at s is the tip of an arm that is cut there. Derivatives are one-sided if a
  /// boundary is at s.
  ModelStatus backbone(const JointsRef& q,
                       Branch& branch,
                       const std::vector<double>& s,
                       bool derivatives,
                       std::vector<BackbonePoint>& points) const override;

 private:
  ModelStatus helicalTip(const JointsRef& q, Tip& tip) const noexcept;
  void helicalShape(const JointsRef& q, const Segmentation& parts, int points, std::vector<ShapePoint>& shape) const;
  ModelStatus helicalBackbone(const JointsRef& q,
                              Branch& branch,
                              const std::vector<double>& s,
                              bool derivatives,
                              std::vector<BackbonePoint>& points) const;
  /// Curvature of the backbone in an interval, and the stiffness for it.
  struct Bend {
    Eigen::Vector3d u = Eigen::Vector3d::Zero();  ///< torsion-free frame, 1/m
    double stiffness = 0.0;                       ///< sum of E I of the tubes present, N m^2
  };
  /// Directions about which the tubes bend, torsion-free frame.
  using Axes = std::array<Eigen::Vector3d, kMaxTubes>;
  Axes axes(const JointsRef& q) const noexcept;
  Bend bend(const Segmentation::Interval& interval, const Axes& axes) const noexcept;
  /// Change of u by the rotation of a tube that is present.
  Eigen::Vector3d bendByRotation(const TubeSection& section, const Bend& bend, const Eigen::Vector3d& axis) const {
    const double share = section.bending_stiffness / bend.stiffness * section.curvature;
    return {-share * axis.y(), share * axis.x(), 0.0};
  }

  bool helical_ = false;  ///< a tube is
};

}  // namespace tandem::kinematics
