// SPDX-License-Identifier: Apache-2.0
#include "services/console/grasped_object.h"

namespace tandem::console {

Eigen::Isometry3d objectPose(const config::GraspedObject& object, const std::vector<Eigen::Isometry3d>& tips) {
  using Eigen::Vector3d;
  const auto touch = [&](std::size_t k) -> Vector3d { return tips[k] * object.contacts[k].hand.translation(); };
  const auto place = [&](std::size_t k) -> Vector3d { return object.contacts[k].frame.translation(); };
  const kinematics::grasp::Contact& first = object.contacts[0];
  Eigen::Matrix3d turn = tips[0].linear() * first.hand.linear() * first.frame.linear().transpose();
  if (object.contacts.size() > 1 && first.type != kinematics::grasp::ContactType::kRigid)
    turn = Eigen::Quaterniond::FromTwoVectors(turn * (place(1) - place(0)), touch(1) - touch(0)) * turn;
  Vector3d middle = Vector3d::Zero();
  for (std::size_t k = 0; k < object.contacts.size(); ++k)
    middle += (touch(k) - turn * place(k)) / static_cast<double>(object.contacts.size());
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = middle;
  pose.linear() = turn;
  return pose;
}

}  // namespace tandem::console
