// SPDX-License-Identifier: Apache-2.0
#include "services/dds/topics.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>

#include "services/dds/bus.h"
#include "services/dds/wire_detail.h"

namespace tandem::dds {
namespace {

TEST(Topics, EveryTopicOncePerRobotOrArm) {
  const auto topics = allTopics({"arm_a", "arm_b"});
  std::set<std::string> names;
  for (const TopicInfo& topic : topics) {
    EXPECT_TRUE(names.insert(topic.name).second) << topic.name;
    EXPECT_EQ(topic.name.rfind(topic.arm, 0), 0u);
    EXPECT_FALSE(topic.description.empty());
  }
  EXPECT_EQ(names.count("actuation/state"), 1u);
  EXPECT_EQ(names.count("arm_b/measured_cp"), 1u);
  std::size_t per_arm = 0, of_the_pair = 0;
  forEachTopic([&](const auto& topic) {
    per_arm += topic.per_arm ? 1 : 0;
    of_the_pair += topic.pair ? 1 : 0;
  });
  EXPECT_EQ(allTopics({}).size() + 2 * per_arm + of_the_pair, topics.size());
  EXPECT_EQ(names.count("pair/servo_cp"), 1u);
  EXPECT_EQ(names.count("pair/shape"), 0u);
  EXPECT_EQ(allTopics({"arm_a"}).size(), allTopics({}).size() + per_arm) << "one arm is no pair";
}

TEST(Topics, TypeNamesAreThoseOfTheGeneratedTypes) {
  forEachTopic([](const auto& topic) {
    using M = typename std::decay_t<decltype(topic)>::Message;
    EXPECT_EQ(ddsTypeName(topic.type), GuardedSupport<M>().getName()) << topic.name;
  });
}

TEST(Topics, DocumentedTopicsAreThoseOfTheTable) {
  std::ostringstream page;
  page << std::ifstream(TANDEM_DOCS "/topics.md").rdbuf();
  forEachTopic([&](const auto& topic) {
    const std::string line = std::string("\n| ") + (topic.per_arm ? "ARM/" : "") + topic.name + " | " + topic.type +
                             " | " + name(topic.profile) + " | " + topic.publisher + " | " + topic.description + " |\n";
    EXPECT_NE(page.str().find(line), std::string::npos) << "docs/topics.md: found no such line, add it:" << line;
  });
}

TEST(Topics, DdsNames) {
  EXPECT_EQ(ddsTopicName("tandem", "actuation/state"), "rt/tandem/actuation/state");
  EXPECT_EQ(ddsTopicName("lab_2/robot", "measured_js", "arm_a"), "rt/lab_2/robot/arm_a/measured_js");
  EXPECT_EQ(ddsTopicName("tandem", "/rosout"), "rt/rosout") << "an absolute name stands outside the prefix";
  EXPECT_EQ(rosTopicName("tandem", "arm_a/shape"), "/tandem/arm_a/shape");
  for (const char* bad : {"", "/x", "x/", "a b", "a//b", "ä", "1a"}) {
    EXPECT_THROW(ddsTopicName(bad, "stop"), std::invalid_argument) << bad;
  }
  EXPECT_THROW(ddsTopicName("tandem", "measured_js", "arm/a"), std::invalid_argument);
  EXPECT_EQ(ddsTypeName("sensor_msgs/msg/JointState"), "sensor_msgs::msg::dds_::JointState_");
  EXPECT_THROW(ddsTypeName("JointState"), std::invalid_argument);
}

/// The text of the exception that these options cause.
std::string refusal(void (*change)(BusOptions&)) {
  BusOptions options;
  change(options);
  try {
    Bus bus(options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(BusOptions, WrongOnesAreRefusedByName) {
  const auto contains = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  EXPECT_TRUE(contains(refusal([](BusOptions& o) { o.domain = 233; }), "233"));
  EXPECT_TRUE(contains(refusal([](BusOptions& o) { o.domain = -1; }), "-1"));
  EXPECT_TRUE(contains(refusal([](BusOptions& o) { o.prefix = "a b"; }), "a b"));
  EXPECT_TRUE(contains(refusal([](BusOptions& o) { o.interface_address = "localhost"; }), "localhost"));
  EXPECT_TRUE(contains(refusal([](BusOptions& o) { o.interface_address = "192.0.2.1"; }), "127.0.0.1"));
  EXPECT_TRUE(contains(refusal([](BusOptions& o) { o.peers = {"robot-2"}; }), "robot-2"));
  EXPECT_TRUE(contains(refusal([](BusOptions& o) { o.peers = {"192.0.2.1"}; }), "192.0.2.1"));
}

}  // namespace
}  // namespace tandem::dds
