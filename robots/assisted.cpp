// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include "kinematics/assist/chain_shape.h"
#include "robots/catheters.h"
#include "robots/detail/places.h"

namespace tandem::robots {

namespace assist = kinematics::assist;

namespace {

const config::Assistance& relationOf(const config::CooperativeRobot& robot) {
  if (!robot.assistance)
    throw std::invalid_argument(robot.name + ": found no assistance, expected an arm that pushes another one");
  return *robot.assistance;
}

}  // namespace

AssistedMechanism::AssistedMechanism(const config::CooperativeRobot& robot)
    : robot_(robot), relation_(relationOf(robot)), model_(relation_.pair), push_(relation_.push) {
  for (const int arm : {relation_.target, relation_.assist})
    limits_.push_back(&robot.arms[static_cast<std::size_t>(arm)].limits);
  length_ = relation_.pair.target.arm.bending_length;
}

RobotVector AssistedMechanism::home() const { return robot_.home(); }

std::string AssistedMechanism::solveEquilibrium(const RobotVector& q) {
  assist::Chain chain;
  const assist::Status status = model_.solve(q, branch_, chain);
  if (status != assist::Status::kOk)
    return std::string(assist::describe(status));
  chain_ = chain;
  joints_ = q;
  jacobian_ = chain.tip.jacobian;
  if (push_ == 0.0)
    push_ = chain.push;
  return {};
}

std::vector<control::Task> AssistedMechanism::lowerTasks(double gain) const {
  // The rotation of the contact normal is left to the feedback.
  control::Task task;
  task.jacobian = chain_.contact.linear().col(2).transpose() * chain_.wrench_by_joints.topRows<3>();
  task.velocity.setConstant(1, gain * (push_ - chain_.push));
  return {task};
}

std::vector<std::pair<std::string, double>> AssistedMechanism::columns() const {
  const Eigen::Vector3d normal = chain_.contact.linear().col(2);
  const Eigen::Vector3d force = chain_.wrench.head<3>();
  return {{"push_N", chain_.push},
          {"across_N", (force - normal.dot(force) * normal).norm()},
          {"moment_Nm", chain_.wrench.tail<3>().norm()},
          {"beyond_mm", 1e3 * assist::distanceBeyondReach(relation_.pair.target.arm, robot_.range(),
                                                          chain_.tip.pose.translation())}};
}

std::vector<Eigen::Isometry3d> AssistedMechanism::tips() const {
  // Tip of the assist arm: the contact frame, rotated by the roll.
  Eigen::Isometry3d assist = chain_.contact * Eigen::AngleAxisd(joints_[4], Eigen::Vector3d::UnitZ());
  return {chain_.tip.pose, assist};
}

std::vector<std::optional<Twist>> AssistedMechanism::tipWrenches() const {
  // The target is pushed at its base of bending, not at its tip.
  return {std::nullopt, Twist(-chain_.wrench)};
}

std::vector<std::vector<Eigen::Vector3d>> AssistedMechanism::shapes() const {
  const auto shape = assist::shapeOf(relation_.pair, joints_, branch_, chain_, 40);
  if (!shape)
    return {{}, {}};
  return {placesOf(shape->target, chain_.tip.pose.translation()),
          placesOf(shape->assist, chain_.contact.translation())};
}

}  // namespace tandem::robots
