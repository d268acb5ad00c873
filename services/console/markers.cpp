// SPDX-License-Identifier: Apache-2.0
#include "services/console/markers.h"

#include <algorithm>
#include <array>
#include <chrono>

#include "config/arm_names.h"
#include "robots/robot_type.h"
#include "services/console/grasped_object.h"
#include "services/runtime/process.h"

namespace tandem::console {
namespace {

constexpr std::int32_t kCube = 1, kLineStrip = 4, kSphereList = 7;
constexpr std::int64_t kLifetime = 1'000'000'000;  // ns; several periods of the shapes
/// Palette of Okabe and Ito, distinguishable by colour-blind people; tube 1 is the innermost.
constexpr std::array<std::array<float, 4>, 4> kColors{{{0.90f, 0.62f, 0.00f, 1.0f},
                                                       {0.34f, 0.71f, 0.91f, 1.0f},
                                                       {0.00f, 0.62f, 0.45f, 1.0f},
                                                       {0.80f, 0.47f, 0.65f, 1.0f}}};
constexpr std::array<float, 4> kObjectColor{0.75f, 0.75f, 0.75f, 0.6f};

std::array<double, 3> pointOf(const dds::Shape& shape, std::size_t i) {
  return {shape.points[3 * i], shape.points[3 * i + 1], shape.points[3 * i + 2]};
}

dds::Marker marker(const dds::Shape& shape, const std::string& arm, std::int64_t stamp, std::size_t point) {
  dds::Marker marker;
  marker.stamp = stamp;
  marker.frame = shape.frame;
  marker.ns = arm;
  marker.lifetime = kLifetime;
  marker.color = kColors[(std::max<std::size_t>(shape.tubes[point], 1) - 1) % kColors.size()];
  marker.scale = {2.0 * shape.outer_radius[point], 0.0, 0.0};
  return marker;
}

}  // namespace

dds::MarkerArray markersOf(const dds::Shape& shape, const std::string& arm, std::int64_t stamp) {
  dds::MarkerArray array;
  const std::size_t count = shape.tubes.size();
  if (count == 0)
    return array;
  for (std::size_t i = 0; i < count; ++i) {
    if (i == 0 || shape.tubes[i] != shape.tubes[i - 1]) {
      dds::Marker line = marker(shape, arm, stamp, i);
      line.id = static_cast<std::int32_t>(array.markers.size());
      line.type = kLineStrip;
      // Segments are connected: each begins at the end of the previous one.
      if (i > 0)
        line.points.push_back(pointOf(shape, i - 1));
      array.markers.push_back(std::move(line));
    }
    array.markers.back().points.push_back(pointOf(shape, i));
  }
  dds::Marker tip = marker(shape, arm, stamp, count - 1);
  tip.id = static_cast<std::int32_t>(array.markers.size());
  tip.type = kSphereList;
  tip.scale.fill(3.0 * shape.outer_radius[count - 1]);
  tip.points.push_back(pointOf(shape, count - 1));
  array.markers.push_back(std::move(tip));
  return array;
}

dds::MarkerArray markersOf(const config::GraspedObject& object,
                           const Eigen::Isometry3d& pose,
                           const std::string& frame,
                           std::int64_t stamp) {
  dds::Marker cube;
  cube.stamp = stamp;
  cube.frame = frame;
  cube.ns = "object";
  cube.type = kCube;
  cube.lifetime = kLifetime;
  cube.color = kObjectColor;
  cube.scale.fill(object.size);
  const Eigen::Quaterniond turn(pose.linear());
  cube.position = {pose.translation().x(), pose.translation().y(), pose.translation().z()};
  cube.orientation = {turn.x(), turn.y(), turn.z(), turn.w()};
  return {{cube}};
}

Markers::Markers(dds::Bus& bus, const config::Robot& robot)
    : bus_(bus), arms_(config::armList(robot)), writer_(bus.writer(dds::kMarkers)) {
  if (const config::GraspedObject* object = robots::typeOf(robot).graspedObject(robot))
    object_ = *object;
}

/// The object's pose follows from its arms: published once per complete set of tip poses.
void Markers::moved(std::size_t arm, const dds::PoseStamped& tip) {
  const std::lock_guard lock(mutex_);
  const auto& q = tip.orientation;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d::Map(tip.position.data());
  pose.linear() = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
  tips_[arm] = tip.stamp != 0 ? std::optional(pose) : std::nullopt;
  std::vector<Eigen::Isometry3d> tips;
  for (const auto& known : tips_) {
    if (!known)
      return;
    tips.push_back(*known);
  }
  if (arm + 1 == tips_.size())
    writer_.write(markersOf(*object_, objectPose(*object_, tips), tip.frame, tip.stamp));
}

void Markers::look() {
  const bool wanted = writer_.matched() > 0;
  if (wanted == active())
    return;
  shapes_.clear();
  poses_.clear();
  if (wanted && object_) {
    tips_.assign(object_->contacts.size(), std::nullopt);
    for (std::size_t k = 0; k < tips_.size(); ++k)
      poses_.push_back(
          bus_.reader(dds::kMeasuredCp, arms_[k], [this, k](const dds::PoseStamped& tip) { moved(k, tip); }));
  }
  for (const std::string& arm : wanted ? arms_ : std::vector<std::string>{})
    shapes_.push_back(bus_.reader(
        dds::kShape, arm, [this, arm](const dds::Shape& shape) { writer_.write(markersOf(shape, arm, shape.stamp)); }));
}

}  // namespace tandem::console
