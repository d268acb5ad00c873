// SPDX-License-Identifier: Apache-2.0
/** @file Foot of the perpendicular from a point to an arm's shaft, with its Jacobian. */
#pragma once

#include <vector>

#include "kinematics/arm_model.h"

namespace tandem::kinematics {

/** Point of an arm's shaft. */
struct ShaftPoint {
  double s = 0.0;  ///< arc length from the entry point, m; below zero behind it, above the arm's length beyond its end
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< robot base frame <- frame with z along the shaft
  Jacobian jacobian;  ///< linear rows: of the position at constant s; angular rows: zero, not computed
};

/** Finds the foot of the perpendicular from a point to the shaft: the backbone p(s), continued by a straight line along
 * its tangent t(s) behind the entry point and beyond its end. The foot is at
 *
 *     t(s) . (x - p(s)) = 0,
 *
 * of several at the one beside the nearest of kNodes + 1 points of the backbone; on a continuation only where its end
 * is the nearest of them. Where the shaft has a corner (planar arms) the corner may take the place of the foot.
 *
 * Allocates nothing after construction with models whose backbone() allocates nothing. Not thread-safe. */
class ShaftSearch {
 public:
  static constexpr int kNodes = 32;

  ShaftSearch() : s_(kNodes + 1), nodes_(kNodes + 1), s_one_(1), one_(1) {}

  /// @param branch  of the model's result for q  @param target  x, m, robot base frame
  ModelStatus find(const ArmModel& model,
                   const JointsRef& q,
                   const Branch& branch,
                   const Eigen::Vector3d& target,
                   bool derivatives,
                   ShaftPoint& foot);

 private:
  ModelStatus lookAt(const ArmModel& model, const JointsRef& q, const Branch& branch, double s, bool derivatives);

  std::vector<double> s_;             ///< of the nodes
  std::vector<BackbonePoint> nodes_;  ///< evenly spaced over the arm
  std::vector<double> s_one_;
  std::vector<BackbonePoint> one_;
};

}  // namespace tandem::kinematics
