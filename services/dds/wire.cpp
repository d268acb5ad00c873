// SPDX-License-Identifier: Apache-2.0
#include <exception>

#include "services/dds/validate.h"
#include "services/dds/wire_detail.h"

namespace tandem::dds {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

/// A Time or a Duration.
template <class T>
void setTime(std::int64_t stamp, T& time) {
  // Rounds toward minus infinity: nanosec is unsigned.
  const std::int64_t remainder = (stamp % kSecond + kSecond) % kSecond;
  time.sec(static_cast<std::int32_t>((stamp - remainder) / kSecond));
  time.nanosec(static_cast<std::uint32_t>(remainder));
}

template <class T>
std::int64_t timeOf(const T& time) {
  return time.sec() * kSecond + time.nanosec();
}

void setHeader(std::int64_t stamp, const std::string& frame, ::std_msgs::msg::Header& header) {
  setTime(stamp, header.stamp());
  header.frame_id(frame);
}

template <class M>
void takeHeader(const ::std_msgs::msg::Header& header, M& message) {
  message.stamp = timeOf(header.stamp());
  message.frame = header.frame_id();
}

void setPose(const std::array<double, 3>& place, const std::array<double, 4>& turn, ::geometry_msgs::msg::Pose& pose) {
  auto& position = pose.position();
  auto& orientation = pose.orientation();
  position.x(place[0]);
  position.y(place[1]);
  position.z(place[2]);
  orientation.x(turn[0]);
  orientation.y(turn[1]);
  orientation.z(turn[2]);
  orientation.w(turn[3]);
}

template <class M>
void takePose(const ::geometry_msgs::msg::Pose& pose, M& message) {
  const auto& position = pose.position();
  const auto& orientation = pose.orientation();
  message.position = {position.x(), position.y(), position.z()};
  message.orientation = {orientation.x(), orientation.y(), orientation.z(), orientation.w()};
}

void setColor(const std::array<float, 4>& color, ::std_msgs::msg::ColorRGBA& wire) {
  wire.r(color[0]);
  wire.g(color[1]);
  wire.b(color[2]);
  wire.a(color[3]);
}

std::array<float, 4> colorOf(const ::std_msgs::msg::ColorRGBA& wire) {
  return {wire.r(), wire.g(), wire.b(), wire.a()};
}

void setMarker(const Marker& marker, ::visualization_msgs::msg::Marker& wire) {
  setHeader(marker.stamp, marker.frame, wire.header());
  wire.ns(marker.group);
  wire.id(marker.id);
  wire.type(marker.type);
  wire.action(marker.action);
  setPose(marker.position, marker.orientation, wire.pose());
  wire.scale().x(marker.scale[0]);
  wire.scale().y(marker.scale[1]);
  wire.scale().z(marker.scale[2]);
  setColor(marker.color, wire.color());
  wire.points().resize(marker.points.size());
  for (std::size_t i = 0; i < marker.points.size(); ++i) {
    wire.points()[i].x(marker.points[i][0]);
    wire.points()[i].y(marker.points[i][1]);
    wire.points()[i].z(marker.points[i][2]);
  }
  wire.colors().resize(marker.colors.size());
  for (std::size_t i = 0; i < marker.colors.size(); ++i)
    setColor(marker.colors[i], wire.colors()[i]);
  setTime(marker.lifetime, wire.lifetime());
  wire.frame_locked(marker.frame_locked);
  wire.texture_resource(marker.texture_resource);
  setHeader(marker.texture_stamp, marker.texture_frame, wire.texture().header());
  wire.texture().format(marker.texture_format);
  wire.texture().data(marker.texture);
  wire.uv_coordinates().resize(marker.texture_coordinates.size());
  for (std::size_t i = 0; i < marker.texture_coordinates.size(); ++i) {
    wire.uv_coordinates()[i].u(marker.texture_coordinates[i][0]);
    wire.uv_coordinates()[i].v(marker.texture_coordinates[i][1]);
  }
  wire.text(marker.text);
  wire.mesh_resource(marker.mesh_resource);
  wire.mesh_file().filename(marker.mesh_name);
  wire.mesh_file().data(marker.mesh);
  wire.mesh_use_embedded_materials(marker.mesh_materials);
}

void takeMarker(const ::visualization_msgs::msg::Marker& from, Marker& to) {
  takeHeader(from.header(), to);
  to.group = from.ns();
  to.id = from.id();
  to.type = from.type();
  to.action = from.action();
  takePose(from.pose(), to);
  to.scale = {from.scale().x(), from.scale().y(), from.scale().z()};
  to.color = colorOf(from.color());
  for (const auto& point : from.points())
    to.points.push_back({point.x(), point.y(), point.z()});
  for (const auto& color : from.colors())
    to.colors.push_back(colorOf(color));
  to.lifetime = timeOf(from.lifetime());
  to.frame_locked = from.frame_locked();
  to.texture_resource = from.texture_resource();
  to.texture_stamp = timeOf(from.texture().header().stamp());
  to.texture_frame = from.texture().header().frame_id();
  to.texture_format = from.texture().format();
  to.texture = from.texture().data();
  for (const auto& place : from.uv_coordinates())
    to.texture_coordinates.push_back({place.u(), place.v()});
  to.text = from.text();
  to.mesh_resource = from.mesh_resource();
  to.mesh_name = from.mesh_file().filename();
  to.mesh = from.mesh_file().data();
  to.mesh_materials = from.mesh_use_embedded_materials();
}

}  // namespace

void toWire(const JointState& message, ::sensor_msgs::msg::JointState& wire) {
  setHeader(message.stamp, message.frame, wire.header());
  wire.name(message.name);
  wire.position(message.position);
  wire.velocity(message.velocity);
  wire.effort(message.effort);
}

void fromWire(::sensor_msgs::msg::JointState& wire, JointState& message) {
  takeHeader(wire.header(), message);
  message.name = wire.name();
  message.position = wire.position();
  message.velocity = wire.velocity();
  message.effort = wire.effort();
}

void toWire(const PoseStamped& message, ::geometry_msgs::msg::PoseStamped& wire) {
  setHeader(message.stamp, message.frame, wire.header());
  setPose(message.position, message.orientation, wire.pose());
}

void fromWire(::geometry_msgs::msg::PoseStamped& wire, PoseStamped& message) {
  takeHeader(wire.header(), message);
  takePose(wire.pose(), message);
}

void toWire(const TwistStamped& message, ::geometry_msgs::msg::TwistStamped& wire) {
  setHeader(message.stamp, message.frame, wire.header());
  const auto set = [](const std::array<double, 3>& from, ::geometry_msgs::msg::Vector3& to) {
    to.x(from[0]);
    to.y(from[1]);
    to.z(from[2]);
  };
  set(message.linear, wire.twist().linear());
  set(message.angular, wire.twist().angular());
}

void fromWire(::geometry_msgs::msg::TwistStamped& wire, TwistStamped& message) {
  takeHeader(wire.header(), message);
  const auto& linear = wire.twist().linear();
  const auto& angular = wire.twist().angular();
  message.linear = {linear.x(), linear.y(), linear.z()};
  message.angular = {angular.x(), angular.y(), angular.z()};
}

void toWire(const Path& message, ::nav_msgs::msg::Path& wire) {
  setHeader(message.stamp, message.frame, wire.header());
  wire.poses().resize(message.poses.size());
  for (std::size_t i = 0; i < message.poses.size(); ++i) {
    toWire(message.poses[i], wire.poses()[i]);
  }
}

void fromWire(::nav_msgs::msg::Path& wire, Path& message) {
  takeHeader(wire.header(), message);
  message.poses.resize(wire.poses().size());
  for (std::size_t i = 0; i < message.poses.size(); ++i) {
    fromWire(wire.poses()[i], message.poses[i]);
  }
}

void toWire(const OperatingState& message, ::crtk_msgs::msg::OperatingState& wire) {
  setHeader(message.stamp, message.frame, wire.header());
  wire.state(message.state);
  wire.is_homed(message.is_homed);
  wire.is_busy(message.is_busy);
}

void fromWire(::crtk_msgs::msg::OperatingState& wire, OperatingState& message) {
  takeHeader(wire.header(), message);
  message.state = wire.state();
  message.is_homed = wire.is_homed();
  message.is_busy = wire.is_busy();
}

void toWire(const StringStamped& message, ::crtk_msgs::msg::StringStamped& wire) {
  setHeader(message.stamp, message.frame, wire.header());
  wire.string(message.text);
}

void fromWire(::crtk_msgs::msg::StringStamped& wire, StringStamped& message) {
  takeHeader(wire.header(), message);
  message.text = wire.string();
}

void toWire(const DiagnosticArray& message, ::diagnostic_msgs::msg::DiagnosticArray& wire) {
  setHeader(message.stamp, message.frame, wire.header());
  wire.status().resize(message.status.size());
  for (std::size_t i = 0; i < message.status.size(); ++i) {
    const DiagnosticStatus& from = message.status[i];
    auto& to = wire.status()[i];
    to.level(from.level);
    to.name(from.name);
    to.message(from.message);
    to.hardware_id(from.hardware_id);
    to.values().resize(from.values.size());
    for (std::size_t k = 0; k < from.values.size(); ++k) {
      to.values()[k].key(from.values[k].first);
      to.values()[k].value(from.values[k].second);
    }
  }
}

void fromWire(::diagnostic_msgs::msg::DiagnosticArray& wire, DiagnosticArray& message) {
  takeHeader(wire.header(), message);
  message.status.clear();
  for (const auto& from : wire.status()) {
    DiagnosticStatus to{from.level(), from.name(), from.message(), from.hardware_id(), {}};
    for (const auto& pair : from.values()) {
      to.values.emplace_back(pair.key(), pair.value());
    }
    message.status.push_back(std::move(to));
  }
}

void toWire(const Log& message, ::rcl_interfaces::msg::Log& wire) {
  setTime(message.stamp, wire.stamp());
  wire.level(message.level);
  wire.name(message.name);
  wire.msg(message.text);
  wire.file(message.file);
  wire.function(message.function);
  wire.line(message.line);
}

void fromWire(::rcl_interfaces::msg::Log& wire, Log& message) {
  message.stamp = timeOf(wire.stamp());
  message.level = wire.level();
  message.name = wire.name();
  message.text = wire.msg();
  message.file = wire.file();
  message.function = wire.function();
  message.line = wire.line();
}

void toWire(const MarkerArray& message, ::visualization_msgs::msg::MarkerArray& wire) {
  wire.markers().resize(message.markers.size());
  for (std::size_t i = 0; i < message.markers.size(); ++i)
    setMarker(message.markers[i], wire.markers()[i]);
}

void fromWire(::visualization_msgs::msg::MarkerArray& wire, MarkerArray& message) {
  message.markers.clear();
  for (const auto& marker : wire.markers())
    takeMarker(marker, message.markers.emplace_back());
}

template <class M>
bool GuardedSupport<M>::deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) {
  auto* sample = static_cast<Sample<M>*>(static_cast<Generated*>(data));
  sample->decoded = false;
  if (payload->length > kMaxPayload) {
    return true;
  }
  try {
    sample->decoded = Wire<M>::Support::deserialize(payload, data);
  } catch (const std::exception&) {
    // Fast CDR throws on bytes that do not decode; the reader counts the sample as malformed.
    sample->decoded = false;
  }
  return true;
}

#define TANDEM_INSTANTIATE(M) template class GuardedSupport<M>;
TANDEM_EACH_MESSAGE(TANDEM_INSTANTIATE)
#undef TANDEM_INSTANTIATE

}  // namespace tandem::dds
