// SPDX-License-Identifier: Apache-2.0
#include "robots/robot_model.h"

#include <stdexcept>

#include "planning/reference_tracker.h"
#include "robots/robot_type.h"

namespace tandem::robots {

RobotModel::RobotModel(const config::Robot& robot, const std::string& model) : kind_(typeOf(robot).model(model)) {
  offset_.push_back(0);
  for (const config::Arm& arm : robot.arms) {
    if (has(robot, Capability::kTips))
      owned_.push_back(typeOf(robot).makeModel(robot, static_cast<int>(owned_.size()), model));
    owned_limits_.push_back(arm.limits);
    offset_.push_back(offset_.back() + arm.jointCount());
  }
  for (const auto& owned : owned_)
    models_.push_back(owned.get());
  for (const safety::ArmLimits& limits : owned_limits_)
    limits_.push_back(&limits);
  std::vector<Eigen::VectorXd> home;
  for (const config::Arm& arm : robot.arms)
    home.push_back(arm.home);
  home_ = stack(home);
}

std::unique_ptr<planning::ReferenceTracker> RobotModel::makeTracker(control::Method method,
                                                                    const control::MethodParameters& parameters,
                                                                    const planning::Gains& gains) const {
  if (!models_.empty())
    return std::make_unique<planning::ReferenceTracker>(models_, limits_, method, parameters, gains);
  return std::make_unique<planning::ReferenceTracker>(
      planning::ReferenceTracker::ofObject(limits_, home_, method, parameters, gains));
}

safety::RobotVector RobotModel::stack(const std::vector<Eigen::VectorXd>& arms) const {
  if (static_cast<int>(arms.size()) != armCount()) {
    throw std::invalid_argument("found joints of " + std::to_string(arms.size()) + " arms, expected " +
                                std::to_string(armCount()));
  }
  safety::RobotVector q(jointCount());
  for (int k = 0; k < armCount(); ++k) {
    const Eigen::VectorXd& joints = arms[static_cast<std::size_t>(k)];
    if (joints.size() != size(k))
      throw std::invalid_argument("arm " + std::to_string(k) + ": found " + std::to_string(joints.size()) +
                                  " joints, expected " + std::to_string(size(k)));
    q.segment(offset(k), size(k)) = joints;
  }
  return q;
}

}  // namespace tandem::robots
