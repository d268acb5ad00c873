// SPDX-License-Identifier: Apache-2.0
/** @file True tip poses of the simulated robot. */
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "kinematics/arm_model.h"
#include "sim/plant_options.h"

namespace tandem::sim {

/** An arm as the plant has it: that of the robot file with random errors of its tubes, or those given.
 * @param arm index in the robot: every arm and every tube has random numbers of its own */
kinematics::ConcentricTubeArm withErrors(kinematics::ConcentricTubeArm tubes, int arm, const PlantOptions& options);

/// Models of arms of one type, in the robot's order.
using ArmModels = std::vector<std::unique_ptr<kinematics::ArmModel>>;

/** Tips of all arms of the plant, followed along the path of the joints.
 *
 * Elastic arms remember by which way they came (kinematics/branch.h); when the equilibrium that an arm is in ends, it
 * snaps into another one, and that is counted. After construction nothing allocates or throws. */
class PlantTips {
 public:
  /// @throw std::invalid_argument for a force on an arm that there is not, or on a model that carries none.
  PlantTips(ArmModels models, const PlantOptions& options);

  /// The joints are put elsewhere: the next update is a cold start.
  void restart() noexcept;
  /// The joints of an arm are at q now (m, rad). Nothing is computed where they have not moved.
  void update(int arm, const safety::ArmVector& q) noexcept;

  int armCount() const noexcept { return static_cast<int>(arms_.size()); }
  /// Whether pose() is that of the last update; otherwise it is older, and status() says why.
  bool valid(int arm) const noexcept { return status(arm) == kinematics::ModelStatus::kOk; }
  kinematics::ModelStatus status(int arm) const noexcept { return arms_[static_cast<std::size_t>(arm)].status; }
  /// Robot base frame <- tool tip frame.
  const Eigen::Isometry3d& pose(int arm) const noexcept { return arms_[static_cast<std::size_t>(arm)].tip.pose; }
  /// How often this arm has snapped since construction.
  std::uint32_t snaps(int arm) const noexcept { return arms_[static_cast<std::size_t>(arm)].snaps; }
  /// Least elastic stability of the arm where it is now: 0 where it snaps, 1 where nothing interacts.
  double stability(int arm) const noexcept { return arms_[static_cast<std::size_t>(arm)].tip.stability; }

 private:
  struct Arm {
    std::unique_ptr<kinematics::ArmModel> model;
    kinematics::Wrench wrench = kinematics::Wrench::Zero();
    kinematics::Branch branch;
    kinematics::LoadedTip tip;
    kinematics::ModelStatus status = kinematics::ModelStatus::kNotFinite;
    safety::ArmVector q;  ///< of the last update; empty before the first
    std::uint32_t snaps = 0;
  };
  std::vector<Arm> arms_;
};

}  // namespace tandem::sim
