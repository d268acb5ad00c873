// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include "robots/catheters.h"

namespace tandem::robots {

namespace assist = kinematics::assist;
namespace catheter = kinematics::catheter;

namespace {

const config::Assistance& relationOf(const config::CooperativeRobot& robot) {
  if (!robot.assistance)
    throw std::invalid_argument(robot.name + ": found no assistance, expected an arm that pushes another one");
  return *robot.assistance;
}

/// Points along a catheter with a wrench at its tool tip, which rotates with the roll or not.
std::vector<Eigen::Vector3d> along(const catheter::ElasticCatheter& model,
                                   const Eigen::Vector3d& q,
                                   const kinematics::Wrench& wrench) {
  kinematics::cosserat::RodBranch branch;
  std::vector<kinematics::cosserat::RodPoint> points;
  std::vector<Eigen::Vector3d> places;
  if (model.shape(q, wrench, branch, 60, points) == kinematics::ModelStatus::kOk) {
    for (const auto& point : points)
      places.push_back(point.pose.translation());
    places.push_back(points.back().pose * model.arm().arm.tool.translation());
  }
  return places;
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

std::vector<std::vector<Eigen::Vector3d>> AssistedMechanism::shapes() const {
  // The whole target as one rod would not have the contact in its middle: its proximal end is a separate rod up to the
  // base of bending, followed by the arc.
  const catheter::ElasticArm& target = relation_.pair.target;
  kinematics::cosserat::Rod rod = catheter::rodOf(target);
  rod.sections.resize(1);
  rod.actuators.clear();
  rod.sections[0].length = joints_[0];
  std::vector<Eigen::Vector3d> places;
  const kinematics::cosserat::RodModel proximal(rod);
  kinematics::cosserat::RodInput input(rod);
  input.base = target.arm.base;
  input.first_length = joints_[0];
  // The wrench at the contact, transferred to the rod's end: the base of bending.
  const Eigen::Isometry3d bending_base = chain_.contact * relation_.pair.contact.inverse();
  const Eigen::Vector3d lever = chain_.contact.translation() - bending_base.translation();
  input.tip = chain_.wrench;
  input.tip.tail<3>() += lever.cross(chain_.wrench.head<3>());
  kinematics::cosserat::RodBranch branch;
  std::vector<kinematics::cosserat::RodPoint> points;
  if (proximal.shape(input, branch, 40, points) == kinematics::ModelStatus::kOk) {
    for (const auto& point : points)
      places.push_back(point.pose.translation());
  }
  const Eigen::Isometry3d rolled = bending_base * Eigen::AngleAxisd(joints_[1], Eigen::Vector3d::UnitZ());
  for (int k = 1; k <= 40; ++k) {
    catheter::Arm part = target.arm;
    part.bending_length *= k / 40.0;
    part.tool.setIdentity();
    Eigen::Isometry3d pose;
    Eigen::Matrix<double, 6, 1> by_bend;
    catheter::ConstantCurvature::distal(part, joints_[2] * k / 40.0, pose, by_bend);
    places.push_back((rolled * pose).translation());
  }
  places.push_back(chain_.tip.pose.translation());
  return {places, along(catheter::ElasticCatheter(relation_.pair.assist), joints_.tail<3>(), -chain_.wrench)};
}

}  // namespace tandem::robots
