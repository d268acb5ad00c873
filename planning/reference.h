// SPDX-License-Identifier: Apache-2.0
/** @file Reference: prioritised list of tasks for one control period. */
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "idl/enumerations.h"
#include "kinematics/tasks/task_kind.h"
#include "safety/dimensions.h"

namespace tandem::planning {

using idl::TaskKind;

/** Desired pose of the common object. */
struct ObjectReference {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();                              ///< m, robot base frame
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();                 ///< robot base frame <- frame
  Eigen::Matrix<double, 6, 1> feed_forward = Eigen::Matrix<double, 6, 1>::Zero();  ///< m/s, rad/s, robot base frame
  std::array<bool, 6> tracked{};  ///< tracked components: x, y, z and rotations about them

  /// The reference after a time of motion with its feed-forward, s.
  ObjectReference after(double time) const noexcept;
};

/** One task: desired place of a tip, or of one tip relative to another. The kind says which parts count: see
 * kinematics/tasks/task_kind.h. */
struct TaskReference {
  TaskKind kind = TaskKind::kNone;
  int arm = 0;
  int other_arm = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();      ///< m, robot base frame
  Eigen::Vector3d feed_forward = Eigen::Vector3d::Zero();  ///< m/s
  Eigen::Quaterniond orientation =
      Eigen::Quaterniond::Identity();                              ///< robot base frame, or that of `other_arm`, <- tip
  Eigen::Vector3d angular_feed_forward = Eigen::Vector3d::Zero();  ///< rad/s, in that frame

  kinematics::TaskPlace place() const noexcept { return {position, orientation}; }
  void clearFeedForward() noexcept {
    feed_forward.setZero();
    angular_feed_forward.setZero();
  }
};

/// "axis of a", "relative position of a and b"; of the common object: "common object". @param arms  names
std::string describe(const TaskReference& task, const std::vector<std::string>& arms);

inline constexpr int kMaxTasks = 4;

/** Tasks of one control step, highest priority first, and the posture for joint motion that the tasks leave free. */
struct Reference {
  int task_count = 0;
  std::array<TaskReference, kMaxTasks> tasks{};
  safety::RobotVector posture;  ///< q_p of all arms' joints, stacked, m and rad; empty: none
  ObjectReference object;       ///< of a task of kind kObjectPose
};

}  // namespace tandem::planning
