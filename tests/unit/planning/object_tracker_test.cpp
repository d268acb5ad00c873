// SPDX-License-Identifier: Apache-2.0
/** @file Reference tracker with a common object: hierarchy, first-order accuracy, invalid references. */
#include <gtest/gtest.h>

#include "planning/path_reference.h"
#include "planning/reference_tracker.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::test {
namespace {

using planning::Twist;

/** Two arms of three joints with a synthetic equilibrium: J, a contact row with higher and a force row with lower
 * priority than the motion. */
struct ObjectTracker : ::testing::Test {
  ObjectTracker() {
    for (safety::ArmLimits& arm : limits)
      arm.joints.assign(3, safety::JointLimit{});
    for (safety::ArmLimits& arm : limits) {
      for (safety::JointLimit& joint : arm.joints) {
        joint.lower = -1.0;
        joint.upper = 1.0;
        joint.velocity = 5.0;
        joint.kind = safety::JointKind::kRotation;
      }
      arm.joints[0].kind = safety::JointKind::kTranslation;
    }
    rest.joint_count = 6;
    rest.length = 0.02;
    for (int k = 0; k < 36; ++k)
      rest.jacobian[static_cast<std::size_t>(k)] = std::sin(1.0 + 1.7 * k * k);
    rest.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    rest.higher_count = rest.lower_count = 1;
    for (std::size_t t = 0; t < 2; ++t) {
      rest.tasks[t].rows = 1;
      for (int j = 0; j < 6; ++j)
        rest.tasks[t].jacobian[static_cast<std::size_t>(j)] = std::cos(2.3 * j + static_cast<double>(t));
      rest.tasks[t].velocity[0] = t == 0 ? 0.01 : 0.02;
    }
    reference.position = {1e-3, -2e-3, 0.0};
    reference.feed_forward << 1e-3, 0, 0, 0, 0, 2e-3;
    reference.tracked = {true, true, false, false, false, true};
  }
  planning::ReferenceTracker make(control::Method method = control::Method::kNspqp) {
    control::MethodParameters parameters;
    parameters.translation_step = 1.0;
    return planning::ReferenceTracker::ofObject({&limits[0], &limits[1]}, safety::RobotVector::Zero(6), method,
                                                parameters, {5.0, 4.0});
  }
  auto row(std::size_t task) const { return Eigen::RowVectorXd::Map(rest.tasks[task].jacobian.data(), 6); }

  std::array<safety::ArmLimits, 2> limits;
  planning::Equilibrium rest;
  planning::ObjectReference reference;
  safety::RobotVector q = safety::RobotVector::Zero(6);
  planning::TrackResult result;
};

TEST_F(ObjectTracker, RespectsTaskPriorities) {
  for (const control::Method method : {control::Method::kNspqp, control::Method::kSnsqp, control::Method::kHqp}) {
    auto tracker = make(method);
    tracker.step(rest, q, q, reference, result);
    ASSERT_EQ(result.status, planning::TrackStatus::kOk);
    EXPECT_EQ(result.first_task, 1);
    EXPECT_EQ(tracker.problem().task_count, 3);
    const Eigen::VectorXd v = result.solution.velocity;
    EXPECT_NEAR(row(0).dot(v.transpose()), 5.0 * 0.01, 1e-5) << "above: by Gains::relative";
    const Twist twist = rest.motion() * v;
    EXPECT_NEAR(twist.x(), 1e-3 + 4.0 * 1e-3, 1e-5) << "the frame: by Gains::tip, and its feed-forward";
    EXPECT_NEAR(twist.y(), -4.0 * 2e-3, 1e-5);
    EXPECT_NEAR(twist[5], 2e-3, 1e-3);
    EXPECT_NEAR(row(1).dot(v.transpose()), 5.0 * 0.02, 2e-3) << "below: in what joints are left";
    EXPECT_NEAR(result.error[0], std::hypot(1e-3, 2e-3), 1e-12) << "z is not tracked";
    for (int j = 0; j < 6; ++j)
      EXPECT_LE(std::abs(v[j]), 5.0 + 1e-9);
  }
}

TEST_F(ObjectTracker, PredictsTheEquilibriumToFirstOrder) {
  auto tracker = make();
  const safety::RobotVector away = 1e-4 * safety::RobotVector::Ones(6);
  tracker.step(rest, q + away, q, reference, result);
  ASSERT_EQ(result.status, planning::TrackStatus::kOk);
  EXPECT_NEAR(row(0).dot(result.solution.velocity.transpose()), 5.0 * (0.01 - row(0).dot(away.transpose())), 1e-5);
  const Twist moved = rest.motion() * away;
  const Twist twist = rest.motion() * result.solution.velocity;
  EXPECT_NEAR(twist.x(), 1e-3 + 4.0 * (1e-3 - moved.x()), 1e-5);
}

TEST_F(ObjectTracker, SaysWhatItCannotUse) {
  auto tracker = make();
  const auto status = [&](const planning::Equilibrium& at, const planning::ObjectReference& wanted) {
    tracker.step(at, q, q, wanted, result);
    return result.solution.velocity.isZero(0.0) ? result.status : planning::TrackStatus::kOk;
  };
  EXPECT_EQ(status({}, reference), planning::TrackStatus::kNoEquilibrium);
  auto bad = reference;
  bad.position.x() = std::nan("");
  EXPECT_EQ(status(rest, bad), planning::TrackStatus::kReference);
  bad = reference;
  bad.orientation.coeffs() *= 1.1;
  EXPECT_EQ(status(rest, bad), planning::TrackStatus::kReference);
  bad = reference;
  bad.feed_forward[0] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(status(rest, bad), planning::TrackStatus::kReference);
  bad = reference;
  bad.tracked = {};
  EXPECT_EQ(status(rest, bad), planning::TrackStatus::kReference);
  tracker.hold(q, q, planning::TrackStatus::kNoEquilibrium, result);
  EXPECT_EQ(result.status, planning::TrackStatus::kNoEquilibrium);
  planning::Reference of_tubes;
  of_tubes.task_count = 1;
  of_tubes.tasks[0].kind = planning::TaskKind::kTipPosition;
  tracker.step(q, q, of_tubes, result);
  EXPECT_EQ(result.status, planning::TrackStatus::kModel) << "there are no tips";
  EXPECT_THROW((planning::ReferenceTracker::ofObject({&limits[0]}, q, control::Method::kNspqp, {}, {})),
               std::invalid_argument);
}

TEST_F(ObjectTracker, AllocatesNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "a sanitizer has its own allocator";
  for (const control::Method method : {control::Method::kNspqp, control::Method::kHqp}) {
    auto tracker = make(method);
    tracker.step(rest, q, q, reference, result);
    const std::size_t before = allocationCount();
    tracker.step(rest, q, q, reference.after(0.01), result);
    tracker.hold(q, q, planning::TrackStatus::kNoEquilibrium, result);
    EXPECT_EQ(allocationCount(), before);
  }
}

TEST(PathReference, LeadsToWhereThePathIsAPeriodLater) {
  planning::ObjectPath path;
  path.directions = {0, 4};
  path.size = 5e-3;
  path.duration = 2.0;
  path.length = 0.014;
  Eigen::Isometry3d start = Eigen::Isometry3d::Identity();
  start.translation() << 0.1, 0.0, 0.2;
  constexpr double kStep = 0.01;
  for (double time = 0.0; time < 2.0; time += 0.1) {
    const planning::ObjectReference now = planning::pathReference(path, start, time, kStep);
    const planning::ObjectReference next = planning::pathReference(path, start, time + kStep, kStep);
    const planning::ObjectReference led = now.after(kStep);
    EXPECT_LT((led.position - next.position).norm(), 1e-15);
    EXPECT_LT(led.orientation.angularDistance(next.orientation), 1e-7);
    EXPECT_EQ(now.tracked, (std::array<bool, 6>{true, true, true, false, true, false}));
  }
  EXPECT_TRUE(planning::pathReference(path, start, 2.0, kStep).feed_forward.isZero(1e-15));
  Eigen::Isometry3d off = start;
  off.translation().y() += 3e-3;
  off.rotate(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()));
  EXPECT_NEAR(planning::trackedError(path, start, off), std::hypot(3e-3, 0.014 * 0.1), 1e-12);
}

}  // namespace
}  // namespace tandem::test
