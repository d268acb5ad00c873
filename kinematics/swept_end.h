// SPDX-License-Identifier: Apache-2.0
/** @file From a sweep of an unloaded arm to its tool tip. */
#pragma once

#include <vector>

#include "kinematics/equilibrium.h"

namespace tandem::kinematics {

/// Pose of tube 1's end, torsion-free, in the arm's base frame, from a sweep with kPose.
inline Eigen::Isometry3d endPose(const EndAngleSweep<double>& sweep) {
  Eigen::Isometry3d end = Eigen::Isometry3d::Identity();
  end.linear() = sweep.endRotation();
  end.translation() = sweep.endPosition();
  return end;
}

/// Arc lengths of that many points, at least 2, evenly from the entry point to `length`, m.
void spaceEvenly(double length, int points, std::vector<ShapePoint>& shape);

/// Poses of the samples of a sweep with kPose: from its frames to those of ShapePoint.
void placeSamples(const ConcentricTubeArm& arm, const EndAngleSweep<double>& sweep, std::vector<ShapePoint>& shape);

/** End of tube 1 with its derivatives by the joints, arm base frame. */
struct SweptEnd {
  Equilibrium::Root root;    ///< angles of the tubes' ends
  Eigen::Matrix3d rotation;  ///< of tube 1's end, torsion-free
  Eigen::Vector3d position;  ///< m
  /// Of that frame by beta and by alpha, about the base's origin.
  Eigen::Matrix<double, 6, kMaxTubes> by_translation, by_rotation;
  DeterminantTrack<double> determinant;

  SweptEnd() = default;
  /// With derivatives by beta and by the angles of the ends instead of alpha: those of tubes that do not twist.
  SweptEnd(const EndAngleSweep<double>& sweep, const TubeVector& theta);

  /// The end frame rotates with tube 1; twists become those of the tool's tip.
  void toTool(const ConcentricTubeArm& arm, Tip& tip) const;
};

}  // namespace tandem::kinematics
