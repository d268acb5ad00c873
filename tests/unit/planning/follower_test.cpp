// SPDX-License-Identifier: Apache-2.0
#include "planning/follower.h"

#include <gtest/gtest.h>

namespace tandem::test {
namespace {

using planning::Follower;
using planning::Phase;
using planning::Reference;

constexpr double kPeriod = 0.1;
const Eigen::Vector3d kTip(0, 0, 0.3), kRelative(0, 0.01, 0);

planning::TrajectorySpec line(double length, int points) {
  planning::TrajectorySpec spec;
  spec.shape = planning::Line{{0, 0, length}};
  spec.point_count = points;
  return spec;
}

TEST(Follower, ProtocolAsksForTheNextPointWhenWithinTolerance) {
  Follower follower(kPeriod);
  follower.start(line(0.01, 10), {kTip, kRelative});
  Reference reference;
  Eigen::Vector3d tip = kTip;
  int updates = 0;
  while (follower.update({tip, kRelative}, reference)) {
    ++updates;
    ASSERT_EQ(reference.task_count, 2);
    EXPECT_EQ(reference.tasks[0].kind, planning::TaskKind::kRelativePosition);
    EXPECT_EQ(reference.tasks[1].kind, planning::TaskKind::kTipPosition);
    // Feed-forward only in the first iteration of a point.
    const double expected = follower.progress().iteration == 1 ? 1e-3 / 10.0 : 0.0;
    EXPECT_NEAR(reference.tasks[1].feed_forward.z(), expected, 1e-12);
    tip += 0.3 * (reference.tasks[1].position - tip);  // lambda_A T = 0.3
  }
  EXPECT_EQ(follower.progress().phase, Phase::kFinished);
  EXPECT_EQ(follower.progress().converged_points, 10);
  EXPECT_EQ(follower.progress().total_iterations, updates);
  EXPECT_LE((tip - (kTip + Eigen::Vector3d(0, 0, 0.01))).norm(), 0.88e-3);
}

TEST(Follower, ATipAloneIsOneTask) {
  for (const auto following : {planning::Following::kPointByPoint, planning::Following::kTimed}) {
    auto spec = line(0.01, 10);
    spec.arm = 2;
    spec.other_arm = planning::kNoArm;
    spec.following = following;
    Follower follower(kPeriod);
    follower.start(spec, {kTip, Eigen::Vector3d::Zero()});
    Reference reference;
    Eigen::Vector3d tip = kTip;
    while (follower.update({tip, Eigen::Vector3d::Zero()}, reference)) {
      ASSERT_EQ(reference.task_count, 1);
      ASSERT_EQ(reference.tasks[0].kind, planning::TaskKind::kTipPosition);
      ASSERT_EQ(reference.tasks[0].arm, 2);
      tip = reference.tasks[0].position;
    }
    EXPECT_EQ(follower.progress().phase, Phase::kFinished);
    EXPECT_EQ(follower.progress().relative_error, 0.0);
    ASSERT_EQ(follower.errors().size(), 1u);
    EXPECT_GT(follower.errors()[0].count(), 0u);
  }
}

TEST(Follower, GivesUpAPointAfterTheLimitAndSaysSo) {
  auto spec = line(0.01, 2);
  spec.max_iterations = 7;
  Follower follower(kPeriod);
  follower.start(spec, {kTip, kRelative});
  Reference reference;
  int updates = 0;
  while (follower.update({kTip, kRelative}, reference))
    ++updates;  // the arm does not move
  EXPECT_EQ(updates, 14);
  EXPECT_EQ(follower.progress().phase, Phase::kFailed);
  EXPECT_EQ(follower.progress().converged_points, 0);
}

TEST(Follower, JudgesTheRelativePositionToo) {
  auto spec = line(0.0005, 1);
  spec.max_iterations = 3;
  Follower follower(kPeriod);
  follower.start(spec, {kTip, kRelative});
  Reference reference;
  const Eigen::Vector3d off = kRelative + Eigen::Vector3d(0.001, 0, 0);
  while (follower.update({kTip + Eigen::Vector3d(0, 0, 0.0005), off}, reference)) {
  }
  EXPECT_EQ(follower.progress().phase, Phase::kFailed);
}

TEST(Follower, PauseHoldsTheReferenceWithoutCounting) {
  Follower follower(kPeriod);
  follower.start(line(0.01, 10), {kTip, kRelative});
  Reference reference, held;
  ASSERT_TRUE(follower.update({kTip, kRelative}, reference));
  follower.pause();
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(follower.update({kTip, kRelative}, held));
    EXPECT_EQ(held.tasks[1].position, reference.tasks[1].position);
    EXPECT_TRUE(held.tasks[1].feed_forward.isZero());
  }
  EXPECT_EQ(follower.progress().total_iterations, 1);
  follower.resume();
  EXPECT_EQ(follower.progress().phase, Phase::kRunning);
  follower.stop();
  EXPECT_FALSE(follower.update({kTip, kRelative}, reference));
}

TEST(Follower, TimedReferenceKeepsSpeedAndAcceleration) {
  auto spec = line(0.02, 50);
  spec.following = planning::Following::kTimed;
  spec.speed = 4e-3;
  spec.acceleration = 2e-3;
  Follower follower(kPeriod);
  follower.start(spec, {kTip, kRelative});
  Reference reference;
  Eigen::Vector3d tip = kTip, last = kTip;
  double last_speed = 0.0, time = 0.0;
  while (follower.update({tip, kRelative}, reference)) {
    const double speed = (reference.tasks[1].position - last).norm() / kPeriod;
    EXPECT_LE(speed, spec.speed * (1 + 1e-9));
    EXPECT_LE(std::abs(speed - last_speed), spec.acceleration * kPeriod * (1 + 1e-6));
    last_speed = speed;
    last = tip = reference.tasks[1].position;  // a perfect arm
    time += kPeriod;
  }
  EXPECT_EQ(follower.progress().phase, Phase::kFinished);
  EXPECT_EQ(follower.progress().converged_points, 50);
  EXPECT_EQ(planning::describeMisses(follower.progress()), "");
  EXPECT_NEAR(time, 0.02 / 4e-3 + 4e-3 / 2e-3, 2 * kPeriod);  // length / v + v / a
}

// A run whose arm stands still for a part of the way was 'finished', because its end was reached.
TEST(Follower, TimedRunThatMissesPointsOnTheWayFails) {
  auto spec = line(0.02, 50);
  spec.following = planning::Following::kTimed;
  spec.speed = 4e-3;
  spec.acceleration = 2e-3;
  Follower follower(kPeriod);
  follower.start(spec, {kTip, kRelative});
  Reference reference;
  Eigen::Vector3d tip = kTip;
  while (follower.update({tip, kRelative}, reference)) {
    const double asked = reference.tasks[1].position.z() + kPeriod * reference.tasks[1].feed_forward.z() - kTip.z();
    const bool stands = asked > 0.008 && asked < 0.012;
    tip.z() = kTip.z() + (stands ? 0.008 : asked);
  }
  const planning::Progress& progress = follower.progress();
  EXPECT_EQ(progress.phase, Phase::kFailed);
  // 0.4 mm between points, 0.88 mm allowed: the tip jumps from 8 to 12 mm, so points 23 to 27 (9.2 to 10.8 mm) are
  // missed.
  EXPECT_EQ(progress.missed_points, 5);
  EXPECT_EQ(progress.converged_points, 45);
  EXPECT_EQ(planning::describeMisses(progress), "missed 5 of 50 points, worst 2 mm at point 25");
}

TEST(Follower, RefusesAShapeWithoutLengthAndStaysIdle) {
  Follower follower(kPeriod);
  EXPECT_THROW(follower.start(line(0.0, 10), {kTip, kRelative}), std::invalid_argument);
  EXPECT_EQ(follower.progress().phase, Phase::kIdle);
}

}  // namespace
}  // namespace tandem::test
