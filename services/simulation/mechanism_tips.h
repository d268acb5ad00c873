// SPDX-License-Identifier: Apache-2.0
/** @file True tip poses of simulated arms that move a common object. */
#pragma once

#include "robots/mechanisms.h"
#include "services/dds/messages.h"
#include "services/runtime/process.h"

namespace tandem::simulation {

/** Joints of the plant, and the message for their tips, in which the tips are not set yet. A plain struct. */
struct MechanismSnapshot {
  dds::TipPoses head;
  std::uint32_t joint_resets = 0;
  int joint_count = 0;
  std::array<double, safety::kMaxJoints> joints{};  ///< m, rad
};

/** Computes the tips at the joints of the plant, with the mechanism of the robot file. Allocates: not for the periodic
 * thread. */
class MechanismTips {
 public:
  /// @throw std::invalid_argument as robots::makeEquilibriumFollower() does.
  explicit MechanismTips(const runtime::Setup& setup)
      : setup_(setup), follower_(robots::makeEquilibriumFollower(setup.robot)) {}

  /// The message with the tips, which are invalid if no equilibrium is found.
  dds::TipPoses at(const MechanismSnapshot& snapshot);

 private:
  const runtime::Setup& setup_;
  robots::EquilibriumFollower follower_;
  std::uint32_t joint_resets_ = 0;
};

}  // namespace tandem::simulation
