// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "kinematics/compliant_model.h"
#include "kinematics/constant_curvature.h"
#include "kinematics/rigid_model.h"
#include "kinematics/swept_end.h"

namespace tandem::kinematics {
namespace {

constexpr int kShapePoints = 129;
/// Steps of central differences: a model error of 1e-12 m causes a derivative error below 1e-6; near a jump of
/// curvature the error is of the order of the step.
constexpr double kTranslationStep = 1e-6, kRotationStep = 1e-5;

/// Cubic Hermite interpolation of a sampled backbone; straight beyond its end.
void interpolate(const std::vector<ShapePoint>& shape, double s, BackbonePoint& point) {
  const double length = shape.back().s, h = length / static_cast<double>(shape.size() - 1);
  const std::size_t k = std::min(shape.size() - 2, static_cast<std::size_t>(std::max(0.0, s / h)));
  const Eigen::Vector3d p0 = shape[k].pose.translation(), p1 = shape[k + 1].pose.translation();
  const Eigen::Vector3d t0 = shape[k].pose.linear().col(2), t1 = shape[k + 1].pose.linear().col(2);
  const double beyond = std::max(0.0, s - length), x = std::clamp((s - beyond - shape[k].s) / h, 0.0, 1.0);
  const double x2 = x * x, x3 = x2 * x;
  point.s = s;
  point.position =
      (2 * x3 - 3 * x2 + 1) * p0 + (x3 - 2 * x2 + x) * h * t0 + (3 * x2 - 2 * x3) * p1 + (x3 - x2) * h * t1;
  point.tangent = ((6 * x2 - 6 * x) / h * (p0 - p1) + (3 * x2 - 4 * x + 1) * t0 + (3 * x2 - 2 * x) * t1).normalized();
  point.position += beyond * point.tangent;
}

/** Central differences of backbone points by all joints.
 * @param places places(q, branch, take) calls take(i, position) for every point; returns a status */
template <class Places>
void differentiate(const JointsRef& q, const Branch& branch, std::vector<BackbonePoint>& points, const Places& places) {
  const auto joints = static_cast<int>(q.size());
  for (BackbonePoint& point : points)
    point.jacobian.setZero(3, joints);
  safety::ArmVector moved = q;
  for (int j = 0; j < joints; ++j) {
    const double step = j < joints / 2 ? kTranslationStep : kRotationStep;
    double span = 0.0;
    for (const double sense : {1.0, -1.0}) {
      moved[j] = q[j] + sense * step;
      Branch aside = branch;
      const bool there = places(moved, aside, [&](std::size_t i, const Eigen::Vector3d& position) {
                           points[i].jacobian.col(j) += sense * position;
                         }) == ModelStatus::kOk;
      for (std::size_t i = 0; !there && i < points.size(); ++i)
        points[i].jacobian.col(j) += sense * points[i].position;
      span += there ? step : 0.0;
    }
    moved[j] = q[j];
    for (BackbonePoint& point : points)
      point.jacobian.col(j) /= std::max(span, 1e-12);  // one-sided at a limit of equation (1)
  }
}

/// Points of an unloaded arm with these angles of its ends. Calls take(i, place, tangent) for every arc length; each
/// sweep computes up to kShapePoints samples, and swept(sweep) sees the first one.
template <class Swept, class Take>
void sweepPlaces(const ConcentricTubeArm& arm,
                 const Segmentation& parts,
                 const TubeVector& beta,
                 const TubeVector& theta,
                 double coupling,
                 const std::vector<double>& s,
                 const Swept& swept,
                 const Take& take) {
  std::array<ShapePoint, kShapePoints> samples;
  for (std::size_t begin = 0; begin < s.size() || begin == 0; begin += samples.size()) {
    const std::span<ShapePoint> piece(samples.data(), std::min(samples.size(), s.size() - begin));
    for (std::size_t i = 0; i < piece.size(); ++i)
      piece[i].s = std::min(s[begin + i], parts.length());
    const EndAngleSweep<double> sweep(arm, parts, beta, theta, coupling, StepDepth::kPose, piece);
    if (begin == 0)
      swept(sweep);
    const Eigen::Isometry3d end = endPose(sweep);
    for (std::size_t i = 0; i < piece.size(); ++i) {
      const Eigen::Isometry3d frame = arm.base * end * piece[i].pose;
      const Eigen::Vector3d tangent = frame.linear().col(2);
      take(begin + i, frame.translation() + (s[begin + i] - piece[i].s) * tangent, tangent);
    }
  }
}

/// Backbone points and, if wanted, their central differences. @param places as in differentiate(); take(i, position,
/// tangent)
template <class Places>
ModelStatus backboneOf(const JointsRef& q,
                       Branch& branch,
                       const std::vector<double>& s,
                       bool derivatives,
                       std::vector<BackbonePoint>& points,
                       const Places& places) {
  points.resize(s.size());
  const ModelStatus status = places(q, branch, [&](std::size_t i, const auto& position, const auto& tangent) {
    points[i].s = s[i];
    points[i].position = position;
    points[i].tangent = tangent;
  });
  if (status == ModelStatus::kOk && derivatives) {
    differentiate(q, branch, points, [&](const JointsRef& moved, Branch& aside, const auto& take) {
      return places(moved, aside, [&](std::size_t i, const auto& position, const auto&) { take(i, position); });
    });
  }
  return status;
}

}  // namespace

ModelStatus ArmModel::backbone(const JointsRef& q,
                               Branch& branch,
                               const std::vector<double>& s,
                               bool derivatives,
                               std::vector<BackbonePoint>& points) const {
  std::vector<ShapePoint> shape;
  const Wrench none = Wrench::Zero();
  if (const ModelStatus status = this->shape(q, none, branch, kShapePoints, shape); status != ModelStatus::kOk)
    return status;
  points.resize(s.size());
  for (std::size_t i = 0; i < s.size(); ++i)
    interpolate(shape, s[i], points[i]);
  if (derivatives) {
    differentiate(q, branch, points, [&](const JointsRef& moved, Branch& aside, const auto& take) {
      const ModelStatus status = this->shape(moved, none, aside, kShapePoints, shape);
      BackbonePoint point;
      for (std::size_t i = 0; status == ModelStatus::kOk && i < s.size(); ++i) {
        interpolate(shape, s[i], point);
        take(i, point.position);
      }
      return status;
    });
  }
  return ModelStatus::kOk;
}

double ArmModel::helixAngle(const JointsRef&, int) const noexcept { return 0.0; }

Gradient ArmModel::stabilityGradient(const JointsRef&, const Branch&) const { return Gradient::Zero(jointCount()); }

/// Calls take(i, place, tangent) for every arc length.
template <class Take>
ModelStatus CompliantModel::places(const JointsRef& q,
                                   Branch& branch,
                                   const std::vector<double>& s,
                                   const Take& take) const noexcept {
  if (const ModelStatus status = checkJoints(arm_, q); status != ModelStatus::kOk)
    return status;
  if (const ModelStatus status = unload(q, branch); status != ModelStatus::kOk)
    return status;
  Segmentation parts;
  segment(arm_, q, parts);
  Equilibrium::Root root;
  if (const ModelStatus status = equilibrium_.find(q, branch, root); status != ModelStatus::kOk)
    return status;
  sweepPlaces(
      arm_, parts, TubeJoints(q).beta, root.theta, 1.0, s,
      [&](const EndAngleSweep<double>& sweep) {
        root.linearise(sweep);
        root.remember(q, branch);
      },
      take);
  return ModelStatus::kOk;
}

ModelStatus CompliantModel::backbone(const JointsRef& q,
                                     Branch& branch,
                                     const std::vector<double>& s,
                                     bool derivatives,
                                     std::vector<BackbonePoint>& points) const {
  return backboneOf(q, branch, s, derivatives, points,
                    [&](const JointsRef& at, Branch& on, const auto& take) { return places(at, on, s, take); });
}

ModelStatus RigidModel::helicalBackbone(const JointsRef& q,
                                        Branch& branch,
                                        const std::vector<double>& s,
                                        bool derivatives,
                                        std::vector<BackbonePoint>& points) const {
  return backboneOf(q, branch, s, derivatives, points, [&](const JointsRef& at, Branch&, const auto& take) {
    if (const ModelStatus status = checkJoints(arm_, at); status != ModelStatus::kOk)
      return status;
    Segmentation parts;
    segment(arm_, at, parts);
    sweepPlaces(
        arm_, parts, TubeJoints(at).beta, untwistedEnds(arm_, parts, at), 0.0, s, [](const auto&) {}, take);
    return ModelStatus::kOk;
  });
}

ModelStatus RigidModel::backbone(const JointsRef& q,
                                 Branch& branch,
                                 const std::vector<double>& s,
                                 bool derivatives,
                                 std::vector<BackbonePoint>& points) const {
  if (helical_)
    return helicalBackbone(q, branch, s, derivatives, points);
  if (const ModelStatus status = checkJoints(arm_, q); status != ModelStatus::kOk)
    return status;
  const int n = arm_.tubeCount();
  Segmentation parts;
  segment(arm_, q, parts);
  points.resize(s.size());
  // As in tip(): twists about the base's origin, accumulated over all boundaries before s.
  Jacobian passed = Jacobian::Zero(6, 2 * n), here_too(6, 2 * n);
  const auto add = [](Jacobian& twist, int joint, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular,
                      const Eigen::Vector3d& at) {
    twist.col(joint).head<3>() += linear - angular.cross(at);
    twist.col(joint).tail<3>() += angular;
  };
  const Axes turned = axes(q);
  Eigen::Matrix3d rotation = arm_.base.linear();
  Eigen::Vector3d position = arm_.base.translation();
  const auto bend_to = [&](int k, const Bend& here, double length, Eigen::Vector3d& end, Jacobian& twist) {
    const Arc arc(here.u, length);
    end = position + rotation * arc.position();
    for (int i = 0; derivatives && i < n; ++i) {
      const int index = parts.interval[k].section[i];
      if (index == Segmentation::kAbsent)
        continue;
      const Eigen::Vector3d du = bendByRotation(arm_.tubes[i].sections[index], here, turned[i]);
      add(twist, n + i, rotation * arc.positionDerivative(du), rotation * arc.rotationDerivative(du), end);
    }
    return Eigen::Matrix3d(rotation * arc.rotation());
  };
  Bend here = bend(parts.interval[0], turned);
  int k = 0;
  for (std::size_t i = 0; i < s.size(); ++i) {
    BackbonePoint& point = points[i];
    const double inside = std::min(s[i], parts.length());
    while (k + 1 < parts.count && inside > parts.interval[k].end) {
      const Segmentation::Interval& interval = parts.interval[k];
      Eigen::Vector3d end;
      rotation = bend_to(k, here, interval.end - interval.start, end, passed);
      position = end;
      const Bend behind = bend(parts.interval[++k], turned);
      add(passed, interval.owner, Eigen::Vector3d::Zero(), rotation * (here.u - behind.u), position);
      here = behind;
    }
    if (derivatives)
      here_too = passed;
    point.s = s[i];
    const Eigen::Matrix3d frame = bend_to(k, here, inside - parts.interval[k].start, point.position, here_too);
    if (derivatives && s[i] > inside)  // the boundary at the end, straight behind it
      add(here_too, parts.interval[k].owner, Eigen::Vector3d::Zero(), frame * here.u, point.position);
    point.tangent = frame.col(2);
    point.position += (s[i] - inside) * point.tangent;
    if (!derivatives)
      continue;
    point.jacobian.resize(3, 2 * n);
    for (int j = 0; j < 2 * n; ++j) {
      const Eigen::Vector3d angular = here_too.col(j).tail<3>();
      point.jacobian.col(j) = here_too.col(j).head<3>() + angular.cross(point.position);
    }
  }
  return ModelStatus::kOk;
}

}  // namespace tandem::kinematics
