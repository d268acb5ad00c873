// SPDX-License-Identifier: Apache-2.0
#include "services/console/markers.h"

#include <algorithm>
#include <array>
#include <chrono>

#include "config/arm_names.h"
#include "robots/robot_type.h"
#include "services/console/grasped_object.h"
#include "services/console/palette.h"
#include "services/runtime/process.h"

namespace tandem::console {
namespace {

constexpr std::int32_t kCube = 1, kLineStrip = 4, kLineList = 5, kSphereList = 7;
constexpr std::int64_t kLifetime = 1'000'000'000;  // ns; several periods of the shapes
constexpr float kObjectOpacity = 0.6f;
constexpr double kTipAxis = 0.008, kTipWidth = 0.0006;  // m

std::array<double, 3> pointOf(const dds::Shape& shape, std::size_t i) {
  return {shape.points[3 * i], shape.points[3 * i + 1], shape.points[3 * i + 2]};
}

dds::Marker marker(const dds::Shape& shape, const MarkedArm& arm, std::int64_t stamp, std::size_t point) {
  dds::Marker marker;
  marker.stamp = stamp;
  marker.frame = shape.frame;
  marker.ns = arm.name;
  marker.lifetime = kLifetime;
  marker.color = rgba(tubeColor(arm.index, std::max<int>(shape.tubes[point], 1) - 1, arm.tubes));
  marker.scale = {2.0 * shape.outer_radius[point], 0.0, 0.0};
  return marker;
}

}  // namespace

dds::MarkerArray markersOf(const dds::Shape& shape, const MarkedArm& arm, std::int64_t stamp) {
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

dds::MarkerArray tipMarkersOf(const dds::PoseStamped& tip, const std::string& arm) {
  const auto& q = tip.orientation;
  const Eigen::Matrix3d axes = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
  dds::MarkerArray array;
  for (int axis = 0; axis < 3; ++axis) {
    dds::Marker line;
    line.stamp = tip.stamp;
    line.frame = tip.frame;
    line.ns = arm + "/tip";
    line.id = axis;
    line.type = kLineList;
    line.lifetime = kLifetime;
    line.color = {axis == 0 ? 1.0f : 0.0f, axis == 1 ? 1.0f : 0.0f, axis == 2 ? 1.0f : 0.0f, 1.0f};
    line.scale = {kTipWidth, 0.0, 0.0};
    const Eigen::Vector3d from = Eigen::Vector3d::Map(tip.position.data()), to = from + kTipAxis * axes.col(axis);
    line.points = {{from.x(), from.y(), from.z()}, {to.x(), to.y(), to.z()}};
    array.markers.push_back(std::move(line));
  }
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
  cube.color = rgba(objectColor(), kObjectOpacity);
  cube.scale.fill(object.size);
  const Eigen::Quaterniond turn(pose.linear());
  cube.position = {pose.translation().x(), pose.translation().y(), pose.translation().z()};
  cube.orientation = {turn.x(), turn.y(), turn.z(), turn.w()};
  return {{cube}};
}

Markers::Markers(dds::Bus& bus, const config::Robot& robot) : bus_(bus), writer_(bus.writer(dds::kMarkers)) {
  for (const std::string& name : config::armList(robot)) {
    const int index = static_cast<int>(arms_.size());
    arms_.push_back({name, index, static_cast<int>(robots::typeOf(robot).appearance(robot, index).tubes.size())});
  }
  if (const config::GraspedObject* object = robots::typeOf(robot).graspedObject(robot))
    object_ = *object;
}

void Markers::moved(std::size_t arm, const dds::PoseStamped& tip) {
  if (tip.stamp != 0)
    writer_.write(tipMarkersOf(tip, arms_[arm].name));
  if (object_ && arm < object_->contacts.size())
    moveObject(arm, tip);
}

/// The object's pose follows from its arms: published once per complete set of tip poses.
void Markers::moveObject(std::size_t arm, const dds::PoseStamped& tip) {
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
  if (!wanted)
    return;
  tips_.assign(object_ ? object_->contacts.size() : 0, std::nullopt);
  for (std::size_t k = 0; k < arms_.size(); ++k) {
    poses_.push_back(
        bus_.reader(dds::kMeasuredCp, arms_[k].name, [this, k](const dds::PoseStamped& tip) { moved(k, tip); }));
    shapes_.push_back(bus_.reader(dds::kShape, arms_[k].name, [this, k](const dds::Shape& shape) {
      writer_.write(markersOf(shape, arms_[k], shape.stamp));
    }));
  }
}

}  // namespace tandem::console
