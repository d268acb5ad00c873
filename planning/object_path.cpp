// SPDX-License-Identifier: Apache-2.0
#include "planning/object_path.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "kinematics/rotations.h"

namespace tandem::planning {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::array<const char*, 6> kDirections{"x", "y", "z", "rx", "ry", "rz"};
constexpr std::array<const char*, 3> kShapes{"line", "circle", "lissajous"};
constexpr std::array<const char*, 3> kKept{"none", "places", "all"};

/// @throw std::invalid_argument with the message if the name is not among them.
template <std::size_t N>
int indexOf(const std::array<const char*, N>& names, const std::string& name, const std::string& message) {
  const auto found = std::ranges::find(names, name);
  if (found == names.end())
    throw std::invalid_argument(message);
  return static_cast<int>(found - names.begin());
}

Eigen::Matrix3d turn(const Eigen::Vector3d& vector) {
  const double angle = vector.norm();
  return angle > 0.0 ? Eigen::AngleAxisd(angle, vector / angle).toRotationMatrix() : Eigen::Matrix3d::Identity();
}

}  // namespace

PathShape pathShape(const std::string& name) {
  return static_cast<PathShape>(
      indexOf(kShapes, name, "shape: found '" + name + "', expected line, circle or lissajous"));
}

std::string nameOf(PathShape shape) { return kShapes.at(static_cast<std::size_t>(shape)); }

Kept keptOf(const std::string& name) {
  return static_cast<Kept>(indexOf(kKept, name, "hold: found '" + name + "', expected none, places or all"));
}

std::string nameOf(Kept kept) { return kKept.at(static_cast<std::size_t>(kept)); }

int directionOf(const std::string& name) {
  return indexOf(kDirections, name, "direction: found '" + name + "', expected one of x, y, z, rx, ry, rz");
}

std::string directionName(int direction) { return kDirections.at(static_cast<std::size_t>(direction)); }

void ObjectPath::check() const {
  const std::size_t wanted = shape == PathShape::kLine ? 1 : 2;
  if (directions.size() != wanted || (wanted == 2 && directions[0] == directions[1])) {
    throw std::invalid_argument("directions: found " + std::to_string(directions.size()) + ", expected " +
                                (wanted == 1 ? "one for a line" : "two different ones for a circle or a lissajous"));
  }
  for (const auto& [value, what] : {std::pair{size, "size"}, {duration, "duration"}, {length, "length"}}) {
    if (!(value > 0.0) || !std::isfinite(value))
      throw std::invalid_argument(std::string(what) + ": found " + std::to_string(value) + ", expected more than 0");
  }
}

void ObjectPath::at(double time, Twist& displacement, Twist& rate) const {
  const double x = std::clamp(time / duration, 0.0, 1.0);
  const double p = x * x * x * (10.0 + x * (6.0 * x - 15.0));
  const double dp = 30.0 * x * x * (1.0 - x) * (1.0 - x) / duration;
  const double a = 2.0 * kPi * p, da = 2.0 * kPi * dp;
  std::array<double, 2> c{}, dc{};
  switch (shape) {
    case PathShape::kLine:
      c[0] = 0.5 * (1.0 - std::cos(a)), dc[0] = 0.5 * std::sin(a) * da;
      break;
    case PathShape::kCircle:
      c = {1.0 - std::cos(a), std::sin(a)};
      dc = {std::sin(a) * da, std::cos(a) * da};
      break;
    case PathShape::kLissajous:
      c = {std::sin(a), std::sin(2.0 * a)};
      dc = {std::cos(a) * da, 2.0 * std::cos(2.0 * a) * da};
      break;
  }
  displacement.setZero();
  rate.setZero();
  for (std::size_t k = 0; k < directions.size(); ++k) {
    const double amplitude = directions[k] < 3 ? size : size / length;
    displacement[directions[k]] = amplitude * c[k];
    rate[directions[k]] = amplitude * dc[k];
  }
  // From the rate of the rotation vector to angular velocity: the left Jacobian of the exponential.
  const Eigen::Vector3d vector = displacement.tail<3>(), change = rate.tail<3>();
  const double angle = vector.norm();
  if (angle > 1e-6) {
    const Eigen::Vector3d once = vector.cross(change), twice = vector.cross(once);
    rate.tail<3>() +=
        (1.0 - std::cos(angle)) / (angle * angle) * once + (angle - std::sin(angle)) / (angle * angle * angle) * twice;
  }
}

std::vector<int> ObjectPath::tracked() const {
  std::vector<int> rows;
  for (int k = 0; k < 6; ++k) {
    const bool is_kept = kept == Kept::kAll || (kept == Kept::kPosition && k < 3);
    if (is_kept || std::ranges::find(directions, k) != directions.end())
      rows.push_back(k);
  }
  return rows;
}

Eigen::Isometry3d displaced(const Eigen::Isometry3d& start, const Twist& displacement) {
  Eigen::Isometry3d pose = start;
  pose.translation() += displacement.head<3>();
  pose.linear() = turn(displacement.tail<3>()) * start.linear();
  return pose;
}

Twist difference(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to) {
  Twist twist;
  twist << to.translation() - from.translation(), kinematics::logarithm(to.linear() * from.linear().transpose());
  return twist;
}

}  // namespace tandem::planning
