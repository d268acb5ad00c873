// SPDX-License-Identifier: Apache-2.0
/** @file The spaces in which targets move: positions and orientations. Filters and guards are templates over them. */
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <numbers>

#include "kinematics/rotations.h"
#include "kinematics/tasks/task_kind.h"

namespace tandem::planning::teleoperation {

/** Positions, m; differences are displacements, m. */
struct Positions {
  using Point = Eigen::Vector3d;
  /// Largest distance between input and target: unlimited, since a straight line does not return to its start.
  static constexpr double kFarthest = std::numeric_limits<double>::infinity();

  static Point origin() noexcept { return Eigen::Vector3d::Zero(); }
  Eigen::Vector3d difference(const Point& to, const Point& from) const noexcept { return to - from; }
  Point moved(const Point& from, const Eigen::Vector3d& by) const noexcept { return from + by; }
  /// As published.
  Eigen::Vector3d shown(const Point& x, const Point&) const noexcept { return x; }
};

/** Orientations, unit quaternions: base frame <- tip. Differences are rotation vectors in the base frame, rad:
 * exp(difference(b, a)) a = b. */
struct Orientations {
  using Point = Eigen::Quaterniond;
  /// Largest angle between input and target, rad. Beyond a half turn the shortest rotation is the opposite one.
  static constexpr double kFarthest = 0.5 * std::numbers::pi;

  bool axis_only = false;  ///< only the tip axis counts: differences are perpendicular to it

  static Point origin() noexcept { return Eigen::Quaterniond::Identity(); }
  Eigen::Vector3d difference(const Point& to, const Point& from) const noexcept {
    if (axis_only)
      return kinematics::smallestRotation(from * Eigen::Vector3d::UnitZ(), to * Eigen::Vector3d::UnitZ());
    return kinematics::logarithm(Eigen::Quaterniond(to * from.conjugate()));
  }
  Point moved(const Point& from, const Eigen::Vector3d& by) const noexcept {
    return (kinematics::rotationBy(by) * from).normalized();
  }
  /// Rotation vector from the tip's present orientation.
  Eigen::Vector3d shown(const Point& x, const Point& now) const noexcept { return difference(x, now); }
};

/// Vector shortened to a length.
inline Eigen::Vector3d shortened(const Eigen::Vector3d& v, double length) noexcept {
  const double norm = v.norm();
  return norm > length ? Eigen::Vector3d((length / norm) * v) : v;
}

/** How much of a tip's orientation operators and CRTK clients command. */
enum class TipOrientation : std::uint8_t {
  kIgnored,
  kAxis,  ///< the tip axis, 2 degrees of freedom
  kFull,  ///< all 3
};

/// Task of that orientation; kNone: ignored.
constexpr idl::TaskKind taskOf(TipOrientation orientation) noexcept {
  return orientation == TipOrientation::kAxis   ? idl::TaskKind::kTipAxis
         : orientation == TipOrientation::kFull ? idl::TaskKind::kTipOrientation
                                                : idl::TaskKind::kNone;
}

}  // namespace tandem::planning::teleoperation
