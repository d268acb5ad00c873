// SPDX-License-Identifier: Apache-2.0
/** @file ROS 2 message definitions (`ros2msg`), for recordings and bridges. */
#pragma once

#include <string>

#include "services/dds/topics.h"

namespace tandem::dds {

/// Definition of a type, followed by those of its member types, in schema encoding `ros2msg`.
/// @param type "sensor_msgs/msg/JointState" @throw std::invalid_argument for an unknown type.
std::string messageDefinition(const std::string& type);

/// Quality of service of a topic's writers in the YAML of rosbag2 (`offered_qos_profiles`).
std::string offeredQos(Profile profile);

}  // namespace tandem::dds
