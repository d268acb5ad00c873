// SPDX-License-Identifier: Apache-2.0
#include "operation/tip_feedback.h"

#include <gtest/gtest.h>

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
