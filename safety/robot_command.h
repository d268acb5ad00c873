// SPDX-License-Identifier: Apache-2.0
/** @file Command for a whole robot and its part for each arm, common to hal and sim. */
#pragma once

#include <array>

#include "safety/arm_supervisor.h"
#include "safety/command_monitor.h"

namespace tandem::safety {

/** Command for all arms: the content of tandem_msgs/ActuationCommand, with its age looked up. Arrays over joints are
 * indexed arm * kMaxJointsPerArm + joint. */
struct RobotCommand {
  StreamHeader header;
  std::array<DriveRequest, kMaxArms> request{};
  std::array<JointMask, kMaxArms> without{};  ///< kRecover: joints not to be used
  std::array<bool, kMaxArms> unseen{};  ///< kRecover: the sender cannot have received the fault that the arm is in
  std::array<bool, kMaxArms> moving{};
  std::array<double, kMaxJoints> velocity{};  ///< m/s, rad/s
  std::array<double, kMaxJoints> position{};  ///< m, rad

  /// Part of one arm with this number of joints, with the check of the whole stream.
  ArmRequest forArm(int arm, int joint_count, const StreamCheck& checked) const noexcept {
    const auto index = static_cast<std::size_t>(arm);
    const auto first = index * static_cast<std::size_t>(kMaxJointsPerArm);
    ArmRequest part;
    part.request = request[index];
    part.lost = without[index];
    part.unseen = unseen[index];
    part.moving = moving[index];
    part.motion.stream = checked.faults;
    part.motion.age_excess = checked.age_excess;
    part.motion.velocity = Eigen::Map<const Eigen::VectorXd>(velocity.data() + first, joint_count);
    part.motion.position = Eigen::Map<const Eigen::VectorXd>(position.data() + first, joint_count);
    return part;
  }
};

}  // namespace tandem::safety
