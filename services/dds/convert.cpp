// SPDX-License-Identifier: Apache-2.0
#include "services/dds/convert.h"

#include <algorithm>

namespace tandem::dds {

planning::Reference tasksOf(const PlanningReference& message) noexcept {
  planning::Reference reference;
  reference.task_count = std::min<int>(message.task_count, planning::kMaxTasks);
  for (int k = 0; k < reference.task_count; ++k) {
    const TaskReference& from = message.tasks[static_cast<std::size_t>(k)];
    planning::TaskReference& to = reference.tasks[static_cast<std::size_t>(k)];
    to.kind = static_cast<planning::TaskKind>(from.kind);
    to.arm = from.arm;
    to.other_arm = from.other_arm;
    to.position = Eigen::Vector3d::Map(from.position.data());
    to.feed_forward = Eigen::Vector3d::Map(from.feed_forward.data());
  }
  return reference;
}

void setTasks(const planning::Reference& reference, PlanningReference& message) noexcept {
  message.task_count = static_cast<std::uint8_t>(reference.task_count);
  for (int k = 0; k < reference.task_count; ++k) {
    const planning::TaskReference& from = reference.tasks[static_cast<std::size_t>(k)];
    TaskReference& to = message.tasks[static_cast<std::size_t>(k)];
    to.kind = static_cast<std::uint8_t>(from.kind);
    to.arm = static_cast<std::uint8_t>(from.arm);
    to.other_arm = static_cast<std::uint8_t>(from.other_arm);
    Eigen::Vector3d::Map(to.position.data()) = from.position;
    Eigen::Vector3d::Map(to.feed_forward.data()) = from.feed_forward;
  }
}

safety::FaultRecord faultRecordOf(const HalStatus& message, int arm) noexcept {
  const auto k = static_cast<std::size_t>(arm);
  return {message.first_fault[k], static_cast<safety::FaultCause>(message.fault_cause[k]), message.fault_joint[k],
          message.fault_amount[k], message.fault_allowed[k]};
}

void setFaultRecord(const safety::FaultRecord& record, int arm, HalStatus& message) noexcept {
  const auto k = static_cast<std::size_t>(arm);
  message.first_fault[k] = record.faults;
  message.fault_cause[k] = static_cast<std::uint8_t>(record.cause);
  message.fault_joint[k] = record.joint;
  message.fault_amount[k] = record.amount;
  message.fault_allowed[k] = record.allowed;
}

}  // namespace tandem::dds
