// SPDX-License-Identifier: Apache-2.0
/** @file The path that a shaft follows: where it was at the start, and where its tip has gone since. */
#pragma once

#include <Eigen/Core>
#include <vector>

#include "planning/pose_problem.h"
#include "planning/tips.h"

namespace tandem::planning {

/** Path of a leader, the tip of an arm: points of the arm's shaft at the start, then points to which the tip has come.
 *
 * A deployment follows its leader where the shaft stays on this path (Gilbert, Neimat & Webster 2015). The deviation is
 *
 *     d = max_i |x_i - f(x_i)|
 *
 * over the points x_i of the path, with the foot f(x_i) of the perpendicular from x_i to the shaft, m. */
class LeaderPath {
 public:
  /// Points of the shaft at the start, and of the shaft with which the path is compared.
  static constexpr int kNodes = 129;

  bool empty() const noexcept { return points_.empty(); }
  void clear() noexcept { points_.clear(); }
  /// The shaft at the start. Stays empty where the model has no solution. @param tips  of all arms
  void start(const TipFollower& tips, int arm);
  /// The tip has come to where it is now.
  void pass(const TipFollower& tips) {
    if (!empty())
      points_.push_back(tips.tip(arm_).pose.translation());
  }

  /// The point x_i with the largest |x_i - f(x_i)|; not finite where the path is empty or the model has no solution.
  /// It is found with the tangents at kNodes points of the shaft: of several points whose distances differ by less
  /// than h^2 / 8 times the curvature, h the distance of the nodes, it may be any.
  Eigen::Vector3d farthest(const TipFollower& tips) const;

 private:
  int arm_ = 0;  ///< whose tip leads
  std::vector<Eigen::Vector3d> points_;
};

/** Deviation of an arm's shaft from the path of its leader over a joint path. */
struct LeaderDeviation {
  double distance = 0.0;                            ///< d, m
  int point = 0;                                    ///< where, counts from 1
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< the point of the path that the shaft has left, m
};

/** The largest deviation over a joint path: what the tubes allow with these joints.
 * @param path  joints of all arms, one column per point, the start first: FeasibilityReport::pathFrom()
 * @return not finite where a model has no solution at the start */
LeaderDeviation leaderDeviation(const Arms& arms, int arm, const Eigen::MatrixXd& path);

}  // namespace tandem::planning
