// SPDX-License-Identifier: Apache-2.0
#include "operation/tip_feedback.h"

#include <gtest/gtest.h>

#include <cmath>

#include "operation/convert.h"

namespace tandem::test {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

/** The check of tip measurements alone. */
struct TipFeedback : ::testing::Test {
  planning::Reference tasks;
  msg::ActuationState state;
  safety::StateStamps commands;
  msg::TipPoses tips;

  TipFeedback() {
    tasks.task_count = 1;
    tasks.tasks[0] = {planning::TaskKind::kRelativePosition, 0, 1, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    state.arm_count = tips.arm_count = 2;
    state.session = tips.state_session = 5;
    tips.valid = {1, 1};
  }
};

TEST_F(TipFeedback, AgeIsCountedFromTheCommandThatTheRobotHadTaken) {
  operation::TipFeedback feedback(false, 0.1);
  EXPECT_EQ(feedback.check(tasks, state, commands, kSecond), msg::HoldReason::kNoTips);
  commands.record(3, kSecond);
  tips.answers_command = 3;
  feedback.take(tips);
  EXPECT_EQ(feedback.check(tasks, state, commands, kSecond + kSecond / 20), msg::HoldReason::kNone);
  EXPECT_NEAR(feedback.age(), 0.05, 1e-9);
  feedback.take(tips);  // a repeated sample does not become younger
  EXPECT_EQ(feedback.check(tasks, state, commands, kSecond + kSecond / 5), msg::HoldReason::kStaleTips);
  tips.answers_command = 4;  // a command that was never sent
  feedback.take(tips);
  EXPECT_EQ(feedback.check(tasks, state, commands, kSecond), msg::HoldReason::kStaleTips);
}

TEST_F(TipFeedback, OneBadTipIsEnoughIfATaskNamesIt) {
  operation::TipFeedback feedback(true, 0.1);
  feedback.take(tips);
  state.stamp = kSecond;
  tips.stamp = kSecond;
  tips.valid = {1, 0};
  feedback.take(tips);
  EXPECT_EQ(feedback.check(tasks, state, commands, 0), msg::HoldReason::kInvalidTips);
  tasks.tasks[0].kind = planning::TaskKind::kTipPosition;
  EXPECT_EQ(feedback.check(tasks, state, commands, 0), msg::HoldReason::kNone) << "of arm 0 alone";
}

TEST_F(TipFeedback, ADropOutLeavesTheMeasurementBeforeItInForce) {
  operation::TipFeedback feedback(true, 0.1);
  msg::setTip(0, true, {1, 2, 3}, Eigen::Quaterniond::Identity(), tips);
  feedback.take(tips);
  msg::setTip(0, false, {7, 8, 9}, Eigen::Quaterniond::Identity(), tips);
  tips.stamp = kSecond / 20;
  feedback.take(tips);
  state.stamp = kSecond / 20;
  EXPECT_EQ(feedback.check(tasks, state, commands, 0), msg::HoldReason::kNone);
  EXPECT_EQ(feedback.tips().arm[0].position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(feedback.tips().arm[1].stamp, kSecond / 20);
}

/** Tasks that need the orientations of both tips, and their measurement. */
struct OrientedTips : TipFeedback {
  operation::TipFeedback feedback{true, 0.1, planning::Feedback::kSensor};
  Eigen::Quaterniond turned{Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX())};

  OrientedTips() { tasks.tasks[0].kind = planning::TaskKind::kRelativeOrientation; }
  msg::HoldReason afterTips(std::int64_t stamp, const Eigen::Quaterniond& of_second) {
    msg::setTip(0, true, {1, 2, 3}, turned, tips);
    msg::setTip(1, true, {4, 5, 6}, of_second, tips);
    tips.stamp = state.stamp = stamp;
    feedback.take(tips);
    return feedback.check(tasks, state, commands, 0);
  }
};

TEST_F(OrientedTips, AreUsedWhileTheyAreFresh) {
  EXPECT_EQ(feedback.check(tasks, state, commands, 0), msg::HoldReason::kNoTips);
  EXPECT_EQ(afterTips(0, turned), msg::HoldReason::kNone);
  EXPECT_TRUE(feedback.tips().arm[1].orientation.isApprox(turned, 1e-12));
  state.stamp = kSecond / 5;
  EXPECT_EQ(feedback.check(tasks, state, commands, 0), msg::HoldReason::kStaleTips);
}

TEST_F(OrientedTips, BadOrientationsCountAsNone) {
  const double nan = std::nan("");
  const Eigen::Quaterniond bad[] = {{0, 0, 0, 0}, {nan, 0, 0, 1}, {1.01, 0, 0, 0}, {INFINITY, 0, 0, 0}};
  for (const Eigen::Quaterniond& orientation : bad) {
    feedback.forget();
    EXPECT_EQ(afterTips(0, orientation), msg::HoldReason::kInvalidTips);
    EXPECT_EQ(afterTips(0, turned), msg::HoldReason::kNone);
    EXPECT_EQ(afterTips(kSecond / 20, orientation), msg::HoldReason::kNone) << "the one before it is in force";
    EXPECT_TRUE(feedback.tips().arm[1].orientation.isApprox(turned, 1e-12));
    EXPECT_NEAR(feedback.age(), 0.05, 1e-9) << "of the oldest measurement in use";
    EXPECT_EQ(afterTips(kSecond / 5, orientation), msg::HoldReason::kInvalidTips) << "until it is too old";
    EXPECT_EQ(afterTips(kSecond / 4, turned), msg::HoldReason::kNone);
  }
}

TEST_F(OrientedTips, TasksWithoutThemDoNotWaitForThem) {
  tasks.tasks[0].kind = planning::TaskKind::kRelativePosition;
  EXPECT_EQ(afterTips(0, {0, 0, 0, 0}), msg::HoldReason::kNone);
  tasks.tasks[0].kind = planning::TaskKind::kTipPose;
  EXPECT_EQ(afterTips(0, {0, 0, 0, 0}), msg::HoldReason::kNone) << "of arm 0 alone";
  operation::TipFeedback model(true, 0.1);
  tasks.tasks[0].kind = planning::TaskKind::kRelativePose;
  model.take(tips);
  EXPECT_EQ(model.check(tasks, state, commands, 0), msg::HoldReason::kNone) << "orientations are the model's";
}

TEST_F(TipFeedback, AnotherRobotsTipsAreForgotten) {
  operation::TipFeedback feedback(true, 0.1);
  feedback.take(tips);
  tips.state_session = 6;
  tips.valid = {0, 0};
  feedback.take(tips);
  state.session = 6;
  EXPECT_EQ(feedback.check(tasks, state, commands, 0), msg::HoldReason::kInvalidTips);
  EXPECT_FALSE(feedback.tips().arm[0].known);
}

TEST_F(TipFeedback, KnowsTheTipsOfAState) {
  operation::TipFeedback feedback(true, 0.1);
  state.sequence = 9;
  EXPECT_FALSE(feedback.knows(state));
  tips.answers_state = 8;
  feedback.take(tips);
  EXPECT_FALSE(feedback.knows(state));
  tips.answers_state = 9;
  feedback.take(tips);
  EXPECT_TRUE(feedback.knows(state));
  state.session = 6;
  EXPECT_FALSE(feedback.knows(state));
}

}  // namespace
}  // namespace tandem::test
