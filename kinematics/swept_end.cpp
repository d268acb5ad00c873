// SPDX-License-Identifier: Apache-2.0
#include "kinematics/swept_end.h"

#include <algorithm>

namespace tandem::kinematics {

void spaceEvenly(double length, int points, std::vector<ShapePoint>& shape) {
  shape.resize(static_cast<std::size_t>(std::max(points, 2)));
  const double last = static_cast<double>(shape.size() - 1);
  for (std::size_t j = 0; j < shape.size(); ++j)
    shape[j].s = j + 1 == shape.size() ? length : length * static_cast<double>(j) / last;
}

void placeSamples(const ConcentricTubeArm& arm, const EndAngleSweep<double>& sweep, std::vector<ShapePoint>& shape) {
  const Eigen::Isometry3d end = endPose(sweep);
  for (ShapePoint& point : shape)
    point.pose = arm.base * end * point.pose * Eigen::AngleAxisd(point.psi[0], Eigen::Vector3d::UnitZ());
}

SweptEnd::SweptEnd(const EndAngleSweep<double>& sweep, const TubeVector& theta)
    : rotation(sweep.endRotation()),
      position(sweep.endPosition()),
      by_translation(sweep.twistByTranslation()),
      by_rotation(sweep.twistByEnd()),
      determinant(sweep.determinant()) {
  root.theta = theta;
}

void SweptEnd::toTool(const ConcentricTubeArm& arm, Tip& tip) const {
  Eigen::Isometry3d end = Eigen::Isometry3d::Identity();
  end.linear() = rotation * Eigen::AngleAxisd(root.theta[0], Eigen::Vector3d::UnitZ()).toRotationMatrix();
  end.translation() = position;
  tip.pose = arm.base * end * arm.tool;
  const Eigen::Vector3d tool = end * arm.tool.translation();
  const Eigen::Vector3d axis = rotation.col(2);
  const int n = arm.tubeCount();
  tip.jacobian.resize(6, 2 * n);
  const auto column = [&](int j, const Eigen::Matrix<double, 6, 1>& twist, double roll) {
    const Eigen::Vector3d angular = twist.tail<3>() + roll * axis;
    const Eigen::Vector3d linear = twist.head<3>() + angular.cross(tool) - roll * axis.cross(position);
    tip.jacobian.col(j).head<3>() = arm.base.linear() * linear;
    tip.jacobian.col(j).tail<3>() = arm.base.linear() * angular;
  };
  for (int i = 0; i < n; ++i) {
    column(i, by_translation.col(i), root.by_translation(0, i));
    column(n + i, by_rotation.col(i), root.by_rotation(0, i));
  }
  tip.stability = determinant.minimum();
  tip.stability_at = determinant.at();
  tip.conjugate_points = determinant.conjugatePoints();
}

}  // namespace tandem::kinematics
