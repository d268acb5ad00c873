// SPDX-License-Identifier: Apache-2.0
/** @file True tip poses of the simulated robot. */
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "kinematics/arm_model.h"
#include "sim/plant_options.h"
#include "sim/tip_play.h"
#include "sim/tube_friction.h"

namespace tandem::sim {

/** Arm of the plant: that of the robot file with random tube errors, or with the given ones.
 * @param arm index in the robot: every arm and every tube has its own random numbers */
kinematics::ConcentricTubeArm withErrors(kinematics::ConcentricTubeArm tubes, int arm, const PlantOptions& options);

/** Effects of the contact between the tubes of one arm that depend on its path. */
struct TubeContact {
  std::optional<TubeFriction> friction;
  std::optional<TipPlay> play;
};
/// Contact between tubes by `options`. @param plant arm of the plant; @param nominal that of the robot file
TubeContact makeContact(const kinematics::ConcentricTubeArm& plant,
                        const kinematics::ConcentricTubeArm& nominal,
                        const PlantOptions& options);

/** Snaps of one arm since construction. */
struct Snaps {
  std::uint32_t count = 0;
  double energy = 0.0;    ///< released by all of them, J
  double distance = 0.0;  ///< longest displacement of the tool tip in one, m
};

/// Models of arms of one type, in the robot's order.
using ArmModels = std::vector<std::unique_ptr<kinematics::ArmModel>>;

/** Tips of all arms of the plant, tracked along the path of the joints.
 *
 * Elastic arms depend on their path (kinematics/branch.h); when the equilibrium of an arm ends, the arm snaps to
 * another one; snaps are counted, with the released energy and the displacement of the tip (unknown under a tip force:
 * 0). Order of effects: rotations given by update() are behind motor and backlash; then friction, model, play. After
 * construction nothing but clearance() and store() allocates or throws. */
class PlantTips {
 public:
  /// @throw std::invalid_argument for a force on an arm that does not exist, or on a model without loads.
  /// @param contacts one for each arm, or none
  PlantTips(ArmModels models, const PlantOptions& options, std::vector<TubeContact> contacts = {});

  /// Reset of the joints: the next update is a cold start.
  void restart() noexcept;
  /// Sets the joints of an arm to q (m, rad). Does nothing if they have not moved.
  void update(int arm, const safety::ArmVector& q) noexcept;

  int armCount() const noexcept { return static_cast<int>(arms_.size()); }
  /// pose() is that of the last update; otherwise it is older, and status() has the reason.
  bool valid(int arm) const noexcept { return status(arm) == kinematics::ModelStatus::kOk; }
  kinematics::ModelStatus status(int arm) const noexcept { return arms_[static_cast<std::size_t>(arm)].status; }
  /// Robot base frame <- tool tip frame.
  const Eigen::Isometry3d& pose(int arm) const noexcept { return arms_[static_cast<std::size_t>(arm)].tip.pose; }
  /// Number of snaps of this arm since construction.
  std::uint32_t snaps(int arm) const noexcept { return snapsOf(arm).count; }
  const Snaps& snapsOf(int arm) const noexcept { return arms_[static_cast<std::size_t>(arm)].snaps; }
  /// Snaps of all arms.
  Snaps allSnaps() const noexcept;
  /// Least elastic stability of the arm now: 0 where it snaps, 1 without elastic interaction.
  double stability(int arm) const noexcept { return arms_[static_cast<std::size_t>(arm)].tip.stability; }

  /// Point of an arm's shaft without load, at a fraction of its length from the entry point, m; not finite where the
  /// arm has no solution. Allocates.
  Eigen::Vector3d shaftPoint(int arm, double share) const;

  /// State of an arm: joints of its model, and the branch of its equilibrium.
  struct Configuration {
    safety::ArmVector joints;
    kinematics::Branch branch;
  };
  using Configurations = std::vector<Configuration>;
  /// Configurations of all arms now. Allocates unless `configurations` held as many before.
  void store(Configurations& configurations) const;
  /// Least distance between the bodies of any two arms there (kinematics/clearance.h), m; below zero they overlap by
  /// that much. Infinity where an arm has no solution. Bodies are those without load. Allocates.
  double clearance(const Configurations& configurations) const;
  /// The same where they are now.
  double clearance() const;

 private:
  struct Arm {
    std::unique_ptr<kinematics::ArmModel> model;
    kinematics::Wrench wrench = kinematics::Wrench::Zero();
    kinematics::Branch branch;
    kinematics::LoadedTip tip;
    kinematics::ModelStatus status = kinematics::ModelStatus::kNotFinite;
    safety::ArmVector q;       ///< of the last update; empty before the first
    safety::ArmVector joints;  ///< the same behind friction: those of the model
    Snaps snaps;
    TubeContact contact;
  };
  std::vector<Arm> arms_;
};

}  // namespace tandem::sim
