// SPDX-License-Identifier: Apache-2.0
#include "planning/leader_path.h"

#include <limits>

namespace tandem::planning {
namespace {

using Eigen::Vector3d;
using kinematics::BackbonePoint;
using kinematics::ModelStatus;

/// Of a point from the tangent at the nearest node, m^2.
double squaredDistance(const Vector3d& point, const std::vector<BackbonePoint>& shaft) {
  const auto from = [&](const BackbonePoint& node) { return (point - node.position).squaredNorm(); };
  const auto nearest = std::ranges::min_element(shaft, {}, from);
  const double along = nearest->tangent.dot(point - nearest->position);
  return std::max(0.0, from(*nearest) - along * along);
}

}  // namespace

void LeaderPath::start(const TipFollower& tips, int arm) {
  points_.clear();
  std::vector<BackbonePoint> shaft;
  if (tips.shaft(arm, kNodes, shaft) != ModelStatus::kOk)
    return;
  arm_ = arm;
  for (const BackbonePoint& node : shaft)
    points_.push_back(node.position);
}

Vector3d LeaderPath::farthest(const TipFollower& tips) const {
  std::vector<BackbonePoint> shaft;
  if (empty() || tips.shaft(arm_, kNodes, shaft) != ModelStatus::kOk)
    return Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  return *std::ranges::max_element(points_, {}, [&](const Vector3d& x) { return squaredDistance(x, shaft); });
}

LeaderDeviation leaderDeviation(const Arms& arms, int arm, const Eigen::MatrixXd& path) {
  LeaderDeviation largest;
  TipFollower tips(arms.models);
  LeaderPath leader;
  for (Eigen::Index k = 0; k < path.cols(); ++k) {
    if (!tips.update(path.col(k)))
      continue;
    if (leader.empty())
      leader.start(tips, arm);
    else
      leader.pass(tips);
    const Vector3d place = leader.farthest(tips);
    kinematics::ShaftPoint foot;
    if (!place.allFinite() || tips.shaftPoint(arm, place, false, foot) != ModelStatus::kOk)
      continue;
    const double distance = (place - foot.pose.translation()).norm();
    if (distance > largest.distance)
      largest = {distance, static_cast<int>(k), place};
  }
  if (leader.empty())
    largest.distance = std::numeric_limits<double>::quiet_NaN();
  return largest;
}

}  // namespace tandem::planning
