// SPDX-License-Identifier: Apache-2.0
#include "operation/convert.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::msg {
namespace {

planning::ObjectReference objectReferenceOf(const TaskReference& from) noexcept {
  planning::ObjectReference object;
  object.position = Eigen::Vector3d::Map(from.position.data());
  object.orientation.coeffs() = Eigen::Vector4d::Map(from.orientation.data());  // x y z w
  for (std::size_t k = 0; k < 6; ++k) {
    object.tracked[k] = !std::isnan(from.feed_forward[k]);
    object.feed_forward[static_cast<Eigen::Index>(k)] = object.tracked[k] ? from.feed_forward[k] : 0.0;
  }
  return object;
}

void setObjectReference(const planning::ObjectReference& object, TaskReference& to) noexcept {
  Eigen::Vector3d::Map(to.position.data()) = object.position;
  Eigen::Vector4d::Map(to.orientation.data()) = object.orientation.coeffs();
  for (std::size_t k = 0; k < 6; ++k)
    to.feed_forward[k] = object.tracked[k] ? object.feed_forward[static_cast<Eigen::Index>(k)]
                                           : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

safety::ArmVector jointsOf(const JointArray& joints, int arm, int size) noexcept {
  return safety::ArmVector::Map(joints.data() + jointIndex(arm, 0), size);
}

bool measuredJoints(const ActuationState& state, int arm_count, int joint_count, safety::RobotVector& q) noexcept {
  if (state.sequence == 0 || state.arm_count != arm_count)
    return false;
  safety::RobotVector all(joint_count);
  int next = 0;
  for (int k = 0; k < arm_count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const int size = state.joint_count[i];
    if (state.valid[i] == 0 || next + size > joint_count)
      return false;
    all.segment(next, size) = jointsOf(state.position, k, size);
    next += size;
  }
  if (next != joint_count)
    return false;
  q = all;
  return true;
}

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
    if (const auto* kind = kinematics::findTaskKind(to.kind); kind != nullptr && kind->hasOrientation()) {
      to.orientation.coeffs() = Eigen::Vector4d::Map(from.orientation.data());  // x y z w
      to.angular_feed_forward = Eigen::Vector3d::Map(from.feed_forward.data() + 3);
    }
  }
  if (reference.task_count > 0 && reference.tasks[0].kind == planning::TaskKind::kObjectPose)
    reference.object = objectReferenceOf(message.tasks[0]);
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
    // Kinds of positions leave these members as they are: recordings of before have them so.
    if (const auto* kind = kinematics::findTaskKind(from.kind); kind != nullptr && kind->hasOrientation()) {
      Eigen::Vector4d::Map(to.orientation.data()) = from.orientation.coeffs();
      Eigen::Vector3d::Map(to.feed_forward.data() + 3) = from.angular_feed_forward;
    }
    if (from.kind == planning::TaskKind::kObjectPose)
      setObjectReference(reference.object, to);
  }
}

void setPosture(const safety::RobotVector& posture,
                int arm_count,
                const PerArm<std::uint8_t>& joint_count,
                PlanningReference& message) noexcept {
  message.posture_valid = 0;
  Eigen::Index next = 0;
  for (int k = 0; k < arm_count; ++k) {
    const int joints = joint_count[static_cast<std::size_t>(k)];
    if (next + joints > posture.size())
      return;
    for (int j = 0; j < joints; ++j)
      message.posture[jointIndex(k, j)] = posture[next++];
  }
  message.posture_valid = next > 0 && next == posture.size() ? 1 : 0;
}

safety::RobotVector postureOf(const PlanningReference& message,
                              int arm_count,
                              const PerArm<std::uint8_t>& joint_count) noexcept {
  safety::RobotVector posture;
  if (message.posture_valid == 0)
    return posture;
  Eigen::Index joints = 0;
  for (int k = 0; k < arm_count; ++k)
    joints += joint_count[static_cast<std::size_t>(k)];
  posture.resize(joints);
  Eigen::Index next = 0;
  for (int k = 0; k < arm_count; ++k) {
    for (int j = 0; j < joint_count[static_cast<std::size_t>(k)]; ++j)
      posture[next++] = message.posture[jointIndex(k, j)];
  }
  if (!posture.allFinite())
    posture.resize(0);
  return posture;
}

Eigen::Vector3d tipPosition(const TipPoses& message, int arm) noexcept {
  return Eigen::Vector3d::Map(message.position.data() + 3 * arm);
}

Eigen::Quaterniond tipOrientation(const TipPoses& message, int arm) noexcept {
  return Eigen::Quaterniond(Eigen::Vector4d::Map(message.orientation.data() + 4 * arm));  // x y z w
}

void takeTips(const TipPoses& message, planning::MeasuredTips& tips) noexcept {
  for (int k = 0; k < std::min<int>(message.arm_count, safety::kMaxArms); ++k) {
    tips.take(k, message.valid[static_cast<std::size_t>(k)] != 0, tipPosition(message, k), tipOrientation(message, k),
              message.stamp, message.answers_command);
  }
}

void setTip(int arm,
            bool valid,
            const Eigen::Vector3d& position,
            const Eigen::Quaterniond& orientation,
            TipPoses& message) noexcept {
  message.valid[static_cast<std::size_t>(arm)] = valid ? 1 : 0;
  Eigen::Vector3d::Map(message.position.data() + 3 * arm) = position;
  Eigen::Vector4d::Map(message.orientation.data() + 4 * arm) = orientation.coeffs();  // x y z w
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

}  // namespace tandem::msg
