// SPDX-License-Identifier: Apache-2.0
#include "robots/run.h"

#include "robots/capability.h"
#include "robots/detail/path_run.h"
#include "robots/detail/trajectory_run.h"
#include "robots/robot_model.h"

namespace tandem::robots {

std::unique_ptr<Run> makeRun(const config::Robot& robot, const RobotModel& model, double period) {
  if (has(robot, Capability::kCommonPath))
    return std::make_unique<PathRun>(robot, period);
  return std::make_unique<TrajectoryRun>(robot, model, period);
}

}  // namespace tandem::robots
