// SPDX-License-Identifier: Apache-2.0
#include "robots/orientation_freedom.h"

#include "robots/capability.h"

namespace tandem::robots {
namespace {

using planning::teleoperation::TipOrientation;

}  // namespace

std::string nameOf(TipOrientation orientation) {
  return orientation == TipOrientation::kAxis ? "axis" : orientation == TipOrientation::kFull ? "full" : "ignored";
}

planning::TaskFreedom orientationFreedom(const config::Robot& robot,
                                         const RobotModel& model,
                                         int arm,
                                         TipOrientation orientation) {
  std::vector<Eigen::VectorXd> home;
  for (const config::Arm& one : robot.arms)
    home.push_back(one.home);
  planning::FurtherTask task;
  task.kind = planning::teleoperation::taskOf(orientation);
  task.priority = 1;
  task.arm = task.other_arm = arm;
  planning::TrajectorySpec spec;
  spec.arm = arm;
  spec.other_arm = planning::kNoArm;
  spec.further = {task};
  const auto freedom = planning::taskFreedom({model.models(), model.limits()}, spec, model.stack(home));
  if (freedom.size() == 2)
    return freedom[1];
  planning::TaskFreedom none;  // the model has no solution at home
  none.rows = kinematics::findTaskKind(task.kind)->rows;
  return none;
}

std::string orientationRefusal(const config::Robot& robot, const RobotModel& model, TipOrientation orientation) {
  if (const std::string why = refusal(robot, Capability::kTips); !why.empty())
    return why;
  for (int k = 0; k < model.armCount(); ++k) {
    const planning::TaskFreedom freedom = orientationFreedom(robot, model, k, orientation);
    if (freedom.rank < freedom.rows)
      return "found " + nameOf(orientation) + " with " + robot.arms[static_cast<std::size_t>(k)].name +
             ", whose joints turn its tip with rank " + std::to_string(freedom.rank) +
             " behind its position (at home), expected rank " + std::to_string(freedom.rows);
  }
  return {};
}

void requireOrientation(const config::Deployment& deployment, const config::Robot& robot) {
  const TipOrientation orientation = deployment.teleoperation.options.rotation.followed;
  if (orientation == TipOrientation::kIgnored)
    return;
  if (const std::string why = orientationRefusal(robot, RobotModel(robot, deployment.model), orientation); !why.empty())
    throw config::Error(deployment.file.string(), 0, 0, "teleoperation.orientation", why);
}

}  // namespace tandem::robots
