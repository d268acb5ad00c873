// SPDX-License-Identifier: Apache-2.0
#include "config/arm_names.h"

#include "config/key_table.h"

namespace tandem::config {

std::optional<std::size_t> findArm(const Robot& robot, const std::string& name) {
  for (std::size_t k = 0; k < robot.arms.size(); ++k) {
    if (robot.arms[k].name == name || robot.arms[k].name == "arm_" + name)
      return k;
  }
  return std::nullopt;
}

std::string armNames(const Robot& robot) {
  std::vector<std::string> names;
  for (const Arm& arm : robot.arms)
    names.push_back(arm.name);
  return join(names);
}

}  // namespace tandem::config
