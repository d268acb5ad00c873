// SPDX-License-Identifier: Apache-2.0
/** @file What tools show: lines of logs, and bodies in space. Messages of ROS 2, member by member. */
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace tandem::dds {

/// rcl_interfaces/Log: a line of a service's log
struct Log {
  std::int64_t stamp = 0;  ///< ns since the epoch, wall clock of the service's host
  std::uint8_t level = 0;  ///< 10 debug, 20 info, 30 warn, 40 error, 50 fatal
  std::string name;        ///< of the service
  std::string text;
  std::string file, function;  ///< of the source; services leave them empty
  std::uint32_t line = 0;
};
/// visualization_msgs/Marker
struct Marker {
  std::int64_t stamp = 0;
  std::string frame;
  std::string group;  ///< with `id` the name of the marker
  std::int32_t id = 0;
  std::int32_t type = 0;    ///< 4 line strip, 7 sphere list
  std::int32_t action = 0;  ///< 0 add or change, 2 delete, 3 delete all
  std::array<double, 3> position{};
  std::array<double, 4> orientation{0, 0, 0, 1};
  std::array<double, 3> scale{};  ///< m; line strip: x is the width; sphere list: diameters
  std::array<float, 4> color{};   ///< r g b a, 0..1
  std::int64_t lifetime = 0;      ///< ns; 0: for ever
  bool frame_locked = false;
  std::vector<std::array<double, 3>> points;
  std::vector<std::array<float, 4>> colors;  ///< one per point, or none
  // What Tandem itself has no use for, so that nothing of others' markers is lost.
  std::string texture_resource;
  std::int64_t texture_stamp = 0;
  std::string texture_frame, texture_format;
  std::vector<std::uint8_t> texture;
  std::vector<std::array<float, 2>> texture_coordinates;
  std::string text, mesh_resource, mesh_name;
  std::vector<std::uint8_t> mesh;
  bool mesh_materials = false;
};
/// visualization_msgs/MarkerArray
struct MarkerArray {
  std::vector<Marker> markers;
};

}  // namespace tandem::dds
