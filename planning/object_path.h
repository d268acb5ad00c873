// SPDX-License-Identifier: Apache-2.0
/** @file Paths of the common object: lines, circles and Lissajous figures along selected translations and
 * rotations. */
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace tandem::planning {

/// Linear, angular.
using Twist = Eigen::Matrix<double, 6, 1>;

enum class PathShape { kLine, kCircle, kLissajous };
/// @throw std::invalid_argument for another name than line, circle, lissajous.
PathShape pathShape(const std::string& name);
std::string nameOf(PathShape shape);

/** What is held of the components that a path does not move along. */
enum class Hold {
  kNone,    ///< they follow as contacts and posture have it
  kPlaces,  ///< the three of the place
  kAll      ///< place and orientation
};
/// @throw std::invalid_argument for another name than none, places, all.
Hold holdOf(const std::string& name);
std::string nameOf(Hold hold);

/** x, y, z, rx, ry, rz by index 0 to 5. @throw std::invalid_argument for another name. */
int directionOf(const std::string& name);
std::string directionName(int direction);

/** A path that begins and ends at rest.
 *
 * With c(t) of the shape and phase p(t) from 0 to 1 (a quintic, at rest at both ends):
 *   line:      out by size along the first direction and back, c_1 = size sin^2(pi p)
 *   circle:    c_1 = size (1 - cos 2 pi p), c_2 = size sin 2 pi p
 *   lissajous: c_1 = size sin 2 pi p, c_2 = size sin 4 pi p: the figure of Alsaka et al. 2024
 * Angular directions take size / length rad. Places are in the robot base frame, turns rotation vectors in it. */
struct ObjectPath {
  PathShape shape = PathShape::kLissajous;
  std::vector<int> directions;  ///< 1 of a line, else 2, all different
  double size = 5e-3;           ///< m
  double duration = 10.0;       ///< s
  double length = 1.0;          ///< m that a radian counts as
  Hold held = Hold::kPlaces;
  std::string name = {};

  /// @throw std::invalid_argument: what was found and what is expected.
  void check() const;
  /// Displacement from the start (m; rotation vector, rad) and the twist of the path at a time.
  void at(double time, Twist& displacement, Twist& rate) const;
  /// Which of the six components are to be tracked: those of the directions and those held.
  std::vector<int> tracked() const;
};

/// The frame of a path that starts at `start`.
Eigen::Isometry3d displaced(const Eigen::Isometry3d& start, const Twist& displacement);
/// Twist that leads from one frame to another in unit time, robot base frame.
Twist difference(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to);

}  // namespace tandem::planning
