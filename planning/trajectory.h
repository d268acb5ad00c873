// SPDX-License-Identifier: Apache-2.0
/** @file Reference trajectories: parameters of the shapes, and the points sampled from them. */
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "kinematics/arm_model.h"
#include "planning/reference.h"

namespace tandem::planning {

/** Closed rectangle from the start: along `first`, then `second`, and back. m. */
struct Rectangle {
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Vector3d second = Eigen::Vector3d::Zero();
};

/** x_i = amplitude_i sin(2 pi cycles_i t + phase_i) - amplitude_i sin(phase_i), t in [0, 1]: zero at t = 0. */
struct Lissajous {
  Eigen::Vector3d amplitude = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d cycles = Eigen::Vector3d::Zero();
  Eigen::Vector3d phase = Eigen::Vector3d::Zero();  ///< rad
};

/** Circle from the start about center = start + center_offset, in the plane normal to `normal`. */
struct Circle {
  Eigen::Vector3d center_offset = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double turns = 1.0;
};

/** Straight line by `displacement`, m. */
struct Line {
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();
};

/** Polyline through given points, m; offsets from the start unless `absolute`. CSV files also use this type. */
struct Waypoints {
  std::vector<Eigen::Vector3d> points;
  bool absolute = false;
};

/** Part of an insertion: the innermost tubes of an arm advance together. */
struct InsertionStage {
  int tubes = 1;        ///< number of tubes that advance: 1 the innermost alone
  double length = 0.0;  ///< m, above zero
};

/** Path of the tip while tubes advance stage by stage and no tube turns: the arm's own path, which its shaft follows
 * where the tubes allow it (Gilbert, Neimat & Webster 2015). Where the tips are follows from the joints at the start:
 * see planning/insertion.h. */
struct Insertion {
  std::vector<InsertionStage> stages;
  /// Of setInsertion(): the tip, m, and the joints of all arms, at each point after the start; empty before.
  std::vector<Eigen::Vector3d> tips = {};
  std::vector<safety::RobotVector> joints = {};
};

using Shape = std::variant<Rectangle, Lissajous, Circle, Line, Waypoints, Insertion>;

/** Mode of execution of a trajectory. */
enum class Following {
  kPointByPoint,  ///< the paper's protocol: next point when within tolerance, at most max_iterations per point
  kTimed,         ///< time-parameterised: trapezoidal speed along the path
};

inline constexpr int kNoArm = -1;
/// An arm that is known by its name only, until config::findArms() has looked it up.
inline constexpr int kNamedArm = -2;
/// Refusal of a relative position between a tip and itself.
inline constexpr const char* kSameArmTwice = "found the same arm twice, expected two arms";

/** Desired orientation of a further task over the trajectory. */
enum class Heading {
  kStart,      ///< kept as at the start
  kTangent,    ///< the z axis along the path, with the smallest rotation from one point to the next
  kWaypoints,  ///< rotations from the start, with slerp between them
};

/** Rotation from the orientation at the start, at a fraction of the path. */
struct HeadingWaypoint {
  double at = 1.0;                                     ///< 0 to 1, by points
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();  ///< rotation vector, rad, frame of the task's orientation
};

/** A task beside the tip and the relative position, of any other kind in kinematics/tasks/task_kind.h. */
struct FurtherTask {
  TaskKind kind = TaskKind::kTipAxis;
  int priority = 0;  ///< index in the list of all tasks; 0: the highest
  int arm = 0, other_arm = 0;
  std::string arm_name, other_arm_name;  ///< as in TrajectorySpec
  Heading heading = Heading::kStart;
  std::vector<HeadingWaypoint> waypoints;            ///< in ascending order; Heading::kWaypoints
  Eigen::Vector3d target = Eigen::Vector3d::Zero();  ///< of TaskPart::kPosition, m, robot base frame; soft: [d, 0, 0]
  double tolerance = std::numeric_limits<double>::infinity();  ///< m or rad; infinite: points are reached without it
  /// A remote centre at the point of the leader's path that is farthest from the shaft, in every control period: see
  /// planning/leader_path.h. `target` is that point.
  bool follows_leader = false;

  bool relative() const noexcept { return kinematics::findTaskKind(kind)->relative(); }
};

/// Most further tasks.
inline constexpr int kMaxFurther = kMaxTasks;

/** A trajectory of one tip, alone or with a constant or moving relative position of two tips, and with further tasks.
 * SI. */
struct TrajectorySpec {
  std::string name;
  int arm = 0;        ///< arm whose tip follows the shape
  int other_arm = 1;  ///< partner in the relative position; kNoArm: the tip of `arm` is the only task
  /// The arms as the file names them: by name, letter or index; empty: by the indices above alone.
  std::string arm_name, other_arm_name;
  bool tip_task = true;  ///< false: no task of the tip alone; a further task, the pose of `arm`, follows the shape
  Shape shape;
  int point_count = 100;  ///< points after the start, evenly spaced by arc length
  std::vector<Shape>
      relative;  ///< empty: constant relative position; one shape: it moves along this, synchronously with the tip
  std::vector<FurtherTask> further;  ///< by priority; at most kMaxTasks tasks in all
  Following following = Following::kPointByPoint;
  double tolerance = 0.88e-3;    ///< m
  int max_iterations = 100;      ///< per point
  double point_duration = 10.0;  ///< s per point; feed-forward = spacing / point_duration
  double speed = 2e-3;           ///< m/s, timed following
  double acceleration = 5e-3;    ///< m/s^2, timed following

  bool hasRelative() const { return other_arm != kNoArm; }
  /// The arms of its tasks: the one of the tip first; further ones may come twice.
  std::vector<int> arms() const;
  int taskCount() const noexcept {
    return (hasRelative() ? 1 : 0) + (tip_task ? 1 : 0) + static_cast<int>(further.size());
  }
  /// The same trajectory without further tasks.
  TrajectorySpec ofPositions() const;
  /// Reason why its arms do not suit a robot with `count` arms; empty: they do.
  std::string wrongArms(int count) const;
  /// Reason why a model cannot do a task; empty: they all can. @param models  of the arms in order
  std::string wrongModels(const std::vector<const kinematics::ArmModel*>& models) const;
};

/** One point of a sampled trajectory: desired tip and relative position, m, robot base frame, and the places of further
 * tasks. Without a relative position that is zero, as wanted and as measured. */
struct TrajectoryPoint {
  Eigen::Vector3d tip;
  Eigen::Vector3d relative;
  std::array<kinematics::TaskPlace, kMaxFurther> further{};  ///< in the order of TrajectorySpec::further
};

/// The point at which the trajectory's tips are, without further tasks. @param pose  robot base frame <- tip of an arm
template <class Pose>
TrajectoryPoint positionsAt(const TrajectorySpec& spec, Pose pose) {
  const Eigen::Vector3d own = pose(spec.arm).translation();
  TrajectoryPoint point{own, Eigen::Vector3d::Zero()};
  if (spec.hasRelative())
    point.relative = own - pose(spec.other_arm).translation();
  return point;
}

class TipFollower;
struct MeasuredTips;
/// The place of a task, not finite where the model has no solution. @param measured  null: the model's positions
kinematics::TaskPlace placeOf(const TaskReference& task,
                              const TipFollower& tips,
                              const MeasuredTips* measured) noexcept;
/// The point at which the trajectory's tips are, with the places of further tasks.
TrajectoryPoint pointAt(const TrajectorySpec& spec, const TipFollower& tips, const MeasuredTips* measured) noexcept;

/// Point on the straight line from one point to another, orientations by slerp. @param share  0 to 1
TrajectoryPoint between(const TrajectorySpec& spec,
                        const TrajectoryPoint& from,
                        const TrajectoryPoint& to,
                        double share) noexcept;

/// Tasks of a point: the relative position, if there is one, then the tip, if it is a task, with the further tasks at
/// their priorities;
/// feed-forward zero.
Reference referenceTo(const TrajectorySpec& spec, const TrajectoryPoint& point) noexcept;
/// The same with feed-forward from one point to another in a time, s.
Reference referenceTo(const TrajectorySpec& spec,
                      const TrajectoryPoint& point,
                      const TrajectoryPoint& from,
                      const TrajectoryPoint& to,
                      double time) noexcept;

/** Samples the trajectory from a start: point_count points, without the start itself. @throw std::invalid_argument for
 * an empty or degenerate shape, or an insertion without setInsertion(). */
std::vector<TrajectoryPoint> sample(const TrajectorySpec& spec, const TrajectoryPoint& start);

}  // namespace tandem::planning
