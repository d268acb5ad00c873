// SPDX-License-Identifier: Apache-2.0
#include "services/simulation/catheter_tips.h"

#include "operation/convert.h"

namespace tandem::service {

dds::TipPoses CatheterTips::at(const CatheterMoment& moment) {
  if (moment.placements != placements_)
    follower_ = robots::makeRestFollower(setup_.robot);
  placements_ = moment.placements;
  const safety::RobotVector q = Eigen::VectorXd::Map(moment.joints.data(), moment.joint_count);
  const bool known = follower_.settle(q).empty();
  dds::TipPoses message = moment.head;
  int k = 0;
  for (const Eigen::Isometry3d& tip : follower_.mechanism().tips())
    dds::setTip(k++, known, tip.translation(), Eigen::Quaterniond(tip.linear()), message);
  return message;
}

}  // namespace tandem::service
