// SPDX-License-Identifier: Apache-2.0
#include "services/setup/mechanisms.h"

#include <stdexcept>

#include "experiments/catheters.h"

namespace tandem::service {

std::unique_ptr<experiments::Mechanism> makeMechanism(const config::Robot& robot) {
  if (!robot.catheters)
    throw std::invalid_argument(robot.name + ": found concentric tubes, expected catheters");
  if (robot.catheters->object)
    return std::make_unique<experiments::HeldObjectMechanism>(*robot.catheters);
  return std::make_unique<experiments::AssistedMechanism>(*robot.catheters);
}

experiments::RestFollower makeRestFollower(const config::Robot& robot) {
  try {
    return experiments::RestFollower(makeMechanism(robot));
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(robot.file.string() + ": " + error.what());
  }
}

}  // namespace tandem::service
