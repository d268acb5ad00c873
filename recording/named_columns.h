// SPDX-License-Identifier: Apache-2.0
/** @file Columns by the names of a robot's arms and joints, with units, in place of the array indices of the wire. */
#pragma once

#include <map>
#include <string>
#include <vector>

#include "recording/table.h"

namespace tandem::recording {

/** Names of the elements of arrays. */
struct ArrayNames {
  struct Joint {
    std::string name;  ///< "beta_1"
    bool turns;        ///< rad, not m
  };
  struct Arm {
    std::string name;
    std::vector<Joint> joints;
  };
  std::vector<Arm> arms;                                     ///< at least one
  std::vector<std::string> actions;                          ///< of arrays over arms and actions
  std::map<std::string, std::vector<std::string>> prefixes;  ///< "guard_": elements of members whose names begin so
};

/** Splits each array of fixed length into one column per element, and ends names with units: "position[9]" becomes
 * "position.left.beta_2_m", "task_error[0]" becomes "task_error.task_1_m". Elements for arms and joints that the robot
 * does not have, and beyond the largest count of the table (task_count, limit_count, bus_count), are left out. Lists of
 * variable length keep their index. Units come from the comments of the recorded definitions; a member whose comment
 * has none, or several for one value, has no unit in its name. */
void nameColumns(const ArrayNames& names, std::vector<Table>& tables);

/// Units in the comment of a member: "m, rad" -> {"m", "rad"}; empty where it leaves the choice ("m or rad").
std::vector<std::string> unitsIn(const std::string& comment);

}  // namespace tandem::recording
