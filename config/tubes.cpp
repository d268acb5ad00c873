// SPDX-License-Identifier: Apache-2.0
#include "config/tubes.h"

#include "config/cooperative.h"

namespace tandem::config {

Robot loadTubes(const Deployment& deployment, const std::string& why) {
  if (kindOf(deployment.robot) == "cooperative")
    throw Error(
        deployment.file.string(), 0, 0, "robot",
        "found the catheters of " + deployment.robot.filename().string() + ", expected concentric tubes: " + why);
  return loadRobot(deployment.robot);
}

}  // namespace tandem::config
