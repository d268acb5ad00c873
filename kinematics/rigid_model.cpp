// SPDX-License-Identifier: Apache-2.0
#include "kinematics/rigid_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "kinematics/constant_curvature.h"

namespace tandem::kinematics {
namespace {

/// Rounding that a joint vector on the edge of equation (1) may carry, m.
constexpr double kEdgeTolerance = 1e-9;

/// Precurvature of a tube turned by alpha, 1/m; alpha = 0 bends toward +x.
Eigen::Vector3d turned(double curvature, double alpha) {
  return {-curvature * std::sin(alpha), curvature * std::cos(alpha), 0.0};
}

}  // namespace

std::string_view describe(ModelStatus status) {
  switch (status) {
    case ModelStatus::kOk:
      return "ok";
    case ModelStatus::kWrongSize:
      return "wrong number of joints";
    case ModelStatus::kNotFinite:
      return "a joint is not a finite number";
    case ModelStatus::kNotExtended:
      return "tube 1 ends at or behind the entry point";
    case ModelStatus::kProtruded:
      return "a tube's proximal end stands in front of the entry point (beta > 0)";
    case ModelStatus::kInnerInside:
      return "an outer tube ends ahead of an inner one";
  }
  return "unknown";
}

std::unique_ptr<ArmModel> makeArmModel(const std::string& name, const ConcentricTubeArm& arm) {
  if (name == "rigid")
    return std::make_unique<RigidModel>(arm);
  throw std::invalid_argument("unknown kinematic model '" + name + "', expected: rigid");
}

RigidModel::RigidModel(ConcentricTubeArm arm) : arm_(std::move(arm)) {
  if (arm_.tubeCount() < 2 || arm_.tubeCount() > kMaxTubes) {
    throw std::invalid_argument("an arm has 2 to 4 tubes, found " + std::to_string(arm_.tubeCount()));
  }
  for (int i = 0; i < arm_.tubeCount(); ++i)
    stiffness_[i] = arm_.tubes[i].bendingStiffness();
}

ModelStatus RigidModel::check(const JointsRef& q) const noexcept {
  const int n = arm_.tubeCount();
  if (q.size() != 2 * n)
    return ModelStatus::kWrongSize;
  if (!q.allFinite())
    return ModelStatus::kNotFinite;
  for (int i = 0; i < n; ++i) {
    if (q[i] > kEdgeTolerance)
      return ModelStatus::kProtruded;
    const double end = q[i] + arm_.tubes[i].length();
    if (i == 0 && end <= 0.0)
      return ModelStatus::kNotExtended;
    if (i > 0 && end > std::max(0.0, q[i - 1] + arm_.tubes[i - 1].length()) + kEdgeTolerance) {
      return ModelStatus::kInnerInside;
    }
  }
  return ModelStatus::kOk;
}

RigidModel::Sections RigidModel::split(const JointsRef& q) const noexcept {
  struct Boundary {
    double s;
    int tube;
    Part next;
  };
  const int n = arm_.tubeCount();
  std::array<Part, kMaxTubes> part{};
  std::array<Boundary, 2 * kMaxTubes> boundary{};
  int boundaries = 0;
  for (int i = 0; i < n; ++i) {
    const double curve = q[i] + arm_.tubes[i].straight_length;
    const double end = q[i] + arm_.tubes[i].length();
    part[i] = end <= 0.0 ? Part::kEnded : curve <= 0.0 ? Part::kCurved : Part::kStraight;
    if (curve > 0.0)
      boundary[boundaries++] = {curve, i, Part::kCurved};
    if (end > 0.0)
      boundary[boundaries++] = {end, i, Part::kEnded};
  }
  // Insertion sort, stable, outer tubes first where ends meet, so that tube 1's end is the last of all.
  for (int i = 1; i < boundaries; ++i) {
    for (int j = i; j > 0; --j) {
      const Boundary& left = boundary[j - 1];
      const Boundary& right = boundary[j];
      const bool tie_first = left.s == right.s && left.tube < right.tube;
      if (!(left.s > right.s || tie_first))
        break;
      std::swap(boundary[j - 1], boundary[j]);
    }
  }
  Sections sections;
  double start = 0.0;
  for (int k = 0; k < boundaries; ++k) {
    Section& section = sections.section[sections.count++];
    section.start = start;
    section.end = boundary[k].s;
    section.owner = boundary[k].tube;
    section.part = part;
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    section.stiffness = 0.0;
    for (int i = 0; i < n; ++i) {
      if (part[i] == Part::kEnded)
        continue;
      section.stiffness += stiffness_[i];
      if (part[i] == Part::kCurved)
        moment += stiffness_[i] * turned(arm_.tubes[i].curvature, q[n + i]);
    }
    section.u = section.stiffness > 0.0 ? Eigen::Vector3d(moment / section.stiffness) : Eigen::Vector3d::Zero();
    part[boundary[k].tube] = boundary[k].next;
    start = section.end;
    if (boundary[k].tube == 0 && boundary[k].next == Part::kEnded)
      break;
  }
  return sections;
}

ModelStatus RigidModel::tip(const JointsRef& q, Tip& tip) const noexcept {
  if (const ModelStatus status = check(q); status != ModelStatus::kOk)
    return status;
  const int n = arm_.tubeCount();
  const Sections sections = split(q);

  // Every effect on the tip is a velocity of a point plus a turn about it: collected as the twist at the base's origin.
  Jacobian twist(6, 2 * n);
  twist.setZero();
  const auto add = [&](int joint, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular,
                       const Eigen::Vector3d& at) {
    twist.col(joint).head<3>() += linear - angular.cross(at);
    twist.col(joint).tail<3>() += angular;
  };

  Eigen::Matrix3d rotation = arm_.base.linear();
  Eigen::Vector3d position = arm_.base.translation();
  for (int k = 0; k < sections.count; ++k) {
    const Section& section = sections.section[k];
    const Arc arc(section.u, section.end - section.start);
    const Eigen::Vector3d end = position + rotation * arc.position();
    for (int i = 0; i < n; ++i) {
      if (section.part[i] != Part::kCurved)
        continue;
      const double alpha = q[n + i];
      const double share = stiffness_[i] / section.stiffness * arm_.tubes[i].curvature;
      const Eigen::Vector3d du(-share * std::cos(alpha), -share * std::sin(alpha), 0.0);
      add(n + i, rotation * arc.positionDerivative(du), rotation * arc.rotationDerivative(du), end);
    }
    rotation = rotation * arc.rotation();
    position = end;
    const bool last = k + 1 == sections.count;
    const Eigen::Vector3d behind = last ? Eigen::Vector3d::Zero() : sections.section[k + 1].u;
    const Eigen::Vector3d forward = last ? Eigen::Vector3d(rotation.col(2)) : Eigen::Vector3d::Zero();
    add(section.owner, forward, rotation * (section.u - behind), position);
  }

  tip.pose.linear() = rotation;
  tip.pose.translation() = position;
  tip.pose = tip.pose * arm_.tool;
  tip.jacobian.resize(6, 2 * n);
  for (int j = 0; j < 2 * n; ++j) {
    const Eigen::Vector3d angular = twist.col(j).tail<3>();
    tip.jacobian.col(j).tail<3>() = angular;
    tip.jacobian.col(j).head<3>() = twist.col(j).head<3>() + angular.cross(Eigen::Vector3d(tip.pose.translation()));
  }
  tip.stability = 1.0;
  return ModelStatus::kOk;
}

ModelStatus RigidModel::shape(const JointsRef& q, int points, std::vector<ShapePoint>& shape) const {
  if (const ModelStatus status = check(q); status != ModelStatus::kOk)
    return status;
  const int n = arm_.tubeCount();
  const Sections sections = split(q);
  const double length = sections.section[sections.count - 1].end;
  shape.resize(static_cast<std::size_t>(std::max(points, 2)));

  Eigen::Isometry3d start = arm_.base;
  int k = 0;
  for (std::size_t j = 0; j < shape.size(); ++j) {
    ShapePoint& point = shape[j];
    const bool last = j + 1 == shape.size();
    point.s = last ? length : length * static_cast<double>(j) / static_cast<double>(shape.size() - 1);
    while (k + 1 < sections.count && point.s > sections.section[k].end) {
      const Arc whole(sections.section[k].u, sections.section[k].end - sections.section[k].start);
      start.translation() += start.linear() * whole.position();
      start.linear() = start.linear() * whole.rotation();
      ++k;
    }
    const Section& section = sections.section[k];
    const Arc arc(section.u, point.s - section.start);
    point.pose.linear() = start.linear() * arc.rotation();
    point.pose.translation() = start.translation() + start.linear() * arc.position();
    point.psi.fill(std::numeric_limits<double>::quiet_NaN());
    point.outermost_tube = 0;
    for (int i = 0; i < n; ++i) {
      if (section.part[i] == Part::kEnded)
        continue;
      point.psi[i] = q[n + i];
      point.outermost_tube = i + 1;
    }
  }
  return ModelStatus::kOk;
}

}  // namespace tandem::kinematics
