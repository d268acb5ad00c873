// SPDX-License-Identifier: Apache-2.0
#include "services/runtime/fault_log.h"

#include <spdlog/spdlog.h>

namespace tandem::runtime {

std::string describe(const config::Robot& robot, const FaultReport& report) {
  const config::Arm& arm = robot.arms[static_cast<std::size_t>(report.arm)];
  std::string text = arm.name + ": " + safety::describe(report.record, &arm.limits);
  if (safety::isOfTime(report.record.faults) && report.late > safety::kLate)
    text += fmt::format(
        "; wake-up delay of {:.2g} s just before: run `tandem doctor`, and compare with the budgets of the deployment",
        report.late);
  return text;
}

void logFault(const config::Robot& robot, const FaultReport& report) {
  spdlog::error("FAULT of {}", describe(robot, report));
}

}  // namespace tandem::runtime
