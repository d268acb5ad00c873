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

/** Components that are kept constant although the path does not move along them. */
enum class Kept {
  kNone,      ///< the other components follow from contacts and posture
  kPosition,  ///< the three components of the position
  kAll        ///< position and orientation
};
/// @throw std::invalid_argument for another name than none, places, all.
Kept keptOf(const std::string& name);
std::string nameOf(Kept kept);

/** x, y, z, rx, ry, rz by index 0 to 5. @throw std::invalid_argument for another name. */
int directionOf(const std::string& name);
std::string directionName(int direction);

/** A path that begins and ends at standstill.
 *
 * With c(t) of the shape and phase p(t) from 0 to 1 (a quintic, zero speed at both ends):
 *   line:      out by size along the first direction and back, c_1 = size sin^2(pi p)
 *   circle:    c_1 = size (1 - cos 2 pi p), c_2 = size sin 2 pi p
 *   lissajous: c_1 = size sin 2 pi p, c_2 = size sin 4 pi p: the figure of Alsaka et al. 2024
 * Angular directions use size / length rad. Positions are in the robot base frame, rotations are rotation vectors in
 * it. */
struct ObjectPath {
  PathShape shape = PathShape::kLissajous;
  std::vector<int> directions;  ///< 1 of a line, else 2, all different
  double size = 5e-3;           ///< m
  double duration = 10.0;       ///< s
  double length = 1.0;          ///< length that converts radians to metres, m
  Kept kept = Kept::kPosition;
  std::string name = {};

  /// @throw std::invalid_argument with the value found and the one expected.
  void check() const;
  /// Displacement from the start (m; rotation vector, rad) and the twist of the path at a time.
  void at(double time, Twist& displacement, Twist& rate) const;
  /// Components to be tracked: those of the directions and those kept constant.
  std::vector<int> tracked() const;
};

/// The frame of a path that starts at `start`.
Eigen::Isometry3d displaced(const Eigen::Isometry3d& start, const Twist& displacement);
/// Twist that moves one frame to another in unit time, robot base frame.
Twist difference(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to);

}  // namespace tandem::planning
