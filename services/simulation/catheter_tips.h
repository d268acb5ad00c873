// SPDX-License-Identifier: Apache-2.0
/** @file True tip poses of simulated catheters. */
#pragma once

#include "robots/mechanisms.h"
#include "services/dds/messages.h"
#include "services/runtime/process.h"

namespace tandem::service {

/** The plant's joints, and the message that tells of the tips at them, without these. A plain struct. */
struct CatheterMoment {
  dds::TipPoses head;
  std::uint32_t placements = 0;
  int joint_count = 0;
  std::array<double, safety::kMaxJoints> joints{};  ///< m, rad
};

/** Settles where the plant's joints are: the simulated catheters are those of the robot file. Allocates: not for the
 * periodic thread. */
class CatheterTips {
 public:
  /// @throw std::invalid_argument as robots::makeRestFollower() does.
  explicit CatheterTips(const Setup& setup) : setup_(setup), follower_(robots::makeRestFollower(setup.robot)) {}

  /// The message with the tips; not valid where there is no rest.
  dds::TipPoses at(const CatheterMoment& moment);

 private:
  const Setup& setup_;
  robots::RestFollower follower_;
  std::uint32_t placements_ = 0;
};

}  // namespace tandem::service
