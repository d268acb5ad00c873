// SPDX-License-Identifier: Apache-2.0
/** @file Kinds of tasks of tips: one table with the residual, the velocity rows and the unit of each. A new kind is a
 * new entry; trackers, followers, files and reports read the table. */
#pragma once

#include <Eigen/Geometry>
#include <string_view>

#include "idl/enumerations.h"

namespace tandem::kinematics {

/// Metres that one radian counts in the rows of a task: 1 deg counts as 0.87 mm, the tolerance of Alsaka et al. 2024.
inline constexpr double kLengthPerRadian = 0.05;

/** Pose that a task compares: of a tip, or of one tip relative to another. Each kind of task uses a part of it. */
struct TaskPlace {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();               ///< m
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< unit
};

/// Most rows of a kind.
inline constexpr int kMaxKindRows = 6;
/// Residual e of a task, m or rad; of a pose m, with radians times kLengthPerRadian.
using TaskResidual = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxKindRows, 1>;
/// Rows by a twist (linear, angular) in the robot base frame.
using TwistRows = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::ColMajor, kMaxKindRows, 6>;

/** Rows of a task with the twists t_a and t_b of its tips and the feed-forward twist t_d:
 *
 *     by_arm t_a + by_other t_b = lambda e + by_feed_forward t_d,
 *
 * after which e decreases as e' = -lambda e where the wanted place moves with t_d. */
struct TaskRows {
  TaskResidual residual;                        ///< e
  TwistRows by_arm, by_other, by_feed_forward;  ///< by_other: of kinds with two arms
};

/// kNone: dimensionless; one counts as one radian.
enum class TaskUnit { kMetre, kRadian, kNone };
/// What a task looks at: the frame of the tip; the foot of the perpendicular from the wanted position to the shaft
/// (ShaftSearch), whose z axis is along the shaft; or, of soft tasks, the nearness of the arm to its joint limits or to
/// a loss of elastic stability (Avoidance).
enum class TaskPoint { kTip, kShaft, kJointLimits, kStability };
/// The part of a wanted place that counts.
enum class TaskPart { kPosition, kOrientation, kPose };

/** A kind of task. Frames: R_a, p_a are orientation and position of the tip of `arm`, z_a its z axis; b: of
 * `other_arm`; d: desired. For TaskPoint::kShaft the foot takes the place of the tip. */
struct TaskKindEntry {
  idl::TaskKind kind;
  std::string_view name;         ///< key in trajectory files and name in reports: "axis"
  std::string_view description;  ///< of reports, before the arms: "axis of"
  int arms;                      ///< 1 or 2
  int rows;                      ///< degrees of freedom that it takes
  TaskUnit unit;                 ///< of the residual
  TaskPart part;                 ///< of the wanted place
  TaskPoint point;               ///< of `arm`
  /// The place that is compared, from the poses of the tips (robot base frame <- tip frame).
  TaskPlace (*place)(const Eigen::Isometry3d& arm, const Eigen::Isometry3d& other) noexcept;
  /// e at a place.
  TaskResidual (*residual)(const TaskPlace& at, const TaskPlace& wanted) noexcept;
  /// The rows at the same place, without the residual. @param other  pose of the tip of `other_arm`
  void (*maps)(const TaskPlace& at, const TaskPlace& wanted, const Eigen::Isometry3d& other, TaskRows& rows) noexcept;

  bool relative() const noexcept { return arms == 2; }
  /// The place is a scalar: TaskPlace::position.x() is C of an Avoidance; of a wanted place it is d.
  bool soft() const noexcept { return point == TaskPoint::kJointLimits || point == TaskPoint::kStability; }
  bool hasOrientation() const noexcept { return part != TaskPart::kPosition; }
  /// The error depends on the orientation of the tips, also where only a position is wanted (the target of a view).
  bool needsOrientation() const noexcept {
    return point == TaskPoint::kTip && (hasOrientation() || kind == idl::TaskKind::kLookAt);
  }
  /// Metres per unit of the residual.
  double length() const noexcept { return unit == TaskUnit::kMetre ? 1.0 : kLengthPerRadian; }
  /// |e| of a place, m or rad.
  double error(const TaskPlace& at, const TaskPlace& wanted) const noexcept { return residual(at, wanted).norm(); }
};

/// The entry of a kind; null: no task of tips (none, the common object's pose, an unknown value).
const TaskKindEntry* findTaskKind(idl::TaskKind kind) noexcept;
/// The entry with that name; null: none.
const TaskKindEntry* findTaskKind(std::string_view name) noexcept;

/// Smallest rotation from one unit vector to another, as rotation vector: perpendicular to both, at most pi long. For
/// opposite vectors one of the rotations by pi.
Eigen::Vector3d smallestRotation(const Eigen::Vector3d& from, const Eigen::Vector3d& to) noexcept;

}  // namespace tandem::kinematics
