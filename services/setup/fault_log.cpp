// SPDX-License-Identifier: Apache-2.0
#include "services/setup/fault_log.h"

#include <spdlog/spdlog.h>

namespace tandem::service {

std::string describe(const config::Robot& robot, const FaultReport& report) {
  const config::Arm& arm = robot.arms[static_cast<std::size_t>(report.arm)];
  return arm.name + ": " + safety::describe(report.record, arm.limits.jointCount());
}

void logFault(const config::Robot& robot, const FaultReport& report) {
  spdlog::error("FAULT of {}", describe(robot, report));
}

}  // namespace tandem::service
