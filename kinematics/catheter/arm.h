// SPDX-License-Identifier: Apache-2.0
/** @file Parameters of a catheter with one bending section, and its constant-curvature model in closed form. */
#pragma once

#include "kinematics/arm_model.h"
#include "kinematics/constant_curvature.h"

namespace tandem::kinematics::catheter {

/// Joints of a catheter arm, q = [insertion (m), roll (rad), bend (rad)].
enum Joint { kInsertion, kRoll, kBend };
inline constexpr int kJoints = 3;

/** A tendon-driven catheter: a passive proximal end, straight unless loaded, and a distal end that bends as one arc.
 *
 * At roll 0 a positive bend is toward +x of the arm's base frame, a negative one toward -x. In the angles of Norouzi-
 * Ghazbi et al., Table I: insertion = d_1, roll = theta_2 - pi, bend = pi - 2 theta_3, L as there, d_7 the tool's z. */
struct Arm {
  double bending_length = 0.0;                             ///< L, of the distal end, m
  Eigen::Isometry3d base = Eigen::Isometry3d::Identity();  ///< robot base frame <- arm base frame, z into the body
  Eigen::Isometry3d tool = Eigen::Isometry3d::Identity();  ///< frame at the distal end's tip <- tool tip frame
};

/** @throw std::invalid_argument unless the bending length is above zero and all numbers are finite. */
void checkArm(const Arm& arm);

/// Whether joints can be answered: three finite numbers, insertion not below zero.
ModelStatus checkJoints(const JointsRef& q) noexcept;

/** Constant curvature: exact without a load, and for a distal end whose tendons bend it evenly.
 *
 * Pose = base T_z(insertion) R_z(roll) Arc(bend / L) tool: equation (7) of Norouzi-Ghazbi et al.; its Jacobian is
 * equation (8) without the misprints of docs/models-catheter.md, smooth through the straight pose. Allocates nothing
 * but in shape(). */
class ConstantCurvature {
 public:
  /// @throw std::invalid_argument as checkArm() does.
  explicit ConstantCurvature(const Arm& arm);
  const Arm& arm() const { return arm_; }

  /// Tool tip and its Jacobian (6 x 3) in the robot base frame; `tip` is untouched unless kOk is returned.
  ModelStatus tip(const JointsRef& q, Tip& tip) const noexcept;

  /// The same for the base of bending: the frame where the distal end begins, turned by the roll.
  ModelStatus bendingBase(const JointsRef& q, Tip& base) const noexcept;

  /// From the base of bending to the tool tip: pose, and its twist (rows linear first, axes of the base of bending)
  /// by bend. The part that is hung onto another base in equation (11).
  static void distal(const Arm& arm, double bend, Eigen::Isometry3d& pose, Eigen::Matrix<double, 6, 1>& by_bend);

  /// `points` backbone frames, evenly spaced from the entry point to the end of the distal part, robot base frame.
  ModelStatus shape(const JointsRef& q, int points, std::vector<ShapePoint>& shape) const;

 private:
  Arm arm_;
};

}  // namespace tandem::kinematics::catheter
