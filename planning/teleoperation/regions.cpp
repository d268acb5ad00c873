// SPDX-License-Identifier: Apache-2.0
#include "planning/teleoperation/regions.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::planning::teleoperation {
namespace {

using Eigen::Vector3d;

double distanceTo(const Sphere& s, const Vector3d& p) noexcept { return (p - s.center).norm() - s.radius; }
double distanceTo(const HalfSpace& h, const Vector3d& p) noexcept { return h.normal.dot(p - h.point); }
double distanceTo(const Box& b, const Vector3d& p) noexcept {
  const Vector3d d = (b.minimum - p).cwiseMax(p - b.maximum);
  const double inside = d.maxCoeff();
  return inside <= 0.0 ? inside : d.cwiseMax(0.0).norm();
}

Vector3d outwardOf(const Sphere& s, const Vector3d& p) noexcept {
  const Vector3d d = p - s.center;
  const double norm = d.norm();
  return norm > 0.0 ? Vector3d(d / norm) : Vector3d::UnitX();
}
Vector3d outwardOf(const HalfSpace& h, const Vector3d&) noexcept { return h.normal; }
Vector3d outwardOf(const Box& b, const Vector3d& p) noexcept {
  const Vector3d below = b.minimum - p, above = p - b.maximum;
  const Vector3d d = below.cwiseMax(above);
  Eigen::Index axis = 0;
  if (d.maxCoeff(&axis) <= 0.0)
    return (above[axis] >= below[axis] ? 1.0 : -1.0) * Vector3d::Unit(axis);
  const Vector3d out = above.cwiseMax(0.0) - below.cwiseMax(0.0);
  return out.normalized();
}

}  // namespace

double distance(const ForbiddenRegion& region, const Vector3d& point) noexcept {
  return std::visit([&](const auto& shape) { return distanceTo(shape, point); }, region.shape);
}

Vector3d outward(const ForbiddenRegion& region, const Vector3d& point) noexcept {
  return std::visit([&](const auto& shape) { return outwardOf(shape, point); }, region.shape);
}

double nearestOnWay(const ForbiddenRegion& region, const Vector3d& from, const Vector3d& to) noexcept {
  // Ternary search on a convex function; 30 rounds leave an interval of 5e-6 of the line, which also bounds the error
  // of the distance.
  constexpr int kRounds = 30;
  double low = 0.0, high = 1.0;
  const Vector3d displacement = to - from;
  for (int i = 0; i < kRounds; ++i) {
    const double a = low + (high - low) / 3.0, b = high - (high - low) / 3.0;
    if (distance(region, from + a * displacement) < distance(region, from + b * displacement)) {
      high = b;
    } else {
      low = a;
    }
  }
  return std::min(
      {distance(region, from), distance(region, to), distance(region, from + 0.5 * (low + high) * displacement)});
}

Vector3d guided(const Guidance& guidance, const Vector3d& from, const Vector3d& d) noexcept {
  double nearest = std::numeric_limits<double>::infinity();
  Vector3d foot = from, along = Vector3d::Zero();
  for (std::size_t i = 0; i + 1 < guidance.points.size(); ++i) {
    const Vector3d piece = guidance.points[i + 1] - guidance.points[i];
    const double t = std::clamp(piece.dot(from - guidance.points[i]) / piece.squaredNorm(), 0.0, 1.0);
    const Vector3d place = guidance.points[i] + t * piece;
    if ((from - place).norm() < nearest) {
      nearest = (from - place).norm();
      foot = place;
      along = piece.normalized();
    }
  }
  if (!(nearest <= guidance.radius))
    return d;
  const Vector3d tangential = d.dot(along) * along;
  const Vector3d lateral = d - tangential;
  // Lateral motion towards the nearest point of the path is free, up to the path itself.
  const Vector3d back = foot - from;
  const double gap = back.norm();
  Vector3d free = Vector3d::Zero();
  if (gap > 0.0)
    free = std::clamp(lateral.dot(back) / gap, 0.0, gap) * (back / gap);
  return tangential + free + (1.0 - guidance.strength) * (lateral - free);
}

}  // namespace tandem::planning::teleoperation
