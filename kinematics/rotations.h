// SPDX-License-Identifier: Apache-2.0
/** @file Rotation utilities: skew matrix, exponential map, tangent frames. */
#pragma once

#include <Eigen/Geometry>

namespace tandem::kinematics {

/// [v]x, so that [v]x w = v x w.
inline Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// Rotation vector of a rotation, rad.
inline Eigen::Vector3d logarithm(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

inline Eigen::Vector3d logarithm(const Eigen::Quaterniond& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

/// Rotation by a rotation vector, rad: the exponential map.
inline Eigen::Quaterniond rotationBy(const Eigen::Vector3d& vector) noexcept {
  const double angle = vector.norm();
  return angle > 0.0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, vector / angle)) : Eigen::Quaterniond::Identity();
}

}  // namespace tandem::kinematics
