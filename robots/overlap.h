// SPDX-License-Identifier: Apache-2.0
/** @file Distances between the arms' bodies at given joints, and their overlap as text. */
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "kinematics/clearance.h"
#include "robots/robot_model.h"

namespace tandem::robots {

/// Bodies of all arms, without derivatives; nothing for an arm whose model has no solution at its joints.
/// @param joints  one vector per arm, m and rad
std::vector<std::optional<kinematics::Body>> bodiesAt(const RobotModel& model,
                                                      const std::vector<Eigen::VectorXd>& joints);

/** Smallest distance between the bodies of two arms. */
struct ArmDistance {
  std::size_t arm, other;
  kinematics::Clearance least;
};

/// Distances of each two arms whose bodies are known.
std::vector<ArmDistance> armDistances(const std::vector<std::optional<kinematics::Body>>& bodies);

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
