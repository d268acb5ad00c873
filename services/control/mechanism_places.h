// SPDX-License-Identifier: Apache-2.0
/** @file Tip poses, shapes and contact forces of arms that move a common object, for display. */
#pragma once

#include <optional>
#include <vector>

#include "robots/mechanisms.h"
#include "robots/robot_model.h"
#include "services/dds/messages.h"
#include "services/runtime/process.h"

namespace tandem::control_service {

/** Tips and shapes at measured joints. Allocates; for the publishing thread. */
class MechanismPlaces {
 public:
  /// @throw std::invalid_argument as robots::makeEquilibriumFollower() does.
  MechanismPlaces(const runtime::Setup& setup, const robots::RobotModel& robot);

  /// @return whether all arms are measured and in equilibrium; tips and shapes are then those of this state.
  bool update(const dds::ActuationState& state);

  const Eigen::Isometry3d& tip(int arm) const { return tips_[static_cast<std::size_t>(arm)]; }
  /// Shape without stamp and frame; all points belong to tube 1.
  dds::Shape shape(int arm) const;

 private:
  const runtime::Setup& setup_;
  const robots::RobotModel& robot_;
  robots::EquilibriumFollower follower_;
  std::uint64_t session_ = 0;
  std::uint32_t joint_resets_ = 0;
  std::vector<Eigen::Isometry3d> tips_;
  std::vector<std::optional<robots::Twist>> wrenches_;
  std::vector<std::vector<Eigen::Vector3d>> shapes_;
  std::vector<float> radius_;  ///< of each arm, m
};

}  // namespace tandem::control_service
