// SPDX-License-Identifier: Apache-2.0
/** @file Messages of ROS 2 and CRTK, as far as Tandem uses them. Stamps are ns. */
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace tandem::dds {

struct Stamp {
  std::int64_t nanoseconds = 0;
};
/// sensor_msgs/JointState
struct JointState {
  std::int64_t stamp = 0;
  std::string frame;
  std::vector<std::string> name;
  std::vector<double> position, velocity, effort;
};
/// geometry_msgs/PoseStamped
struct PoseStamped {
  std::int64_t stamp = 0;
  std::string frame;
  std::array<double, 3> position{};
  std::array<double, 4> orientation{0, 0, 0, 1};
};
/// geometry_msgs/TwistStamped
struct TwistStamped {
  std::int64_t stamp = 0;
  std::string frame;
  std::array<double, 3> linear{};   ///< m/s
  std::array<double, 3> angular{};  ///< rad/s
};
/// std_msgs/Empty
struct Empty {
  std::uint8_t structure_needs_at_least_one_member = 0;  ///< as ROS 2 has it
};
/// std_msgs/Bool
struct Bool {
  bool data = false;
};
/// nav_msgs/Path (frame and positions)
struct Path {
  std::int64_t stamp = 0;
  std::string frame;
  std::vector<PoseStamped> poses;
};
/// crtk_msgs/OperatingState
struct OperatingState {
  std::int64_t stamp = 0;
  std::string frame;
  std::string state;
  bool is_homed = false;
  bool is_busy = false;
};
/// crtk_msgs/StringStamped
struct StringStamped {
  std::int64_t stamp = 0;
  std::string frame;
  std::string text;
};
/// diagnostic_msgs/DiagnosticArray
struct DiagnosticStatus {
  std::uint8_t level = 0;  ///< 0 ok, 1 warn, 2 error, 3 stale
  std::string name, message, hardware_id;
  std::vector<std::pair<std::string, std::string>> values;
};
struct DiagnosticArray {
  std::int64_t stamp = 0;
  std::string frame;
  std::vector<DiagnosticStatus> status;
};

}  // namespace tandem::dds
