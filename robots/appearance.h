// SPDX-License-Identifier: Apache-2.0
/** @file Appearance of a robot: bodies of its arms and the object that they hold, for drawings. */
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "config/any_robot.h"
#include "kinematics/concentric_tube.h"

namespace tandem::robots {

/** One tube of an arm, or a whole catheter. */
struct TubeAppearance {
  double length = 0.0;                            ///< at most, m
  double outer_radius = 0.0, inner_radius = 0.0;  ///< m
  std::vector<kinematics::TubeSection> sections;  ///< with precurvature; none of a catheter, which tendons bend
};

struct ArmAppearance {
  std::string type;                   ///< "concentric_tube" or "catheter"
  std::vector<TubeAppearance> tubes;  ///< innermost first
  Eigen::Isometry3d base;             ///< robot base frame <- arm base frame
  Eigen::Isometry3d tool;             ///< end frame of the arm <- tool tip frame
};

/// @param arm  number in the robot's order
ArmAppearance appearanceOf(const config::Robot& robot, int arm);

/// The object that the arms hold, with its contacts in the robot's order of arms; null: none.
const config::HeldObject* heldObject(const config::Robot& robot) noexcept;

}  // namespace tandem::robots
