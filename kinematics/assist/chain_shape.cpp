// SPDX-License-Identifier: Apache-2.0
#include "kinematics/assist/chain_shape.h"

#include <algorithm>
#include <limits>

namespace tandem::kinematics::assist {

using cosserat::RodPoint;
using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

namespace {

constexpr double kClosed = 1e-6;  // m: largest distance between the end of a rod and the contact

/// The target's proximal end as a rod from the clamp to the base of bending.
bool addProximal(const Pair& pair,
                 const Joints& q,
                 const ChainBranch& branch,
                 const Chain& chain,
                 const Isometry3d& bending_base,
                 ChainShape& shape,
                 int points) {
  cosserat::Rod rod = catheter::rodOf(pair.target);
  rod.sections.resize(1);
  rod.actuators.clear();
  rod.sections[0].length = q[0];
  cosserat::RodInput input(rod);
  input.base = pair.target.arm.base;
  input.first_length = q[0];
  const Vector3d lever = chain.contact.translation() - bending_base.translation();
  input.tip = chain.wrench;
  input.tip.tail<3>() += lever.cross(chain.wrench.head<3>());
  cosserat::RodBranch start{true, input.base.linear().transpose() * branch.target_moment, 0.0};
  const cosserat::RodModel model(rod);
  return model.shape(input, start, points, shape.target) == ModelStatus::kOk &&
         (shape.target.back().pose.translation() - bending_base.translation()).norm() < kClosed;
}

/// The target's distal end, an arc on the base of bending.
void addArc(const Pair& pair, const Joints& q, const Isometry3d& bending_base, ChainShape& shape, int points) {
  const Isometry3d rolled = bending_base * AngleAxisd(q[1], Vector3d::UnitZ());
  const double length = pair.target.arm.bending_length;
  for (int k = 1; k < points; ++k) {
    const double part = static_cast<double>(k) / (points - 1);
    catheter::Arm arm = pair.target.arm;
    arm.bending_length = part * length;
    arm.tool.setIdentity();
    RodPoint point;
    Vector6 by_bend;
    Isometry3d pose;
    catheter::ConstantCurvature::distal(arm, part * q[2], pose, by_bend);
    point.s = q[0] + arm.bending_length;
    point.pose = rolled * pose;
    point.curvature = q[2] / length * Vector3d::UnitY();
    shape.target.push_back(point);
  }
}

double strainOf(const catheter::ElasticArm& arm, double insertion, const std::vector<RodPoint>& points) {
  double strain = 0.0;
  for (const RodPoint& point : points) {
    const cosserat::Section& section = point.s <= insertion ? arm.proximal : arm.distal;
    strain = std::max(strain, section.outer_radius * point.curvature.head<2>().norm());
  }
  return strain;
}

}  // namespace

std::optional<ChainShape> shapeOf(const Pair& pair,
                                  const Joints& q,
                                  const ChainBranch& branch,
                                  const Chain& chain,
                                  int points) {
  ChainShape shape;
  const Isometry3d bending_base = chain.contact * pair.contact.inverse();
  if (!addProximal(pair, q, branch, chain, bending_base, shape, points))
    return {};
  addArc(pair, q, bending_base, shape, points);
  const Eigen::Matrix3d clamp = pair.assist.arm.base.linear() * AngleAxisd(q[4], Vector3d::UnitZ()).toRotationMatrix();
  cosserat::RodBranch start{true, clamp.transpose() * branch.assist_moment, branch.assist_pull};
  const catheter::ElasticCatheter model(pair.assist);
  if (model.shape(q.tail<3>(), -chain.wrench, start, points, shape.assist) != ModelStatus::kOk)
    return {};
  const Vector3d end = shape.assist.back().pose * pair.assist.arm.tool.translation();
  if ((end - chain.contact.translation()).norm() >= kClosed)
    return {};
  return shape;
}

double largestStrain(const Pair& pair, const Joints& q, const ChainShape& shape) {
  return std::max(strainOf(pair.target, q[0], shape.target), strainOf(pair.assist, q[3], shape.assist));
}

double leastAdvance(const Pair& pair, const ChainShape& shape) {
  double least = std::numeric_limits<double>::infinity();
  const auto add = [&least](const Isometry3d& base, const std::vector<RodPoint>& points) {
    const Isometry3d inverse = base.inverse();
    for (const RodPoint& point : points)
      least = std::min(least, (inverse * point.pose.translation()).z());
  };
  add(pair.target.arm.base, shape.target);
  add(pair.assist.arm.base, shape.assist);
  return least;
}

}  // namespace tandem::kinematics::assist
