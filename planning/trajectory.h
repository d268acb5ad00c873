// SPDX-License-Identifier: Apache-2.0
/** @file Reference trajectories: parameters of the shapes, and the points sampled from them. */
#pragma once

#include <Eigen/Core>
#include <string>
#include <variant>
#include <vector>

namespace tandem::planning {

/** Closed rectangle from the start: along `first`, then `second`, and back. m. */
struct Rectangle {
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Vector3d second = Eigen::Vector3d::Zero();
};

/** x_i = amplitude_i sin(2 pi cycles_i t + phase_i) - amplitude_i sin(phase_i), t in [0, 1]: starts at the start. */
struct Lissajous {
  Eigen::Vector3d amplitude = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d cycles = Eigen::Vector3d::Zero();
  Eigen::Vector3d phase = Eigen::Vector3d::Zero();  ///< rad
};

/** Circle that starts at the start and runs about center = start + center_offset, in the plane normal to `normal`. */
struct Circle {
  Eigen::Vector3d center_offset = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double turns = 1.0;
};

/** Straight line by `displacement`, m. */
struct Line {
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();
};

/** Polyline through given points, m; offsets from the start unless `absolute`. CSV files become this too. */
struct Waypoints {
  std::vector<Eigen::Vector3d> points;
  bool absolute = false;
};

using Shape = std::variant<Rectangle, Lissajous, Circle, Line, Waypoints>;

/** How a trajectory is run. */
enum class Following {
  kPointByPoint,  ///< the paper's protocol: next point when within tolerance, at most so many iterations a point
  kTimed,         ///< time-parameterised: trapezoidal speed along the path
};

/** A trajectory of one tip, with the relative position held or moved. SI. */
struct TrajectorySpec {
  std::string name;
  int arm = 0;        ///< whose tip follows the shape
  int other_arm = 1;  ///< partner in the relative position
  Shape shape;
  int point_count = 100;  ///< points after the start, evenly spaced by arc length
  std::vector<Shape>
      relative;  ///< empty: the relative position is held; one shape: it moves along it, in step with the tip
  Following following = Following::kPointByPoint;
  double tolerance = 0.88e-3;    ///< m
  int max_iterations = 100;      ///< per point
  double point_duration = 10.0;  ///< s a point is meant to take; feed-forward = spacing / point_duration
  double speed = 2e-3;           ///< m/s, timed following
  double acceleration = 5e-3;    ///< m/s^2, timed following
};

/** One point of a sampled trajectory: where the tip and the relative position shall be, m, robot base frame. */
struct TrajectoryPoint {
  Eigen::Vector3d tip;
  Eigen::Vector3d relative;
};

/** Samples the trajectory from a start: point_count points, the start itself not among them.
 * @throw std::invalid_argument for an empty or degenerate shape. */
std::vector<TrajectoryPoint> sample(const TrajectorySpec& spec,
                                    const Eigen::Vector3d& tip_start,
                                    const Eigen::Vector3d& relative_start);

}  // namespace tandem::planning
