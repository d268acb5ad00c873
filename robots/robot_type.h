// SPDX-License-Identifier: Apache-2.0
/** @file Robot type: interface of everything type-specific. docs/own-robot-type.md describes how to add one. */
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "config/config.h"
#include "kinematics/arm_model.h"
#include "robots/appearance.h"
#include "robots/capability.h"

namespace tandem::robots {

class Mechanism;

/** One type of robots, without state: all functions take the robot. A function that belongs to a capability is called
 * only for robots that have it. */
class RobotType {
 public:
  virtual ~RobotType() = default;

  /// In the plural, for messages: "concentric tubes".
  virtual std::string description() const = 0;
  virtual bool has(Capability capability) const noexcept = 0;
  /// @param arm  index in the robot's order
  virtual ArmAppearance appearance(const config::Robot& robot, int arm) const = 0;

  /// Wire value of a model that a deployment names.
  virtual idl::Model model(const std::string& name) const;
  /// Model of one arm, of every type with Capability::kTips. @param name  as in deployment files: "rigid"
  /// @throw std::invalid_argument "model: found ..." for a model that the type does not have.
  virtual std::unique_ptr<kinematics::ArmModel> makeModel(const config::Robot& robot,
                                                          int arm,
                                                          const std::string& name) const;
  /// Name of the model in which a wrench deforms an arm; empty: none.
  virtual std::string elasticModel() const;
  /// The number beside the pose in tables of tips: its name, and its value. @param q  joints of the arm, m and rad
  virtual std::string tipColumn() const;
  virtual double tipValue(const config::Robot& robot,
                          int arm,
                          const kinematics::JointsRef& q,
                          const kinematics::Tip& tip) const;
  /// Capability::kCommonPath. @param robot  outlives the mechanism
  virtual std::unique_ptr<Mechanism> makeMechanism(const config::Robot& robot) const;
  /// The grasped object; null: none.
  virtual const config::GraspedObject* graspedObject(const config::Robot& robot) const noexcept;
};

/// The type of a robot. @throw std::invalid_argument for a robot whose type is not listed.
const RobotType& typeOf(const config::Robot& robot);
/// All types.
const std::vector<const RobotType*>& robotTypes();

}  // namespace tandem::robots
