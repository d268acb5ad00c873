// SPDX-License-Identifier: Apache-2.0
#include "kinematics/catheter/arm.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace tandem::kinematics::catheter {

using Eigen::Isometry3d;
using Eigen::Vector3d;

void checkArm(const Arm& arm) {
  if (!(arm.bending_length > 0.0) || !std::isfinite(arm.bending_length))
    throw std::invalid_argument("bending length: found " + std::to_string(arm.bending_length) +
                                " m, expected a number above zero");
  if (!arm.base.matrix().allFinite() || !arm.tool.matrix().allFinite())
    throw std::invalid_argument("base or tool of a catheter arm: found a number that is not finite");
}

ModelStatus checkJoints(const JointsRef& q) noexcept {
  if (q.size() != kJoints)
    return ModelStatus::kWrongSize;
  if (!q.allFinite())
    return ModelStatus::kNotFinite;
  return q[kInsertion] < 0.0 ? ModelStatus::kDistalInside : ModelStatus::kOk;
}

namespace {

/// Arm base frame <- base of bending.
Isometry3d proximal(const JointsRef& q) {
  return Eigen::Translation3d(0.0, 0.0, q[kInsertion]) * Eigen::AngleAxisd(q[kRoll], Vector3d::UnitZ());
}

/// Columns of insertion and roll for a point fixed behind both. @param arm  in the robot base frame, as the point
void proximalColumns(const Isometry3d& arm, const Vector3d& point, Jacobian& jacobian) {
  const Vector3d axis = arm.linear().col(2);
  jacobian.setZero(6, kJoints);
  jacobian.col(kInsertion).head<3>() = axis;
  jacobian.col(kRoll).head<3>() = axis.cross(point - arm.translation());
  jacobian.col(kRoll).tail<3>() = axis;
}

}  // namespace

ConstantCurvature::ConstantCurvature(const Arm& arm) : arm_(arm) { checkArm(arm); }

void ConstantCurvature::distal(const Arm& arm, double bend, Isometry3d& pose, Eigen::Matrix<double, 6, 1>& by_bend) {
  const Vector3d axis = Vector3d::UnitY() / arm.bending_length;
  const Arc arc(bend * axis, arm.bending_length);
  const Vector3d tool = arc.rotation() * arm.tool.translation();
  pose.linear() = arc.rotation() * arm.tool.linear();
  pose.translation() = arc.position() + tool;
  by_bend << arc.positionDerivative(axis) + Vector3d::UnitY().cross(tool), Vector3d::UnitY();
}

ModelStatus ConstantCurvature::tip(const JointsRef& q, Tip& tip) const noexcept {
  const ModelStatus status = checkJoints(q);
  if (status != ModelStatus::kOk)
    return status;
  const Isometry3d base = arm_.base * proximal(q);
  Isometry3d end;
  Eigen::Matrix<double, 6, 1> by_bend;
  distal(arm_, q[kBend], end, by_bend);
  tip = Tip();
  tip.pose = base * end;
  proximalColumns(arm_.base, tip.pose.translation(), tip.jacobian);
  tip.jacobian.col(kBend) << base.linear() * by_bend.head<3>(), base.linear() * by_bend.tail<3>();
  return status;
}

ModelStatus ConstantCurvature::bendingBase(const JointsRef& q, Tip& base) const noexcept {
  const ModelStatus status = checkJoints(q);
  if (status != ModelStatus::kOk)
    return status;
  base = Tip();
  base.pose = arm_.base * proximal(q);
  proximalColumns(arm_.base, base.pose.translation(), base.jacobian);
  return status;
}

ModelStatus ConstantCurvature::shape(const JointsRef& q, int points, std::vector<ShapePoint>& shape) const {
  const ModelStatus status = checkJoints(q);
  if (status != ModelStatus::kOk)
    return status;
  const Isometry3d base = arm_.base * proximal(q);
  const double curvature = q[kBend] / arm_.bending_length;
  shape.assign(static_cast<std::size_t>(std::max(points, 0)), ShapePoint());
  for (std::size_t k = 0; k < shape.size(); ++k) {
    ShapePoint& point = shape[k];
    const double part = shape.size() > 1 ? static_cast<double>(k) / static_cast<double>(shape.size() - 1) : 0.0;
    point.s = part * (q[kInsertion] + arm_.bending_length);
    point.psi.fill(std::numeric_limits<double>::quiet_NaN());
    point.moment.fill(std::numeric_limits<double>::quiet_NaN());
    point.outermost_tube = 1;
    const double beyond = point.s - q[kInsertion];
    if (beyond <= 0.0) {
      point.pose = base * Eigen::Translation3d(0.0, 0.0, beyond);
      continue;
    }
    const Arc arc(Vector3d(0.0, curvature, 0.0), beyond);
    point.curvature = Eigen::Vector2d(0.0, curvature);
    point.pose.linear() = base.linear() * arc.rotation();
    point.pose.translation() = base * arc.position();
  }
  return status;
}

}  // namespace tandem::kinematics::catheter
