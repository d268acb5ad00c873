// SPDX-License-Identifier: Apache-2.0
#include "robots/mechanisms.h"

#include <stdexcept>

#include "robots/robot_type.h"

namespace tandem::robots {

EquilibriumFollower makeEquilibriumFollower(const config::Robot& robot) {
  try {
    return EquilibriumFollower(typeOf(robot).makeMechanism(robot));
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(robot.file.string() + ": " + error.what());
  }
}

}  // namespace tandem::robots
