// SPDX-License-Identifier: Apache-2.0
#include "kinematics/rigid_model.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kinematics/constant_curvature.h"
#include "kinematics/swept_end.h"

namespace tandem::kinematics {

RigidModel::RigidModel(ConcentricTubeArm arm) : TubeModel(std::move(arm)) {
  helical_ = std::ranges::any_of(arm_.tubes, &Tube::isHelical);
}

RigidModel::Axes RigidModel::axes(const JointsRef& q) const noexcept {
  Axes axes;
  const int n = arm_.tubeCount();
  for (int i = 0; i < n; ++i)
    axes[i] = {-std::sin(q[n + i]), std::cos(q[n + i]), 0.0};
  return axes;
}

RigidModel::Bend RigidModel::bend(const Segmentation::Interval& interval, const Axes& axes) const noexcept {
  Bend result;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (int i = 0; i < arm_.tubeCount(); ++i) {
    if (interval.section[i] == Segmentation::kAbsent)
      continue;
    const TubeSection& section = arm_.tubes[i].sections[interval.section[i]];
    result.stiffness += section.bending_stiffness;
    moment += section.bending_stiffness * section.curvature * axes[i];
  }
  result.u = moment / result.stiffness;
  return result;
}

ModelStatus RigidModel::tip(const JointsRef& q, Branch&, Tip& tip) const noexcept {
  if (const ModelStatus status = checkJoints(arm_, q); status != ModelStatus::kOk)
    return status;
  if (helical_)
    return helicalTip(q, tip);
  const int n = arm_.tubeCount();
  Segmentation parts;
  segment(arm_, q, parts);

  // Every contribution to the tip is a velocity of a point plus a rotation about it: accumulated as the twist at the
  // base's origin.
  Jacobian twist(6, 2 * n);
  twist.setZero();
  const auto add = [&](int joint, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular,
                       const Eigen::Vector3d& at) {
    twist.col(joint).head<3>() += linear - angular.cross(at);
    twist.col(joint).tail<3>() += angular;
  };

  Eigen::Matrix3d rotation = arm_.base.linear();
  Eigen::Vector3d position = arm_.base.translation();
  const Axes turned = axes(q);
  Bend here = bend(parts.interval[0], turned);
  for (int k = 0; k < parts.count; ++k) {
    const Segmentation::Interval& interval = parts.interval[k];
    const Arc arc(here.u, interval.end - interval.start);
    const Eigen::Vector3d end = position + rotation * arc.position();
    for (int i = 0; i < n; ++i) {
      if (interval.section[i] == Segmentation::kAbsent)
        continue;
      const TubeSection& section = arm_.tubes[i].sections[interval.section[i]];
      const Eigen::Vector3d du = bendByRotation(section, here, turned[i]);
      add(n + i, rotation * arc.positionDerivative(du), rotation * arc.rotationDerivative(du), end);
    }
    rotation = rotation * arc.rotation();
    position = end;
    const bool last = k + 1 == parts.count;
    const Bend behind = last ? Bend{} : bend(parts.interval[k + 1], turned);
    const Eigen::Vector3d forward = last ? Eigen::Vector3d(rotation.col(2)) : Eigen::Vector3d::Zero();
    add(interval.owner, forward, rotation * (here.u - behind.u), position);
    here = behind;
  }
  add(n, Eigen::Vector3d::Zero(), rotation.col(2), position);  // the end frame rotates with tube 1

  tip.pose.linear() = rotation * Eigen::AngleAxisd(q[n], Eigen::Vector3d::UnitZ()).toRotationMatrix();
  tip.pose.translation() = position;
  tip.pose = tip.pose * arm_.tool;
  tip.jacobian.resize(6, 2 * n);
  for (int j = 0; j < 2 * n; ++j) {
    const Eigen::Vector3d angular = twist.col(j).tail<3>();
    tip.jacobian.col(j).tail<3>() = angular;
    tip.jacobian.col(j).head<3>() = twist.col(j).head<3>() + angular.cross(Eigen::Vector3d(tip.pose.translation()));
  }
  tip.stability = 1.0;
  tip.stability_at = parts.length();
  tip.conjugate_points = 0;
  return ModelStatus::kOk;
}

ModelStatus RigidModel::shape(const JointsRef& q,
                              const Wrench& wrench,
                              Branch&,
                              int points,
                              std::vector<ShapePoint>& shape) const {
  if (const ModelStatus status = checkJoints(arm_, q); status != ModelStatus::kOk)
    return status;
  if (!wrench.isZero(0.0))
    return ModelStatus::kCarriesNoLoad;
  const int n = arm_.tubeCount();
  Segmentation parts;
  segment(arm_, q, parts);
  if (helical_) {
    helicalShape(q, parts, points, shape);
    return ModelStatus::kOk;
  }
  shape.resize(static_cast<std::size_t>(std::max(points, 2)));

  const Eigen::AngleAxisd roll(q[n], Eigen::Vector3d::UnitZ());
  Eigen::Isometry3d start = arm_.base;
  const Axes turned = axes(q);
  Bend here = bend(parts.interval[0], turned);
  int k = 0;
  for (std::size_t j = 0; j < shape.size(); ++j) {
    ShapePoint& point = shape[j];
    const bool last = j + 1 == shape.size();
    point.s = last ? parts.length() : parts.length() * static_cast<double>(j) / static_cast<double>(shape.size() - 1);
    while (k + 1 < parts.count && point.s > parts.interval[k].end) {
      const Arc whole(here.u, parts.interval[k].end - parts.interval[k].start);
      start.translation() += start.linear() * whole.position();
      start.linear() = start.linear() * whole.rotation();
      here = bend(parts.interval[++k], turned);
    }
    const Arc arc(here.u, point.s - parts.interval[k].start);
    point.pose.linear() = start.linear() * arc.rotation() * roll.toRotationMatrix();
    point.pose.translation() = start.translation() + start.linear() * arc.position();
    point.curvature = here.u.head<2>();
    point.psi.fill(std::numeric_limits<double>::quiet_NaN());
    point.moment.fill(std::numeric_limits<double>::quiet_NaN());
    point.outermost_tube = 0;
    for (int i = 0; i < n; ++i) {
      if (parts.interval[k].section[i] == Segmentation::kAbsent)
        continue;
      point.psi[i] = q[n + i];
      point.moment[i] = 0.0;  // no torsion: the torsional moment is not part of the model
      point.outermost_tube = i + 1;
    }
  }
  return ModelStatus::kOk;
}

ModelStatus RigidModel::helicalTip(const JointsRef& q, Tip& tip) const noexcept {
  Segmentation parts;
  segment(arm_, q, parts);
  const TubeVector ends = untwistedEnds(arm_, parts, q);
  SweptEnd({arm_, parts, TubeJoints(q).beta, ends, 0.0, StepDepth::kPose}, ends).toTool(arm_, tip);
  return ModelStatus::kOk;
}

void RigidModel::helicalShape(const JointsRef& q,
                              const Segmentation& parts,
                              int points,
                              std::vector<ShapePoint>& shape) const {
  spaceEvenly(parts.length(), points, shape);
  const EndAngleSweep<double> sweep(arm_, parts, TubeJoints(q).beta, untwistedEnds(arm_, parts, q), 0.0,
                                    StepDepth::kPose, shape);
  placeSamples(arm_, sweep, shape);
  for (ShapePoint& point : shape) {
    for (double& moment : point.moment)
      moment = std::isnan(moment) ? moment : 0.0;
  }
}

}  // namespace tandem::kinematics
