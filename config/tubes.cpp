// SPDX-License-Identifier: Apache-2.0
#include "config/tubes.h"

#include "config/robot_files.h"

namespace tandem::config {

Robot loadTubes(const Deployment& deployment, const std::string& why) {
  if (const std::string kind = kindOf(deployment.robot); kind != "robot")
    throw Error(deployment.file.string(), 0, 0, "robot",
                "found the " + kind + " robot of " + deployment.robot.filename().string() +
                    ", expected concentric tubes: " + why);
  return loadRobot(deployment.robot);
}

}  // namespace tandem::config
