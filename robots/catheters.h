// SPDX-License-Identifier: Apache-2.0
/** @file Cooperating catheters as mechanisms: an object held together, and a target arm that an assist arm pushes. */
#pragma once

#include <memory>

#include "config/cooperative.h"
#include "kinematics/grasp/held.h"
#include "robots/mechanism.h"

namespace tandem::robots {

/** Arms that hold one object (section III of Norouzi-Ghazbi et al.), as Cosserat rods under their contact forces: see
 * kinematics/grasp/held.h. above() holds the internal forces: with Z their basis and C the contacts' compliance,
 *
 *   Z^T C d(f - f*)/dq qdot = gain Z^T C (f* - f),        f* the forces that answer the load and squeeze as is asked
 * for.
 *
 * Where nothing is loaded the left side is Z^T B J qdot: the contact consistency B (J - G^T) = 0. drift() is
 * |Z^T C (f - f*)|: by how much the arms, were they free, would come apart, or into each other, other than as wanted.
 */
class HeldObjectMechanism final : public Mechanism {
 public:
  /// @throw std::invalid_argument where the robot file has no object. @param robot  outlives this
  explicit HeldObjectMechanism(const config::CooperativeRobot& robot);
  ~HeldObjectMechanism() override;

  const std::vector<const safety::ArmLimits*>& limits() const override;
  RobotVector home() const override;
  std::string settle(const RobotVector& q) override;
  const Eigen::Isometry3d& pose() const override;
  const MotionJacobian& jacobian() const override;
  double length() const override;
  std::vector<control::Task> above(double gain) const override;
  double drift() const override;
  std::string impossible() const override;
  std::string trouble() const override { return troubleOf(rest()); }
  std::vector<std::pair<std::string, double>> facts() const override;
  std::vector<Eigen::Isometry3d> tips() const override;
  std::vector<std::vector<Eigen::Vector3d>> shapes() const override;

  /// What is wrong with a rest of this object, in words; empty: nothing.
  std::string troubleOf(const kinematics::grasp::Hold& rest) const;
  const kinematics::grasp::HeldObject& model() const;
  const RobotVector& joints() const;  ///< of the last rest
  const kinematics::grasp::Grasp& grasp() const;
  const kinematics::grasp::GraspState& state() const;
  /// The rest with its derivatives: stiffness under the loads that there are, what a load does.
  const kinematics::grasp::Hold& rest() const;
  /// Stiffness of the object's pose under the loads that there are, robot base frame; and what arm k alone adds to it
  /// at the object's origin, without what forces add that turn with the object.
  kinematics::grasp::Matrix6 stiffness() const;
  kinematics::grasp::Matrix6 stiffnessOf(int contact) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/** A target arm and the arm that assists it (section IV): the target's tip is moved, the contact pushed as before. */
class AssistedMechanism final : public Mechanism {
 public:
  /// @throw std::invalid_argument where the robot file has no assistance. @param robot  outlives this
  explicit AssistedMechanism(const config::CooperativeRobot& robot);

  const std::vector<const safety::ArmLimits*>& limits() const override { return limits_; }
  RobotVector home() const override;
  std::string settle(const RobotVector& q) override;
  const Eigen::Isometry3d& pose() const override { return chain_.tip.pose; }
  const MotionJacobian& jacobian() const override { return jacobian_; }
  double length() const override { return length_; }
  std::vector<control::Task> below(double gain) const override;
  double drift() const override { return chain_.gap; }
  std::vector<std::pair<std::string, double>> facts() const override;
  std::vector<Eigen::Isometry3d> tips() const override;
  std::vector<std::vector<Eigen::Vector3d>> shapes() const override;

  const kinematics::assist::TargetAssist& model() const { return model_; }
  const kinematics::assist::Chain& chain() const { return chain_; }

 private:
  const config::CooperativeRobot& robot_;
  const config::Assistance& relation_;
  kinematics::assist::TargetAssist model_;
  std::vector<const safety::ArmLimits*> limits_;
  double length_;
  double push_;  ///< wanted, N; 0: that of the first rest
  RobotVector joints_;
  kinematics::assist::ChainBranch branch_;
  kinematics::assist::Chain chain_;
  MotionJacobian jacobian_;
};

}  // namespace tandem::robots
