// SPDX-License-Identifier: Apache-2.0
/** @file Catheter mechanisms: a grasped object, and a target arm pushed by an assist arm. */
#pragma once

#include <memory>

#include "config/cooperative.h"
#include "kinematics/grasp/grasped_object.h"
#include "robots/mechanism.h"

namespace tandem::robots {

/** Arms that grasp one object (section III of Norouzi-Ghazbi et al.), as Cosserat rods under their contact forces: see
 * kinematics/grasp/grasped_object.h. higherTasks() controls the internal forces. With Z their basis and C the contacts'
 * compliance,
 *
 *   Z^T C d(f - f*)/dq qdot = gain Z^T C (f* - f),
 *
 * where f* are the contact forces that balance the load and have the specified squeeze. Without loads the left side is
 * Z^T B J qdot, which is the contact consistency B (J - G^T) = 0. Controlled are as many combinations of the internal
 * forces as the joints of unloaded arms can change, largest gain first; those in the left null space of Z^T B J, with J
 * of unloaded arms, are not: a load makes their gains small instead of zero. residual() is the norm of the controlled
 * part of Z^T C (f - f*), the relative displacement that corresponds to the error of the internal forces; columns() has
 * the norm of the rest (`uncontrolled_m`) and the largest force and moment of f - f* at a contact. */
class GraspedObjectMechanism final : public Mechanism {
 public:
  /// @throw std::invalid_argument if the robot file has no object. @param robot  outlives this
  explicit GraspedObjectMechanism(const config::CooperativeRobot& robot);
  ~GraspedObjectMechanism() override;

  const std::vector<const safety::ArmLimits*>& limits() const override;
  RobotVector home() const override;
  std::string solveEquilibrium(const RobotVector& q) override;
  const Eigen::Isometry3d& pose() const override;
  const MotionJacobian& jacobian() const override;
  double length() const override;
  std::vector<control::Task> higherTasks(double gain) const override;
  double residual() const override;
  std::string infeasibility() const override;
  std::string error() const override { return errorOf(equilibrium()); }
  std::vector<std::pair<std::string, double>> columns() const override;
  std::vector<Eigen::Isometry3d> tips() const override;
  std::vector<std::optional<Twist>> tipWrenches() const override;
  std::vector<std::vector<Eigen::Vector3d>> shapes() const override;

  /// Reason why an equilibrium cannot be used, for example because a contact slips; empty: it can.
  std::string errorOf(const kinematics::grasp::GraspEquilibrium& equilibrium) const;
  const kinematics::grasp::GraspedObject& model() const;
  const RobotVector& joints() const;  ///< of the last equilibrium
  const kinematics::grasp::Grasp& grasp() const;
  const kinematics::grasp::GraspState& state() const;
  /// The last equilibrium with its derivatives with respect to joints and loads.
  const kinematics::grasp::GraspEquilibrium& equilibrium() const;
  /// Stiffness of the object's pose under the present loads, robot base frame.
  kinematics::grasp::Matrix6 stiffness() const;
  /// Contribution of one arm to it at the object's origin, without the geometric stiffness of forces that rotate with
  /// the object.
  kinematics::grasp::Matrix6 stiffnessOf(int contact) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/** A target arm and its assist arm (section IV). The common object is the target's tip; the contact force is controlled
 * to a constant. */
class AssistedMechanism final : public Mechanism {
 public:
  /// @throw std::invalid_argument if the robot file has no assistance. @param robot  outlives this
  explicit AssistedMechanism(const config::CooperativeRobot& robot);

  const std::vector<const safety::ArmLimits*>& limits() const override { return limits_; }
  RobotVector home() const override;
  std::string solveEquilibrium(const RobotVector& q) override;
  const Eigen::Isometry3d& pose() const override { return chain_.tip.pose; }
  const MotionJacobian& jacobian() const override { return jacobian_; }
  double length() const override { return length_; }
  std::vector<control::Task> lowerTasks(double gain) const override;
  double residual() const override { return chain_.gap; }
  std::vector<std::pair<std::string, double>> columns() const override;
  std::vector<Eigen::Isometry3d> tips() const override;
  std::vector<std::optional<Twist>> tipWrenches() const override;
  std::vector<std::vector<Eigen::Vector3d>> shapes() const override;

  const kinematics::assist::TargetAssist& model() const { return model_; }
  const kinematics::assist::Chain& chain() const { return chain_; }

 private:
  const config::CooperativeRobot& robot_;
  const config::Assistance& relation_;
  kinematics::assist::TargetAssist model_;
  std::vector<const safety::ArmLimits*> limits_;
  double length_;
  double push_;  ///< specified contact force, N; 0: that of the first equilibrium
  RobotVector joints_;
  kinematics::assist::ChainBranch branch_;
  kinematics::assist::Chain chain_;
  MotionJacobian jacobian_;
};

}  // namespace tandem::robots
