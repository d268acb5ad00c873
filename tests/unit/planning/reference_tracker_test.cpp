// SPDX-License-Identifier: Apache-2.0
#include "planning/reference_tracker.h"

#include <gtest/gtest.h>

#include "kinematics/rotations.h"
#include "tests/unit/safety/allocation_counter.h"
#include "tests/unit/support/ark_problem.h"

namespace tandem::test {
namespace {

struct TrackerTest : ::testing::Test {
  ArkProblem ark;
  planning::ReferenceTracker make(control::Method method) {
    return {{&ark.a, &ark.b}, {&ark.limits, &ark.limits}, method, {}, {5.0, 3.0}};
  }
  safety::RobotVector start(int configuration) {
    safety::RobotVector q(12);
    q << arkStart(configuration, 0), arkStart(configuration, 1);
    return q;
  }
  planning::Reference at(const planning::TrackResult& here, const Eigen::Vector3d& move) {
    const Eigen::Vector3d a = here.tip[0].pose.translation(), b = here.tip[1].pose.translation();
    planning::Reference r;
    r.task_count = 2;
    r.tasks[0] = {planning::TaskKind::kRelativePosition, 0, 1, a - b, Eigen::Vector3d::Zero()};
    r.tasks[1] = {planning::TaskKind::kTipPosition, 0, 0, a + move, Eigen::Vector3d::Zero()};
    return r;
  }
};

TEST_F(TrackerTest, MovesTheTipTowardTheReferenceAndHoldsTheRelativePosition) {
  for (int c = 0; c < 3; ++c) {
    auto tracker = make(control::Method::kNspqp);
    planning::TrackResult result;
    const auto q = start(c);
    ASSERT_TRUE(tracker.computeTips(q, result));
    const Eigen::Vector3d move(c == 0 ? -0.4e-3 : 0, c == 0 ? 0 : 0.4e-3, 0);
    const auto reference = at(result, move);
    tracker.step(q, q, reference, result);
    ASSERT_EQ(result.status, planning::TrackStatus::kOk);
    EXPECT_NEAR(result.error[0], 0.0, 1e-15);
    EXPECT_NEAR(result.error[1], 0.4e-3, 1e-12);
    safety::RobotVector next = q + 0.1 * result.solution.velocity;
    planning::TrackResult after;
    ASSERT_TRUE(tracker.computeTips(next, after));
    const Eigen::Vector3d a = after.tip[0].pose.translation(), b = after.tip[1].pose.translation();
    EXPECT_NEAR((reference.tasks[1].position - a).norm(), 0.7 * 0.4e-3, 0.03e-3);  // 1 - lambda_A T
    EXPECT_LT((reference.tasks[0].position - (a - b)).norm(), 0.02e-3);
  }
}

TEST_F(TrackerTest, RefusesReferencesThatMakeNoSense) {
  auto tracker = make(control::Method::kSnsqp);
  planning::TrackResult result;
  const auto q = start(0);
  ASSERT_TRUE(tracker.computeTips(q, result));
  const auto good = at(result, Eigen::Vector3d::Zero());
  const auto refused = [&](auto change) {
    auto bad = good;
    change(bad);
    tracker.step(q, q, bad, result);
    return result.status == planning::TrackStatus::kReference && result.solution.velocity.isZero(0.0);
  };
  EXPECT_TRUE(refused([](auto& r) { r.tasks[1].position.x() = std::nan(""); }));
  EXPECT_TRUE(refused([](auto& r) { r.tasks[1].feed_forward.z() = INFINITY; }));
  EXPECT_TRUE(refused([](auto& r) { r.tasks[1].arm = 2; }));
  EXPECT_TRUE(refused([](auto& r) { r.tasks[0].other_arm = 0; }));
  EXPECT_TRUE(refused([](auto& r) { r.tasks[0].kind = static_cast<planning::TaskKind>(99); }));
  EXPECT_TRUE(refused([](auto& r) { r.task_count = 5; }));
}

TEST_F(TrackerTest, SaysWhichModelCannotAnswer) {
  auto tracker = make(control::Method::kNspqp);
  planning::TrackResult result;
  auto q = start(0);
  q[8] = std::nan("");
  tracker.step(q, q, planning::Reference{}, result);
  EXPECT_EQ(result.status, planning::TrackStatus::kModel);
  EXPECT_EQ(result.model_arm, 1);
}

TEST_F(TrackerTest, MeasuredTipsGiveTheErrorAndTheModelItsJacobian) {
  auto tracker = make(control::Method::kNspqp);
  planning::TrackResult result, expected;
  const auto q = start(1);
  ASSERT_TRUE(tracker.computeTips(q, result));
  const Eigen::Vector3d move(0, 0.4e-3, 0), off(3e-3, -2e-3, 1e-3);
  auto reference = at(result, move);
  planning::MeasuredTips measured;
  measured.take(0, true, result.tip[0].pose.translation() + off, 1, 2);
  tracker.step(q, q, reference, &measured, result);
  EXPECT_EQ(result.status, planning::TrackStatus::kSensor) << "arm 1 has not been measured";
  EXPECT_TRUE(result.solution.velocity.isZero(0.0));
  measured.take(1, true, result.tip[1].pose.translation() + off, 1, 2);
  measured.take(1, false, Eigen::Vector3d::Zero(), 2, 3);
  measured.take(1, true, Eigen::Vector3d::Constant(std::nan("")), 2, 3);
  tracker.step(q, q, reference, &measured, result);
  ASSERT_EQ(result.status, planning::TrackStatus::kOk) << "what is not good changes nothing";
  EXPECT_NEAR(result.error[0], 0.0, 1e-15) << "both are off alike";
  EXPECT_NEAR(result.error[1], (move - off).norm(), 1e-12);
  // The same velocity as from the model's tips for a reference with the same offset.
  reference.tasks[1].position -= off;
  auto model = make(control::Method::kNspqp);
  model.step(q, q, reference, expected);
  EXPECT_LT((result.solution.velocity - expected.solution.velocity).norm(), 1e-9);
}

/// By kind of task: without measured orientations the error is that of the model's, with them that of the measured.
TEST_F(TrackerTest, MeasuredOrientationsGiveTheErrorIfTasksUseThem) {
  using enum planning::TaskKind;
  const Eigen::Quaterniond off[] = {kinematics::rotationBy({0.03, -0.02, 0.01}), kinematics::rotationBy({0, 0.04, 0})};
  for (const auto kind : {kTipAxis, kTipOrientation, kRelativeOrientation, kLookAt, kTipPose, kRelativePose}) {
    const kinematics::TaskKindEntry& entry = *kinematics::findTaskKind(kind);
    SCOPED_TRACE(std::string(entry.name));
    auto tracker = make(control::Method::kHqp);
    planning::TrackResult result;
    const auto q = start(1);
    ASSERT_TRUE(tracker.computeTips(q, result));
    planning::MeasuredTips measured;
    Eigen::Isometry3d pose[2];
    planning::Reference reference;
    reference.task_count = 1;
    const kinematics::TaskPlace place = entry.place(result.tip[0].pose, result.tip[entry.relative() ? 1 : 0].pose);
    planning::TaskReference& task = reference.tasks[0];
    task = {kind, 0, 1, place.position + Eigen::Vector3d(1e-3, 2e-3, 5e-3)};
    task.orientation = kinematics::rotationBy({0.01, 0.02, 0.0}) * place.orientation;
    tracker.step(q, q, reference, result);
    const double of_model = result.error[0];
    for (int k = 0; k < 2; ++k) {
      pose[k] = result.tip[static_cast<std::size_t>(k)].pose;
      measured.take(k, true, pose[k].translation(), 1, 2);
      pose[k].linear() = (off[k] * Eigen::Quaterniond(pose[k].linear())).toRotationMatrix();
    }
    tracker.step(q, q, reference, &measured, result);
    ASSERT_EQ(result.status, planning::TrackStatus::kOk);
    EXPECT_NEAR(result.error[0], of_model, 1e-12);
    measured.orientations = planning::Feedback::kSensor;
    tracker.step(q, q, reference, &measured, result);
    EXPECT_EQ(result.status, planning::TrackStatus::kSensor) << "none has been measured";
    EXPECT_TRUE(result.solution.velocity.isZero(0.0));
    for (int k = 0; k < 2; ++k)
      measured.take(k, true, pose[k].translation(), Eigen::Quaterniond(pose[k].linear()), 2, 3);
    tracker.step(q, q, reference, &measured, result);
    ASSERT_EQ(result.status, planning::TrackStatus::kOk);
    const double expected = entry.error(entry.place(pose[0], pose[entry.relative() ? 1 : 0]), task.place());
    EXPECT_NEAR(result.error[0], entry.length() * expected, 1e-12);
    EXPECT_GT(std::abs(result.error[0] - of_model), 1e-5) << "the difference is seen";
  }
}

/// What was solved before a restart changes nothing after it, not even rounding.
TEST_F(TrackerTest, ARestartIsAColdStart) {
  constexpr int kSteps = 30;
  for (int m = 0; m < control::kMethodCount; ++m) {
    const auto method = static_cast<control::Method>(m);
    auto used = make(method), fresh = make(method);
    planning::TrackResult result, expected;
    Random random(baseSeed());
    const auto joints = [&] {
      safety::RobotVector q = start(1);
      for (int j = 0; j < 12; ++j)
        q[j] += (j % 6 < 3 ? 3e-3 : 0.3) * random.uniform(-1, 1);
      return q;
    };
    for (int i = 0; i < kSteps; ++i) {
      const safety::RobotVector q = joints();
      ASSERT_TRUE(used.computeTips(q, result));
      used.step(q, q, at(result, {0, 5e-3, 0}), result);
    }
    used.restart();
    const safety::RobotVector q = start(2);
    ASSERT_TRUE(fresh.computeTips(q, expected));
    const auto reference = at(expected, {2e-3, 5e-3, -4e-3});
    used.step(q, q, reference, result);
    fresh.step(q, q, reference, expected);
    EXPECT_EQ(result.solution.velocity, expected.solution.velocity) << control::name(method);
    EXPECT_EQ(result.solution.iterations, expected.solution.iterations) << control::name(method);
  }
}

TEST_F(TrackerTest, HoldMovesNothingAndStillFollowsTheJoints) {
  auto tracker = make(control::Method::kSnsqp);
  planning::TrackResult result;
  tracker.hold(start(2), start(2), planning::TrackStatus::kSensor, result);
  EXPECT_EQ(result.status, planning::TrackStatus::kSensor);
  EXPECT_TRUE(result.solution.velocity.isZero(0.0));
  EXPECT_EQ(result.tip[0].pose.matrix(), tracker.tips().tip(0).pose.matrix());
  EXPECT_LT(tracker.problem().joint[0].moving_lower, tracker.problem().joint[0].moving_upper);
}

TEST_F(TrackerTest, JointsComeToThePostureWithTheTips) {
  Random random(baseSeed());
  for (int m = 0; m < control::kMethodCount; ++m) {
    auto tracker = make(static_cast<control::Method>(m));
    planning::TrackResult result;
    const safety::RobotVector posture = start(1);
    ASSERT_TRUE(tracker.computeTips(posture, result));
    planning::Reference reference = at(result, Eigen::Vector3d::Zero());
    reference.posture = posture;
    safety::RobotVector q = posture;
    for (int j = 0; j < 12; ++j)
      q[j] += (j % 6 < 3 ? 3e-3 : 0.1) * random.uniform(-1, 1);
    for (int i = 0; i < 200; ++i) {
      tracker.step(q, q, reference, result);
      ASSERT_EQ(result.status, planning::TrackStatus::kOk);
      q += 0.1 * result.solution.velocity;
    }
    EXPECT_LT((q - posture).cwiseAbs().maxCoeff(), 1e-4) << control::name(static_cast<control::Method>(m));
    EXPECT_LT(result.error[1], 1e-5);
    reference.posture[4] = std::nan("");
    tracker.step(q, q, reference, result);
    EXPECT_EQ(result.status, planning::TrackStatus::kReference);
    reference.posture.setZero(6);
    tracker.step(q, q, reference, result);
    EXPECT_EQ(result.status, planning::TrackStatus::kReference);
  }
}

TEST_F(TrackerTest, StepAllocatesNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  for (int m = 0; m < control::kMethodCount; ++m) {
    auto tracker = make(static_cast<control::Method>(m));
    planning::TrackResult result;
    const auto q = start(1);
    ASSERT_TRUE(tracker.computeTips(q, result));
    auto reference = at(result, {0, 0.5e-3, 0});
    reference.posture = start(0);
    const std::size_t before = allocationCount();
    planning::MeasuredTips measured;
    for (int k = 0; k < 2; ++k)
      measured.take(k, true, result.tip[static_cast<std::size_t>(k)].pose.translation(), 0, 0);
    for (int i = 0; i < 50; ++i) {
      tracker.step(q, q, reference, result);
      tracker.step(q, q, reference, &measured, result);
      tracker.hold(q, q, planning::TrackStatus::kSensor, result);
    }
    EXPECT_EQ(allocationCount(), before) << control::name(static_cast<control::Method>(m));
  }
}

}  // namespace
}  // namespace tandem::test
