// SPDX-License-Identifier: Apache-2.0
/** @file Lookup of arms by name, and the list of all arm names. */
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/config.h"

namespace tandem::config {

/// Index of the arm of that name, or of arm_NAME, or with that letter or index in the robot's order.
std::optional<std::size_t> findArm(const Robot& robot, const std::string& name);

/// The names of the arms, in the robot's order.
std::vector<std::string> armList(const Robot& robot);
/// The same for texts about limits: "a" for "arm_a".
std::vector<std::string> shortArmNames(const Robot& robot);

/// Index of an arm given by letter (a, b, ...) or by index; planning::kNamedArm: by a name.
int indexOfLetter(const std::string& name);
/// The name that a trajectory gives an arm, or the arm's letter.
std::string nameOrLetter(const std::string& name, int arm);

/** Finds the arms that a trajectory names: by name in the robot file first, else by letter or index in its order; their
 * names replace the letters. @return what is wrong with them for this robot; empty: nothing. */
std::string findArms(planning::TrajectorySpec& trajectory, const Robot& robot);

/// "arm_a, arm_b", for errors.
std::string armNames(const Robot& robot);

}  // namespace tandem::config
