// SPDX-License-Identifier: Apache-2.0
/** @file Virtual fixtures: forbidden regions and guidance paths for the tips; robot base frame, m. */
#pragma once

#include <Eigen/Core>
#include <string>
#include <variant>
#include <vector>

namespace tandem::planning::teleoperation {

struct Sphere {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 0.0;
};
/** All points behind a plane. */
struct HalfSpace {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit vector out of the forbidden side
};
/** Box with axes parallel to those of the base frame. */
struct Box {
  Eigen::Vector3d minimum = Eigen::Vector3d::Zero();
  Eigen::Vector3d maximum = Eigen::Vector3d::Zero();
};

/** A convex region that no tip may enter. */
struct ForbiddenRegion {
  std::string name;
  std::variant<Sphere, HalfSpace, Box> shape;
};

/// Distance of a point to the surface of a region, m; negative inside. Convex along every straight line.
double distance(const ForbiddenRegion& region, const Eigen::Vector3d& point) noexcept;
/// Unit vector along which that distance increases fastest.
Eigen::Vector3d outward(const ForbiddenRegion& region, const Eigen::Vector3d& point) noexcept;
/// Smallest distance on the straight line from one point to another, m.
double nearestOnWay(const ForbiddenRegion& region, const Eigen::Vector3d& from, const Eigen::Vector3d& to) noexcept;

/** Guidance path: attenuates motion away from it, not motion back to it. */
struct Guidance {
  std::vector<Eigen::Vector3d> points;  ///< of the polyline, two or more
  double strength = 0.0;                ///< 0: none, 1: no motion away from the path
  double radius = 0.0;                  ///< no guidance beyond this distance, m
};

/// The step d, m, from a position, after guidance.
Eigen::Vector3d guided(const Guidance& guidance, const Eigen::Vector3d& from, const Eigen::Vector3d& d) noexcept;

}  // namespace tandem::planning::teleoperation
