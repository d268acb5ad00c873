// SPDX-License-Identifier: Apache-2.0
/** @file Geometry of a robot for display: bodies of its arms, and the grasped object. */
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "config/cooperative.h"
#include "kinematics/concentric_tube.h"

namespace tandem::robots {

/** One tube of an arm, or a whole catheter. */
struct TubeAppearance {
  std::string name;                               ///< "tube 2"
  double length = 0.0;                            ///< largest one, m
  double outer_radius = 0.0, inner_radius = 0.0;  ///< m
  std::vector<kinematics::TubeSection> sections;  ///< with precurvature; empty for a catheter, which is bent by tendons
};

/** Names of a joint for display. */
struct JointAppearance {
  std::string symbol;  ///< short, for narrow columns: "β2", "roll"
  std::string title;   ///< "translation of tube 2"
  std::string part;    ///< part of the arm that it moves; its limits have this name: "tube 2"
};

struct ArmAppearance {
  std::string type;                   ///< "concentric_tube", "catheter", ...
  std::vector<TubeAppearance> tubes;  ///< innermost first
  std::vector<JointAppearance> joints;
  Eigen::Isometry3d base;  ///< robot base frame <- arm base frame
  Eigen::Isometry3d tool;  ///< end frame of the arm <- tool tip frame
};

}  // namespace tandem::robots
