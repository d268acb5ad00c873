// SPDX-License-Identifier: Apache-2.0
#include "services/simulation/mechanism_tips.h"

#include "operation/convert.h"

namespace tandem::simulation {

dds::TipPoses MechanismTips::at(const MechanismSnapshot& snapshot) {
  if (snapshot.joint_resets != joint_resets_)
    follower_ = robots::makeEquilibriumFollower(setup_.robot);
  joint_resets_ = snapshot.joint_resets;
  const safety::RobotVector q = Eigen::VectorXd::Map(snapshot.joints.data(), snapshot.joint_count);
  const bool known = follower_.solveEquilibrium(q).empty();
  dds::TipPoses message = snapshot.head;
  int k = 0;
  for (const Eigen::Isometry3d& tip : follower_.mechanism().tips())
    dds::setTip(k++, known, tip.translation(), Eigen::Quaterniond(tip.linear()), message);
  return message;
}

}  // namespace tandem::simulation
