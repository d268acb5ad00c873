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
  double length = 0.0;                            ///< at most, m
  double outer_radius = 0.0, inner_radius = 0.0;  ///< m
  std::vector<kinematics::TubeSection> sections;  ///< with precurvature; none of a catheter, which tendons bend
};

/** Words for a joint. */
struct JointAppearance {
  std::string symbol;  ///< for narrow places: "β2", "roll"
  std::string title;   ///< "translation of tube 2"
  std::string part;    ///< of the arm, that it moves; limits are named by it: "tube 2"
};

struct ArmAppearance {
  std::string type;                   ///< "concentric_tube", "catheter", ...
  std::vector<TubeAppearance> tubes;  ///< innermost first
  std::vector<JointAppearance> joints;
  Eigen::Isometry3d base;  ///< robot base frame <- arm base frame
  Eigen::Isometry3d tool;  ///< end frame of the arm <- tool tip frame
};

}  // namespace tandem::robots
