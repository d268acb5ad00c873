// SPDX-License-Identifier: Apache-2.0
#include "planning/reference.h"

namespace tandem::planning {

ObjectReference ObjectReference::after(double time) const noexcept {
  ObjectReference later = *this;
  later.position += time * feed_forward.head<3>();
  const Eigen::Vector3d turn = time * feed_forward.tail<3>();
  if (const double angle = turn.norm(); angle > 0.0)
    later.orientation = (Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle)) * orientation).normalized();
  return later;
}

std::string describe(const TaskReference& task, const std::vector<std::string>& arms) {
  const kinematics::TaskKindEntry* kind = kinematics::findTaskKind(task.kind);
  if (kind == nullptr)
    return task.kind == TaskKind::kObjectPose ? "common object" : "task";
  const auto name = [&](int arm) {
    const auto k = static_cast<std::size_t>(arm);
    return k < arms.size() ? arms[k] : "arm " + std::to_string(arm);
  };
  const std::string text = std::string(kind->description) + ' ' + name(task.arm);
  return kind->relative() ? text + " and " + name(task.other_arm) : text;
}

}  // namespace tandem::planning
