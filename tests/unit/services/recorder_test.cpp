// SPDX-License-Identifier: Apache-2.0
/** @file Recorded topics, permitted replays, and triggers of the black box. */
#include <gtest/gtest.h>

#include <set>
#include <stdexcept>

#include "config/robot_files.h"
#include "idl/version.h"
#include "safety/operating_state.h"
#include "services/dds/raw.h"
#include "services/recorder/fault_trigger.h"
#include "services/recordings/hal_watch.h"
#include "services/recordings/run_file.h"

namespace tandem::recorder {
namespace {

TEST(RunFile, ContainsTheWireVersion) {
  const config::Deployment deployment =
      config::loadDeployment(std::string(TANDEM_PRESETS) + "/deployments/laptop.yaml");
  const std::string wire =
      recordings::describeRun(deployment, config::loadAnyRobot(deployment.robot)).values.at("wire");
  EXPECT_EQ(wire.size(), 16u);
  EXPECT_EQ(std::stoull(wire, nullptr, 16), idl::kWireVersion);
}

TEST(Replay, ListsTheTopicsThatActOnARobot) {
  const std::set<std::string> shown{"planning/reply",        "planning/progress", "planning/result",
                                    "planning/path",         "planning/summary",  "control/clearance",
                                    "control/permissions",   "control/reply",     "teleop/status",
                                    "crtk/status",           "sim/reply",         "hal/reply",
                                    "clock/reply",           "diagnostics",       "arm_a/measured_js",
                                    "arm_a/measured_cp",     "arm_a/measured_cv", "arm_a/setpoint_js",
                                    "arm_a/setpoint_cp",     "arm_a/setpoint_cv", "arm_a/goal_js",
                                    "arm_a/goal_cp",         "arm_a/goal_cv",     "arm_a/shape",
                                    "arm_a/operating_state", "/rosout",           "markers"};
  std::set<std::string> found;
  for (const dds::TopicInfo& topic : dds::allTopics({"arm_a"})) {
    if (!recordings::actedUpon(topic))
      found.insert(topic.name);
  }
  EXPECT_EQ(found, shown) << "a new topic: does anything that moves act upon it?";
}

TEST(RecordedTopics, AreChosenByPatterns) {
  const auto all = dds::allTopics({"arm_a", "arm_b"});
  EXPECT_EQ(recordings::chooseTopics(all, {"*"}).size(), all.size());
  std::set<std::string> names;
  for (const dds::TopicInfo& topic : recordings::chooseTopics(all, {"arm_*/measured_*", "stop", "stop"}))
    names.insert(topic.name);
  EXPECT_EQ(names, (std::set<std::string>{"arm_a/measured_js", "arm_a/measured_cp", "arm_a/measured_cv",
                                          "arm_b/measured_js", "arm_b/measured_cp", "arm_b/measured_cv", "stop"}));
  EXPECT_THROW(recordings::chooseTopics(all, {"stop", "stopp"}), std::invalid_argument);
}

class Trigger : public ::testing::Test {
 protected:
  std::optional<std::string> state(safety::OperatingState operating, safety::FaultMask faults) {
    dds::ActuationState message;
    message.arm_count = 2;
    message.operating_state = {1, static_cast<std::uint8_t>(operating)};
    message.faults = {0, faults};
    return trigger_.eventOf("actuation/state", dds::encode(message));
  }
  config::Robot robot_ = config::loadRobot(std::string(TANDEM_PRESETS) + "/robots/ark2024.yaml");
  FaultTrigger trigger_{robot_};
};

TEST_F(Trigger, EveryNewFaultOnce) {
  using enum safety::OperatingState;
  const safety::FaultMask drive = safety::bit(safety::Fault::kDrive), stop = safety::bit(safety::Fault::kStopRequested);
  EXPECT_FALSE(state(kFault, drive)) << "it stood before";
  EXPECT_FALSE(state(kFault, drive));
  EXPECT_EQ(state(kFault, drive | stop), "arm_b: drives in FAULT: drive, stop_requested");
  EXPECT_FALSE(state(kFault, drive | stop));
  EXPECT_FALSE(state(kDisabled, 0));
  EXPECT_FALSE(state(kEnabled, 0));
  EXPECT_EQ(state(kFault, drive), "arm_b: drives in FAULT: drive");
}

TEST_F(Trigger, StopsAndNothingElse) {
  EXPECT_EQ(trigger_.eventOf("stop", dds::encode(dds::Stop{1, 1, "smoke"})), "stop: smoke");
  EXPECT_FALSE(trigger_.eventOf("planning/request", dds::encode(dds::PlanningRequest{})));
  EXPECT_FALSE(trigger_.eventOf("actuation/state", "garbage"));
}

}  // namespace
}  // namespace tandem::recorder
