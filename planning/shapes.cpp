// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "planning/detail/further_tasks.h"
#include "planning/trajectory.h"

namespace tandem::planning {
namespace {

using Polyline = std::vector<Eigen::Vector3d>;

/// Chords of a smooth curve: chord and arc differ by less than 1e-8 of the length.
constexpr int kChords = 20000;

struct Outline {
  const Eigen::Vector3d& start;

  Polyline operator()(const Rectangle& r) const {
    return {start, start + r.first, start + r.first + r.second, start + r.second, start};
  }
  Polyline operator()(const Line& line) const { return {start, start + line.displacement}; }
  Polyline operator()(const Waypoints& waypoints) const {
    Polyline line{start};
    for (const Eigen::Vector3d& point : waypoints.points)
      line.push_back(waypoints.absolute ? point : start + point);
    return line;
  }
  Polyline operator()(const Lissajous& l) const {
    Polyline line(kChords + 1);
    for (int i = 0; i <= kChords; ++i) {
      const double t = static_cast<double>(i) / kChords;
      for (int axis = 0; axis < 3; ++axis) {
        const double angle = 2.0 * std::numbers::pi * l.cycles[axis] * t + l.phase[axis];
        line[i][axis] = start[axis] + l.amplitude[axis] * (std::sin(angle) - std::sin(l.phase[axis]));
      }
    }
    return line;
  }
  Polyline operator()(const Circle& c) const {
    if (c.normal.norm() == 0.0)
      throw std::invalid_argument("circle: normal: found a vector of length 0, expected another");
    const Eigen::Vector3d normal = c.normal.normalized();
    const Eigen::Vector3d radius = -c.center_offset;
    if (std::abs(radius.dot(normal)) > 1e-9 * radius.norm()) {
      throw std::invalid_argument("circle: center_offset must lie in the plane of the circle (normal to `normal`)");
    }
    Polyline line(kChords + 1);
    for (int i = 0; i <= kChords; ++i) {
      const double angle = 2.0 * std::numbers::pi * c.turns * static_cast<double>(i) / kChords;
      line[i] = start + c.center_offset + Eigen::AngleAxisd(angle, normal) * radius;
    }
    return line;
  }
  Polyline operator()(const Insertion& insertion) const {
    if (insertion.tips.empty())
      throw std::invalid_argument(
          "insertion: found no joints, expected those at the start, from which its path follows");
    Polyline line{start};
    line.insert(line.end(), insertion.tips.begin(), insertion.tips.end());
    return line;
  }
};

/// `count` points after the first, evenly spaced along a polyline; all equal to the start if its length is zero.
Polyline resample(const Polyline& line, int count) {
  std::vector<double> length(line.size(), 0.0);
  for (std::size_t i = 1; i < line.size(); ++i)
    length[i] = length[i - 1] + (line[i] - line[i - 1]).norm();
  Polyline points;
  points.reserve(static_cast<std::size_t>(count));
  std::size_t segment = 1;
  for (int k = 1; k <= count; ++k) {
    if (k == count) {
      points.push_back(line.back());
      break;
    }
    const double s = length.back() * k / count;
    while (segment + 1 < line.size() && length[segment] < s)
      ++segment;
    const double piece = length[segment] - length[segment - 1];
    const double share = piece > 0.0 ? (s - length[segment - 1]) / piece : 0.0;
    points.push_back(line[segment - 1] + share * (line[segment] - line[segment - 1]));
  }
  return points;
}

double lengthOf(const Polyline& line) {
  double length = 0.0;
  for (std::size_t i = 1; i < line.size(); ++i)
    length += (line[i] - line[i - 1]).norm();
  return length;
}

}  // namespace

std::vector<TrajectoryPoint> sample(const TrajectorySpec& spec, const TrajectoryPoint& start) {
  if (spec.point_count < 1) {
    throw std::invalid_argument("trajectory '" + spec.name + "': found " + std::to_string(spec.point_count) +
                                " points, expected at least 1");
  }
  const Polyline tip = std::visit(Outline{start.tip}, spec.shape);
  if (!(lengthOf(tip) > 0.0))
    throw std::invalid_argument("trajectory '" + spec.name + "': found a shape of length 0 m, expected a longer one");
  const auto* insertion = std::get_if<Insertion>(&spec.shape);
  const bool given = insertion != nullptr && static_cast<int>(insertion->tips.size()) == spec.point_count;
  const Polyline tips = given ? insertion->tips : resample(tip, spec.point_count);
  Polyline relatives(tips.size(), start.relative);
  if (!spec.relative.empty()) {
    relatives = resample(std::visit(Outline{start.relative}, spec.relative.front()), spec.point_count);
  }
  std::vector<TrajectoryPoint> points;
  points.reserve(tips.size());
  for (std::size_t i = 0; i < tips.size(); ++i) {
    if (!tips[i].allFinite() || !relatives[i].allFinite()) {
      throw std::invalid_argument("trajectory '" + spec.name + "': found a point that is not finite, number " +
                                  std::to_string(i) + ", expected finite coordinates");
    }
    points.push_back({tips[i], relatives[i]});
  }
  setFurther(spec, start, points);
  return points;
}

}  // namespace tandem::planning
