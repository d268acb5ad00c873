// SPDX-License-Identifier: Apache-2.0
#include <exception>

#include "services/dds/validate.h"
#include "services/dds/wire_detail.h"

namespace tandem::dds {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

void setHeader(std::int64_t stamp, const std::string& frame, ::std_msgs::msg::Header& header) {
  // Rounds toward minus infinity: nanosec is unsigned.
  const std::int64_t remainder = (stamp % kSecond + kSecond) % kSecond;
  header.stamp().sec(static_cast<std::int32_t>((stamp - remainder) / kSecond));
  header.stamp().nanosec(static_cast<std::uint32_t>(remainder));
  header.frame_id(frame);
}

template <class M>
void takeHeader(const ::std_msgs::msg::Header& header, M& message) {
  message.stamp = header.stamp().sec() * kSecond + header.stamp().nanosec();
  message.frame = header.frame_id();
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
  auto& position = wire.pose().position();
  auto& orientation = wire.pose().orientation();
  position.x(message.position[0]);
  position.y(message.position[1]);
  position.z(message.position[2]);
  orientation.x(message.orientation[0]);
  orientation.y(message.orientation[1]);
  orientation.z(message.orientation[2]);
  orientation.w(message.orientation[3]);
}

void fromWire(::geometry_msgs::msg::PoseStamped& wire, PoseStamped& message) {
  takeHeader(wire.header(), message);
  const auto& position = wire.pose().position();
  const auto& orientation = wire.pose().orientation();
  message.position = {position.x(), position.y(), position.z()};
  message.orientation = {orientation.x(), orientation.y(), orientation.z(), orientation.w()};
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
