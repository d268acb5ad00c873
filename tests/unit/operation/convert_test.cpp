// SPDX-License-Identifier: Apache-2.0
#include "operation/convert.h"

#include <gtest/gtest.h>

#include "tests/unit/safety/random_arm.h"

namespace tandem::test {
namespace {

Eigen::Vector3d randomVector(Random& random) {
  return {random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)};
}

TEST(Convert, TasksSurviveTheRoundTrip) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 100; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    planning::Reference reference;
    reference.task_count = random.integer(0, planning::kMaxTasks);
    for (int k = 0; k < reference.task_count; ++k) {
      planning::TaskReference& task = reference.tasks[static_cast<std::size_t>(k)];
      task = {static_cast<planning::TaskKind>(random.integer(0, 10)), random.integer(0, 7), random.integer(0, 7),
              randomVector(random), randomVector(random)};
      if (task.kind == planning::TaskKind::kObjectPose)
        task.kind = planning::TaskKind::kTipPose;
      const kinematics::TaskKindEntry* kind = kinematics::findTaskKind(task.kind);
      if (kind == nullptr || !kind->hasOrientation())
        continue;
      task.orientation = Eigen::Quaterniond(1.0, random.uniform(-1, 1), random.uniform(-1, 1), 0.5).normalized();
      task.angular_feed_forward = randomVector(random);
    }
    msg::PlanningReference message;
    msg::setTasks(reference, message);
    const planning::Reference back = msg::tasksOf(message);
    ASSERT_EQ(back.task_count, reference.task_count);
    for (std::size_t k = 0; k < back.tasks.size(); ++k) {
      EXPECT_EQ(back.tasks[k].kind, reference.tasks[k].kind);
      EXPECT_EQ(back.tasks[k].arm, reference.tasks[k].arm);
      EXPECT_EQ(back.tasks[k].other_arm, reference.tasks[k].other_arm);
      EXPECT_EQ(back.tasks[k].position, reference.tasks[k].position);
      EXPECT_EQ(back.tasks[k].feed_forward, reference.tasks[k].feed_forward);
      EXPECT_EQ(back.tasks[k].orientation.coeffs(), reference.tasks[k].orientation.coeffs());
      EXPECT_EQ(back.tasks[k].angular_feed_forward, reference.tasks[k].angular_feed_forward);
    }
  }
}

TEST(Convert, PosturesSurviveTheRoundTripAndWhatIsNotFiniteIsNone) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 100; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const int arms = random.integer(1, safety::kMaxArms);
    msg::PerArm<std::uint8_t> joints{};
    int count = 0;
    for (int k = 0; k < arms; ++k)
      count += joints[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(2 * random.integer(1, 4));
    safety::RobotVector posture(count);
    for (double& q : posture)
      q = random.uniform(-4.0, 4.0);
    msg::PlanningReference message;
    EXPECT_EQ(msg::postureOf(message, arms, joints).size(), 0);
    msg::setPosture(posture, arms, joints, message);
    EXPECT_EQ(message.posture_valid, 1);
    EXPECT_EQ(msg::postureOf(message, arms, joints), posture);
    message.posture[msg::jointIndex(arms - 1, 1)] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(msg::postureOf(message, arms, joints).size(), 0);
    msg::setPosture(posture.head(count - 1), arms, joints, message);
    EXPECT_EQ(message.posture_valid, 0) << "of another robot";
    msg::setPosture({}, arms, joints, message);
    EXPECT_EQ(message.posture_valid, 0);
  }
}

TEST(Convert, CountsBeyondCapacityAreCut) {
  msg::PlanningReference message;
  message.task_count = 200;
  EXPECT_EQ(msg::tasksOf(message).task_count, planning::kMaxTasks);
}

TEST(Convert, FaultRecordsSurviveTheRoundTrip) {
  const safety::FaultRecord record{bit(safety::Fault::kDrive), safety::FaultCause::kFollowingError, 4, 0.031, 0.02};
  msg::HalStatus message;
  msg::setFaultRecord(record, 7, message);
  const safety::FaultRecord back = msg::faultRecordOf(message, 7);
  EXPECT_EQ(back.faults, record.faults);
  EXPECT_EQ(back.cause, record.cause);
  EXPECT_EQ(back.joint, record.joint);
  EXPECT_EQ(back.amount, record.amount);
  EXPECT_EQ(back.allowed, record.allowed);
  EXPECT_EQ(msg::faultRecordOf(message, 6).faults, 0u);
}

}  // namespace
}  // namespace tandem::test
