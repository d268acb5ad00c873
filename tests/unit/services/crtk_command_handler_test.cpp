// SPDX-License-Identifier: Apache-2.0
/** @file Validity of CRTK commands. */
#include "services/control/crtk_command_handler.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "services/runtime/clock_request_handler.h"
#include "services/runtime/periodic_loop.h"
#include "tests/unit/services/system.h"

namespace tandem::test {
namespace {

operation::CrtkRequest requestOf(std::string_view name, int group) {
  operation::CrtkRequest request;
  request.group = group;
  while (operation::kCrtkVerbs[static_cast<std::size_t>(request.verb)].name != name)
    ++request.verb;
  return request;
}

constexpr std::int64_t kMs = 1'000'000;

TEST(CrtkStream, ByWallClocks) {
  control_service::CrtkStream stream(false, 0.1);
  const std::int64_t wall = 1'700'000'000'000 * kMs;
  EXPECT_NE(stream.judge(0, wall, 0), "") << "a stamp of zero is not valid";
  EXPECT_EQ(stream.judge(wall - 50 * kMs, wall, 1000 * kMs), "");
  EXPECT_NE(stream.judge(wall - 50 * kMs, wall, 1001 * kMs), "") << "the same one again";
  EXPECT_NE(stream.judge(wall - 40 * kMs, wall + 100 * kMs, 1100 * kMs), "") << "too old";
  EXPECT_NE(stream.judge(wall + 500 * kMs, wall + 200 * kMs, 1200 * kMs), "") << "from the future";
}

TEST(CrtkStream, AgeByArrivalIsIndependentOfTheWritersClock) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937_64 random(seed);
  for (int run = 0; run < 50; ++run) {
    control_service::CrtkStream stream(true, 0.1);
    const auto offset = static_cast<std::int64_t>(random() % 1'000'000) * 1000 * kMs;
    std::int64_t now = static_cast<std::int64_t>(random() % 1'000'000) * kMs + 1;
    const auto sample = [&](std::int64_t delay) { return stream.judge(now - delay + offset, 0, now); };
    EXPECT_NE(sample(0), "") << "the first one only opens the stream";
    for (int i = 0; i < 200; ++i) {
      now += 10 * kMs;
      ASSERT_EQ(sample(static_cast<std::int64_t>(random() % 9) * kMs), "");
    }
    // A stall: delayed commands arrive late, and do not count until they are fresh again.
    const std::int64_t stalled = now;
    now += 500 * kMs;
    for (std::int64_t t = stalled + 10 * kMs; t <= now; t += 10 * kMs) {
      const bool taken = stream.judge(t + offset, 0, now).empty();
      if (now - t != 100 * kMs) {  // at the limit, the delay of the fastest command decides
        ASSERT_EQ(taken, now - t < 100 * kMs) << (now - t) / kMs;
      }
    }
  }
}

TEST(CrtkStream, DelayedFirstSampleIsRefused) {
  const std::int64_t wall = 1'700'000'000'000 * kMs;
  for (const std::int64_t held : {200, 1000, 600'000}) {  // ms
    SCOPED_TRACE(held);
    control_service::CrtkStream stream(true, 0.1);
    EXPECT_NE(stream.judge(wall - held * kMs, wall, 1000 * kMs), "");
    EXPECT_EQ(stream.judge(wall + 20 * kMs, wall + 30 * kMs, 1030 * kMs), "") << "the next one is fresh";
    // A link is cut for minutes, and then delivers old commands.
    const std::int64_t later = 900'000;
    EXPECT_NE(stream.judge(wall + 40 * kMs, wall + later * kMs, (1000 + later) * kMs), "");
  }
  control_service::CrtkStream agrees(true, 0.1);
  EXPECT_EQ(agrees.judge(wall - 50 * kMs, wall, 1000 * kMs), "") << "where clocks agree the first one counts";
  control_service::CrtkStream differs(true, 0.1);
  EXPECT_NE(differs.judge(wall - 5000 * kMs, wall, 1000 * kMs), "");
  EXPECT_EQ(differs.judge(wall - 4000 * kMs, wall + 1000 * kMs, 2000 * kMs), "") << "sent again it counts";
}

TEST(RosTime, FollowsTheWallClockWithTheIntervalsOfTheMonotonicOne) {
  runtime::RosTime time(false);
  const std::int64_t wall = 1'700'000'000'000 * kMs;
  EXPECT_EQ(time.of(1000 * kMs, 1005 * kMs, wall), wall - 5 * kMs);
  EXPECT_EQ(time.of(1010 * kMs, 1015 * kMs, wall + 10 * kMs + 900'000), wall + 5 * kMs) << "0.9 ms of drift";
  EXPECT_EQ(time.of(1020 * kMs, 1025 * kMs, wall + 3600'000 * kMs), wall + 3599'995 * kMs) << "the clock was set";
  EXPECT_EQ(runtime::RosTime(true).of(7 * kMs, 1005 * kMs, wall), 7 * kMs) << "simulated time";
}

TEST(FeedbackStamps, AreTheTimeOfTheFirstUseOfAStateAndNameTheStatus) {
  control_service::FeedbackStamps stamps(false);
  dds::ActuationState state;
  dds::ControlStatus status;
  const auto next = [&](std::uint64_t sequence, std::int64_t later) {
    state.sequence = sequence;
    state.stamp = 5;  // of another host's clock
    status.stamp += later;
    ++status.sequence;
    return stamps.next(state, status);
  };
  status.stamp = runtime::monotonicNow();
  const std::int64_t before = next(0, 0), waiting = next(0, 10 * kMs);
  EXPECT_LT(std::abs(before - runtime::wallNow()), 60'000 * kMs);
  EXPECT_NEAR(static_cast<double>(waiting - before), 10.0 * kMs, 2.0 * kMs) << "no state yet: the time of the status";
  const std::int64_t first = next(1, 10 * kMs), same = next(1, 10 * kMs), second = next(2, 10 * kMs);
  EXPECT_EQ(same, first) << "the state was not renewed";
  EXPECT_NEAR(static_cast<double>(second - first), 20.0 * kMs, 2.0 * kMs);
  EXPECT_EQ(stamps.statusOf(second), 5u);
  EXPECT_EQ(stamps.statusOf(second + 1), 0u);
  ++state.session;
  EXPECT_GT(next(2, 10 * kMs), second) << "the same number of another session";
}

TEST(CrtkCommandHandler, ReadsWhatIsValidAndNamesWhatIsNot) {
  const runtime::Setup setup = makeSetup("laptop");
  const robots::RobotModel robot(setup.robot, "rigid");
  const control_service::CrtkCommandHandler handler(setup, robot);
  operation::CrtkRequest request = requestOf("servo_jp", 0);
  dds::JointState joints;
  joints.position = {1, 2, 3, 4, 5, 6};
  EXPECT_EQ(handler.parse(joints, request), "");
  EXPECT_EQ(request.count, 6);
  EXPECT_EQ(request.values[5], 6.0);
  joints.name = control_service::jointNames(setup.robot.arms[0]);
  EXPECT_EQ(handler.parse(joints, request), "");
  std::swap(joints.name[0], joints.name[1]);
  EXPECT_NE(handler.parse(joints, request).find("name"), std::string::npos);
  joints.name.clear();
  joints.position[2] = std::nan("");
  EXPECT_NE(handler.parse(joints, request).find("finite"), std::string::npos);
  joints.position.pop_back();
  EXPECT_NE(handler.parse(joints, request).find("found 5 numbers, expected 6"), std::string::npos);
  request = requestOf("servo_jv", operation::kPairGroup);
  joints.velocity.assign(12, 0.0);
  EXPECT_EQ(handler.parse(joints, request), "");
  dds::PoseStamped pose;
  request = requestOf("servo_cp", 0);
  EXPECT_EQ(handler.parse(pose, request), "");
  pose.frame = "tandem_base";
  EXPECT_EQ(handler.parse(pose, request), "");
  pose.frame = "camera";
  EXPECT_NE(handler.parse(pose, request).find("'camera', expected tandem_base"), std::string::npos);
  pose.frame.clear();
  pose.orientation = {0, 0, 0, 0};
  EXPECT_NE(handler.parse(pose, request).find("found a quaternion of length 0, expected 1"), std::string::npos);
  for (const double bad : {std::nan(""), HUGE_VAL, 1.1}) {
    pose.orientation = {0, 0, 0, bad};
    EXPECT_NE(handler.parse(pose, request).find("orientation: found a quaternion of length"), std::string::npos) << bad;
  }
  pose.orientation = {0.6, 0, 0, -0.8};
  EXPECT_EQ(handler.parse(pose, request), "");
  EXPECT_EQ(request.orientation, pose.orientation);
  dds::TwistStamped twist;
  twist.angular[1] = INFINITY;
  EXPECT_NE(handler.parse(twist, request).find("finite"), std::string::npos);
  twist.angular = {1, 2, 3};
  EXPECT_EQ(handler.parse(twist, request), "");
  EXPECT_EQ(request.angular, twist.angular);
}

}  // namespace
}  // namespace tandem::test
