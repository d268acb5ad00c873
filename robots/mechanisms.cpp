// SPDX-License-Identifier: Apache-2.0
#include "robots/mechanisms.h"

#include <stdexcept>

#include "robots/catheters.h"

namespace tandem::robots {

std::unique_ptr<Mechanism> makeMechanism(const config::Robot& robot) {
  if (!robot.catheters)
    throw std::invalid_argument(robot.name + ": found concentric tubes, expected catheters");
  if (robot.catheters->object)
    return std::make_unique<HeldObjectMechanism>(*robot.catheters);
  return std::make_unique<AssistedMechanism>(*robot.catheters);
}

RestFollower makeRestFollower(const config::Robot& robot) {
  try {
    return RestFollower(makeMechanism(robot));
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(robot.file.string() + ": " + error.what());
  }
}

}  // namespace tandem::robots
