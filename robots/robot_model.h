// SPDX-License-Identifier: Apache-2.0
/** @file Robot model: kinematic models and limits of all arms, and the layout of joint vectors. */
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "config/config.h"
#include "kinematics/arm_model.h"

namespace tandem::planning {
struct Gains;
class ReferenceTracker;
}  // namespace tandem::planning

namespace tandem::robots {

/** A robot's models and limits, built once from its file. */
class RobotModel {
 public:
  /// @throw std::invalid_argument as RobotType::makeModel() does.
  explicit RobotModel(const config::Robot& robot, const std::string& model = "rigid");

  /// Empty without Capability::kTips: see robots/mechanism.h.
  const std::vector<const kinematics::ArmModel*>& models() const { return models_; }
  const std::vector<const safety::ArmLimits*>& limits() const { return limits_; }
  /// Model on the wire.
  idl::Model kind() const { return kind_; }
  int armCount() const { return static_cast<int>(limits_.size()); }
  int jointCount() const { return offset_.back(); }
  int offset(int arm) const { return offset_[static_cast<std::size_t>(arm)]; }
  int size(int arm) const { return offset(arm + 1) - offset(arm); }
  /// Joints of all arms in one vector.
  safety::RobotVector stack(const std::vector<Eigen::VectorXd>& arms) const;
  /// Tracker of the references that this robot can follow: of its tips, or of its common object, which then has home as
  /// its posture. It refers to this object. @throw std::invalid_argument as control::makeResolver() does.
  std::unique_ptr<planning::ReferenceTracker> makeTracker(control::Method method,
                                                          const control::MethodParameters& parameters,
                                                          const planning::Gains& gains) const;

 private:
  idl::Model kind_;
  std::vector<std::unique_ptr<kinematics::ArmModel>> owned_;
  std::vector<safety::ArmLimits> owned_limits_;
  std::vector<const kinematics::ArmModel*> models_;
  std::vector<const safety::ArmLimits*> limits_;
  std::vector<int> offset_;
  safety::RobotVector home_;
};

}  // namespace tandem::robots
