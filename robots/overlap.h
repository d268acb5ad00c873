// SPDX-License-Identifier: Apache-2.0
/** @file Overlap of the arms' bodies at given joints, as text. */
#pragma once

#include <string>
#include <vector>

#include "robots/robot_model.h"

namespace tandem::robots {

/// One text for each pair of arms whose bodies (kinematics::Body) overlap: "arm_a and arm_b overlap by 2.00 mm: tube 3
/// of arm_a, tube 3 of arm_b, z = 68 mm". Empty without an overlap, and for types without models of single arms.
/// @param joints  one vector per arm, m and rad; an arm whose model has no solution there is left out
std::vector<std::string> describeOverlaps(const config::Robot& robot,
                                          const RobotModel& model,
                                          const std::vector<Eigen::VectorXd>& joints);

/// The same at the robot's home, each text with "at home " in front.
/// @param model  as for RobotModel
std::vector<std::string> describeHomeOverlaps(const config::Robot& robot, const std::string& model = "rigid");

}  // namespace tandem::robots
