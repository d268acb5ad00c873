// SPDX-License-Identifier: Apache-2.0
/** @file Reference trajectories: parameters of the shapes, and the points sampled from them. */
#pragma once

#include <Eigen/Core>
#include <string>
#include <variant>
#include <vector>

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

using Shape = std::variant<Rectangle, Lissajous, Circle, Line, Waypoints>;

/** Mode of execution of a trajectory. */
enum class Following {
  kPointByPoint,  ///< the paper's protocol: next point when within tolerance, at most max_iterations per point
  kTimed,         ///< time-parameterised: trapezoidal speed along the path
};

inline constexpr int kNoArm = -1;
/// An arm that is known by its name only, until config::findArms() has looked it up.
inline constexpr int kNamedArm = -2;
/// What is wrong with a relative position of a tip and itself.
inline constexpr const char* kSameArmTwice = "found the same arm twice, expected two arms";

/** A trajectory of one tip, alone or with a constant or moving relative position of two tips. SI. */
struct TrajectorySpec {
  std::string name;
  int arm = 0;        ///< arm whose tip follows the shape
  int other_arm = 1;  ///< partner in the relative position; kNoArm: the tip of `arm` is the only task
  /// The arms as the file names them: by name, letter or index; empty: by the indices above alone.
  std::string arm_name, other_arm_name;
  Shape shape;
  int point_count = 100;  ///< points after the start, evenly spaced by arc length
  std::vector<Shape>
      relative;  ///< empty: constant relative position; one shape: it moves along this, synchronously with the tip
  Following following = Following::kPointByPoint;
  double tolerance = 0.88e-3;    ///< m
  int max_iterations = 100;      ///< per point
  double point_duration = 10.0;  ///< s per point; feed-forward = spacing / point_duration
  double speed = 2e-3;           ///< m/s, timed following
  double acceleration = 5e-3;    ///< m/s^2, timed following

  bool hasRelative() const { return other_arm != kNoArm; }
  /// The arms of its tasks.
  std::vector<int> arms() const { return hasRelative() ? std::vector{arm, other_arm} : std::vector{arm}; }
  /// What is wrong with its arms for a robot with `count` of them; empty: nothing.
  std::string wrongArms(int count) const;
};

/** One point of a sampled trajectory: desired tip and relative position, m, robot base frame. Without a relative
 * position that is zero, as wanted and as measured. */
struct TrajectoryPoint {
  Eigen::Vector3d tip;
  Eigen::Vector3d relative;
};

/// The point at which the trajectory's tips are. @param tip  position of the tip of an arm, m
template <class Tip>
TrajectoryPoint pointAt(const TrajectorySpec& spec, Tip tip) {
  const Eigen::Vector3d own = tip(spec.arm);
  if (!spec.hasRelative())
    return {own, Eigen::Vector3d::Zero()};
  return {own, own - tip(spec.other_arm)};
}

/// Tasks of a point: the relative position, if there is one, then the tip. @param velocity  feed-forward, m/s
Reference referenceTo(const TrajectorySpec& spec,
                      const TrajectoryPoint& point,
                      const TrajectoryPoint& velocity) noexcept;

/** Samples the trajectory from a start: point_count points, without the start itself. @throw std::invalid_argument for
 * an empty or degenerate shape. */
std::vector<TrajectoryPoint> sample(const TrajectorySpec& spec,
                                    const Eigen::Vector3d& tip_start,
                                    const Eigen::Vector3d& relative_start);

}  // namespace tandem::planning
