// SPDX-License-Identifier: Apache-2.0
#include "kinematics/assist/reach.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "kinematics/assist/chain_shape.h"

namespace tandem::kinematics::assist {

using Eigen::Vector3d;

namespace {

/// The tip alone at insertion 0 as a function of the bend: distance from the axis and place along it.
Eigen::Vector2d meridian(const catheter::Arm& target, double bend) {
  Eigen::Isometry3d pose;
  Vector6 by_bend;
  catheter::ConstantCurvature::distal(target, bend, pose, by_bend);
  return {pose.translation().head<2>().norm(), pose.translation().z()};
}

/// Cell of a place.
std::array<std::int64_t, 3> cellOf(const Vector3d& place, double cell) {
  std::array<std::int64_t, 3> index{};
  for (int k = 0; k < 3; ++k)
    index[static_cast<std::size_t>(k)] = static_cast<std::int64_t>(std::floor(place[k] / cell));
  return index;
}

}  // namespace

double distanceBeyondReach(const catheter::Arm& target, const Range& range, const Vector3d& place) {
  const Vector3d local = target.base.inverse() * place;
  const double radius = local.head<2>().norm();
  const auto distance = [&](double bend) {
    const Eigen::Vector2d tip = meridian(target, bend);
    const double along = local.z() - tip.y();
    return std::hypot(radius - tip.x(), along - std::clamp(along, range.lower[0], range.upper[0]));
  };
  // Along the bend the distance has several minima: each that a grid shows is narrowed down.
  constexpr int kGrid = 256;
  const double step = (range.upper[2] - range.lower[2]) / kGrid;
  const auto at = [&](int k) { return range.lower[2] + step * k; };
  std::array<double, kGrid + 1> value{};
  for (int k = 0; k <= kGrid; ++k)
    value[static_cast<std::size_t>(k)] = distance(at(k));
  double best = *std::min_element(value.begin(), value.end());
  for (int k = 0; k <= kGrid && best > 0.0; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if ((k > 0 && value[i - 1] < value[i]) || (k < kGrid && value[i + 1] < value[i]))
      continue;
    double left = at(std::max(k - 1, 0)), right = at(std::min(k + 1, kGrid));
    constexpr double kGolden = 0.6180339887498949;
    while (right - left > 1e-11) {
      const double a = right - kGolden * (right - left), b = left + kGolden * (right - left);
      (distance(a) < distance(b) ? right : left) = distance(a) < distance(b) ? b : a;
    }
    best = std::min(best, distance(0.5 * (left + right)));
  }
  return best < 1e-9 ? 0.0 : best;
}

Joints jointsOf(const Range& range, std::uint64_t index, std::uint64_t seed) {
  double ratio = 1.1;  // the root of x^7 = x + 1
  for (int k = 0; k < 64; ++k)
    ratio = std::pow(1.0 + ratio, 1.0 / (kJoints + 1));
  Joints q;
  double power = 1.0, shift = std::fmod(static_cast<double>(seed % 65536) * 0.6180339887498949, 1.0);
  for (int k = 0; k < kJoints; ++k) {
    power /= ratio;
    const double part = std::fmod(shift + 0.5 + static_cast<double>(index + 1) * power, 1.0);
    q[k] = range.lower[k] + part * (range.upper[k] - range.lower[k]);
  }
  return q;
}

Reach reachAt(const TargetAssist& model, const Range& range, const Joints& q) {
  Reach reach;
  ChainBranch branch;
  Chain chain;
  reach.status = model.solve(q, branch, chain);
  if (reach.status != Status::kOk)
    return reach;
  constexpr int kPoints = 40;
  const auto shape = shapeOf(model.pair(), q, branch, chain, kPoints);
  if (!shape) {
    reach.status = Status::kNotConverged;
    return reach;
  }
  const catheter::Arm& target = model.pair().target.arm;
  reach.assisted = chain.tip.pose.translation();
  reach.beyond = distanceBeyondReach(target, range, reach.assisted);
  reach.force = chain.wrench.head<3>().norm();
  reach.strain = largestStrain(model.pair(), q, *shape);
  reach.advance = std::min(leastAdvance(model.pair(), *shape), (target.base.inverse() * reach.assisted).z());
  return reach;
}

std::string_view exclusionOf(const Reach& reach, const ReachBounds& bounds) {
  constexpr double kRounding = -1e-9;  // m: the first cross-section lies in the plane
  if (reach.status != Status::kOk)
    return describe(reach.status);
  if (reach.advance < kRounding)
    return "a part of an arm would be behind its entry plane";
  if (reach.force > bounds.force)
    return "the force between the arms exceeds its bound";
  return reach.strain > bounds.strain ? "the bending strain exceeds its bound" : "";
}

ReachVolume reachVolume(const catheter::Arm& target,
                        const Range& range,
                        std::span<const Reach> samples,
                        const ReachBounds& bounds,
                        double cell) {
  ReachVolume volume;
  std::set<std::array<std::int64_t, 3>> cells;
  const double half_diagonal = 0.5 * std::sqrt(3.0) * cell, one = cell * cell * cell;
  for (const Reach& reach : samples) {
    if (!exclusionOf(reach, bounds).empty())
      continue;
    ++volume.counted;
    volume.farthest = std::max(volume.farthest, reach.beyond);
    const auto index = cellOf(reach.assisted, cell);
    if (!cells.insert(index).second)
      continue;
    volume.assisted += one;
    const auto middle = [&index](std::size_t k) { return static_cast<double>(index[k]) + 0.5; };
    const Vector3d centre = cell * Vector3d(middle(0), middle(1), middle(2));
    if (distanceBeyondReach(target, range, centre) > half_diagonal)
      volume.gained += one;
  }
  return volume;
}

double volumeAlone(const catheter::Arm& target, const Range& range, double cell) {
  Eigen::Isometry3d pose;
  Vector6 by_bend;
  double reach = 0.0;
  for (int k = 0; k <= 64; ++k) {
    const double bend = range.lower[2] + k / 64.0 * (range.upper[2] - range.lower[2]);
    catheter::ConstantCurvature::distal(target, bend, pose, by_bend);
    reach = std::max(reach, pose.translation().norm());
  }
  double volume = 0.0;
  for (double z = range.lower[0] - reach; z < range.upper[0] + reach; z += cell) {
    for (double inner = 0.0; inner < reach + cell; inner += cell) {
      const Vector3d centre(inner + 0.5 * cell, 0.0, z + 0.5 * cell);
      if (distanceBeyondReach(target, range, target.base * centre) == 0.0)
        volume += std::numbers::pi * ((inner + cell) * (inner + cell) - inner * inner) * cell;
    }
  }
  return volume;
}

}  // namespace tandem::kinematics::assist
