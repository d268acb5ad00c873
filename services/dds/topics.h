// SPDX-License-Identifier: Apache-2.0
/** @file The table of all topics: name, type, quality of service, publisher.
 *
 * On the wire a topic is called rt/PREFIX/NAME, or rt/PREFIX/ARM/NAME for topics of one arm, and its type
 * PACKAGE::msg::dds_::TYPE_, as in ROS 2. A name that begins with a slash is absolute, without the prefix.
 * docs/topics.md shows the same table to users.
 */
#pragma once

#include <string>
#include <vector>

#include "services/dds/messages.h"

namespace tandem::dds {

/** Quality of service. All volatile unless said otherwise. */
enum class Profile {
  kPeriodic,  ///< best effort; writers keep 64, readers the latest one. In lock-step: reliable, readers keep 4096
  kCommand,   ///< as kPeriodic, plus exclusive ownership, deadline and liveliness; not in lock-step
  kReliable,  ///< reliable, keep last 64 (readers 10): requests, replies, and topics for ROS 2 clients
  kLatched,   ///< reliable, transient local, keep last 1: a late reader gets the last sample
};

/// Whether samples of the profile follow one another periodically, so that a reader may leave out all but the latest.
constexpr bool isStream(Profile profile) noexcept {
  return profile == Profile::kPeriodic || profile == Profile::kCommand;
}

/** Number of a topic's instances: one per robot, per arm, or per arm and one for the pair. */
enum class Of { kRobot, kArm, kArmAndPair };

/** One topic; `Message` is its message type. */
template <class M>
struct Topic {
  using Message = M;
  const char* name;             ///< below the prefix, or below the arm's name; absolute with a slash in front
  Profile profile;              ///< quality of service
  bool per_arm;                 ///< one topic per arm
  bool pair;                    ///< topics per arm: one more for the pair of arms, named kPair
  const char* publisher;        ///< publisher, a value of the table in roles.cpp
  const char* description;      ///< for people
  const char* type = M::kType;  ///< ROS 2 type name, e.g. "sensor_msgs/msg/JointState"
};

/// Replaces the arm's name in topics of the first two arms together.
inline constexpr const char* kPair = "pair";

#define TANDEM_TOPIC(CONSTANT, MESSAGE, PROFILE, OF, NAME, PUBLISHER, DESCRIPTION) \
  inline constexpr Topic<MESSAGE> CONSTANT{                                        \
      NAME, Profile::PROFILE, Of::OF != Of::kRobot, Of::OF == Of::kArmAndPair, PUBLISHER, DESCRIPTION};
#include "services/dds/topic_table.inc"
#undef TANDEM_TOPIC

/// Calls f(topic) with every Topic<M> of the table.
template <class F>
void forEachTopic(F&& f) {
#define TANDEM_TOPIC(CONSTANT, ...) f(CONSTANT);
#include "services/dds/topic_table.inc"
#undef TANDEM_TOPIC
}

/** A topic without its message type, for lists and look-ups at run time. */
struct TopicInfo {
  std::string name;         ///< below the prefix, with the arm's name if per arm: "arm_a/measured_js"
  std::string type;         ///< "sensor_msgs/msg/JointState"
  Profile profile;          ///< quality of service
  std::string arm;          ///< or kPair; empty for topics of the whole robot
  std::string publisher;    ///< publisher, a value of the table in roles.cpp
  std::string description;  ///< for people
};

/// All topics of a robot with these arms, in the order of the table; those of the pair if there are at least two arms.
std::vector<TopicInfo> allTopics(const std::vector<std::string>& arm_names);

/// "periodic", "command", "reliable" or "latched".
const char* name(Profile profile);

/// Name of a topic in ROS 2 and in files: "/PREFIX/NAME", or the name itself if it begins with a slash.
std::string rosTopicName(const std::string& prefix, const std::string& name);

/** Name of a topic in DDS: "rt/PREFIX/NAME", or "rt/PREFIX/ARM/NAME" with an arm; "rt" in front of an absolute name.
 * @throw std::invalid_argument for other characters than letters, digits and underscores in prefix or arm (the prefix
 * may have slashes between words). */
std::string ddsTopicName(const std::string& prefix, const std::string& name, const std::string& arm = "");

/// Name of a type in DDS: "sensor_msgs/msg/JointState" -> "sensor_msgs::msg::dds_::JointState_".
std::string ddsTypeName(const std::string& type);

}  // namespace tandem::dds
