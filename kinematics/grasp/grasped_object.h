// SPDX-License-Identifier: Apache-2.0
/** @file Static equilibrium of elastic arms and a grasped object, with all derivatives. */
#pragma once

#include "kinematics/catheter/elastic.h"
#include "kinematics/grasp/grasp.h"

namespace tandem::kinematics::grasp {

/** Why there is no equilibrium. */
enum class GraspStatus {
  kOk,
  kArm,        ///< an arm has no answer: GraspEquilibrium::arm, GraspEquilibrium::arm_status
  kNotFinite,  ///< a number of the grasp is not finite, or joints are not as many as the arms have
  kNotHeld     ///< no forces carry the load with all contacts closed
};
std::string_view describe(GraspStatus status);

/// By contacts: components of all of them both ways.
using ContactSquare = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxRows, kMaxRows>;

/** An equilibrium, and the start for the search of the next one. */
struct GraspEquilibrium {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< robot base frame <- object frame
  ContactVector force;                                     ///< on the object, contact components
  std::array<cosserat::RodBranch, kMaxContacts> branches;
  std::array<LoadedTip, kMaxContacts> tips;  ///< under those forces
  GraspState state;

  ContactSquare compliance;       ///< of the arms at the contacts, by contact components that keep their frames
  Matrix6 stiffness;              ///< wrench at the object's origin that holds it displaced by a twist: with load
  Matrix6 displacement_by_load;   ///< its inverse, compliance of the object; least norm where no contact constrains it
  ObjectJacobian jacobian;        ///< of the pose by the joints, loads as they are: H where nothing is loaded
  ContactMatrix force_by_joints;  ///< of `force`, N per m or rad
  ObjectMatrix force_by_load;     ///< of `force`, by a wrench at the object's origin
  /// Directions in which the equilibrium is no minimum of energy, joints held; 0: stable. Of each arm, how many are
  /// left when its tip is held in place as well.
  int unstable = 0;
  std::array<int, kMaxContacts> buckled{};

  GraspStatus status =
      GraspStatus::kNotHeld;  ///< of the last solveEquilibrium(); all else is of the last one that was kOk
  int arm = 0;                ///< for kArm
  ModelStatus arm_status = ModelStatus::kOk;
};

/** Arms as Cosserat rods that hold one object (section III of Norouzi-Ghazbi et al.) under their contact forces.
 *
 * With g the residual of the contacts, x_k the tips, X the object, A_k and D_k the derivatives of g by both
 * (Touch::rows),
 *
 *   g(x, X) = 0,    x_k = tip_k(q_k, -A_k^T f_k),    D^T f + w = 0
 *
 * by Newton's method with exact derivatives: forces turn with the object and their levers with tip and object. Motions
 * of the object that change nothing (two points: the turn about the line between them) are left as they are. Allocates
 * nothing. */
class GraspedObject {
 public:
  /// @throw std::invalid_argument as Grasp and catheter::ElasticCatheter do, or unless there is an arm a contact
  GraspedObject(const Grasp& grasp, const std::vector<catheter::ElasticArm>& arms);
  const Grasp& grasp() const { return grasp_; }
  const std::vector<catheter::ElasticCatheter>& arms() const { return arms_; }

  /// A memory that begins where tips touch without a force.
  GraspEquilibrium start(const Eigen::Isometry3d& object) const;

  /// The equilibrium at joints under a wrench at the object's origin that keeps its direction; `equilibrium` is the
  /// last one and becomes this one, but for its status it stays as it is unless kOk is returned.
  GraspStatus solveEquilibrium(const JointsRef& q, const Wrench& load, GraspEquilibrium& equilibrium) const noexcept;

  /// Wrench that arm k has at its tool tip in equilibrium.
  Wrench wrenchOn(int arm, const GraspEquilibrium& equilibrium) const;

 private:
  struct Linear;
  using Wrenches = std::array<Wrench, kMaxContacts>;
  GraspStatus tips(const JointsRef& q, GraspEquilibrium& equilibrium, Wrenches& applied) const;
  void linearise(const GraspEquilibrium& equilibrium,
                 const Wrenches& applied,
                 const Wrench& load,
                 Linear& linear) const;
  bool evaluate(GraspEquilibrium& equilibrium) const;
  void differentiate(GraspEquilibrium& equilibrium, const Linear& linear) const;
  int instability(GraspEquilibrium& equilibrium, const Linear& linear) const;

  Grasp grasp_;
  std::vector<catheter::ElasticCatheter> arms_;
};

}  // namespace tandem::kinematics::grasp
