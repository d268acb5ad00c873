// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "insertion_arms.h"
#include "planning/follower.h"
#include "planning/task_freedom.h"

namespace tandem::test {
namespace {

using control::Method;
using Eigen::Vector3d;

/// The tip of a short arm takes all that its joints can do: a remote centre is refused there, following the leader is
/// not.
TEST(FollowTheLeader, IsNotRefusedWhereTheTipLeavesItNothing) {
  Random random(1);
  Deployment one(random, "rigid", true);
  one.spec.further = {further(planning::TaskKind::kRemoteCentre, 1)};
  for (const bool follows : {true, false}) {
    one.spec.further[0].follows_leader = follows;
    const auto freedom = planning::taskFreedom(one.arms, one.spec, one.path());
    ASSERT_EQ(freedom.size(), 2u);
    EXPECT_EQ(freedom[1].rank, 0);
    EXPECT_EQ(planning::lostTask(freedom, {"a"}).empty(), follows);
  }
}

/// Distance of a point from a piece of a straight line.
double toPiece(const Vector3d& x, const Vector3d& from, const Vector3d& to) {
  const Vector3d along = to - from;
  const double share = std::clamp(along.dot(x - from) / along.squaredNorm(), 0.0, 1.0);
  return (x - from - share * along).norm();
}

/** An arm with joints that follow control exactly, and the path of its leader by many points of the shaft. */
struct LeaderRun {
  double deviation = 0.0;   ///< largest during the run, m
  double difference = 0.0;  ///< largest, of the error that the follower reports from the deviation then, m
  planning::Phase phase = planning::Phase::kIdle;

  LeaderRun(const planning::Arms& arms,
            const planning::TrajectorySpec& wanted,
            const safety::RobotVector& start,
            Method method,
            bool task)
      : spec_(wanted), q_(start), tracker_(arms.models, arms.limits, method, {}, {5.0, 3.0}), model_(*arms.models[0]) {
    if (task) {
      spec_.further = {further(planning::TaskKind::kRemoteCentre, 1)};
      spec_.further[0].follows_leader = true;
    }
    EXPECT_TRUE(tracker_.computeTips(q_, result_));
    planning::setInsertion(arms, q_, spec_);
    follower_.start(spec_, planning::pointAt(spec_, tracker_.tips(), nullptr));
    for (const Vector3d& node : shaft(planning::LeaderPath::kNodes))
      leader_.push_back(node);
    go();
  }

 private:
  std::vector<Vector3d> shaft(int count) const {
    std::vector<kinematics::ShapePoint> shape;
    EXPECT_EQ(model_.shape(q_, count, shape), kinematics::ModelStatus::kOk);
    std::vector<Vector3d> points;
    for (const auto& point : shape)
      points.push_back(point.pose.translation());
    return points;
  }
  double present(int passed) const {
    std::vector<Vector3d> now = shaft(501);
    now.push_back(now.back() + 10.0 * (now.back() - now[now.size() - 2]));  // the straight line beyond the end
    double largest = 0.0;
    for (std::size_t i = 0; i < leader_.size() + static_cast<std::size_t>(passed); ++i) {
      const Vector3d& x = i < leader_.size() ? leader_[i] : follower_.points()[i - leader_.size() + 1].tip;
      double nearest = 1.0;
      for (std::size_t k = 1; k < now.size(); ++k)
        nearest = std::min(nearest, toPiece(x, now[k - 1], now[k]));
      largest = std::max(largest, nearest);
    }
    return largest;
  }
  void go() {
    planning::Reference reference;
    for (int point = 0; follower_.update(tracker_.tips(), nullptr, reference);) {
      if (point > 0) {
        const double now = present(point - 1);
        deviation = std::max(deviation, now);
        if (!spec_.further.empty())
          difference = std::max(difference, std::abs(now - follower_.progress().further_error[0]));
      }
      point = follower_.progress().point;
      tracker_.step(q_, q_, reference, result_);
      ASSERT_EQ(result_.status, planning::TrackStatus::kOk);
      q_ += kStepTime * result_.solution.velocity;
      ASSERT_TRUE(tracker_.computeTips(q_, result_));
    }
    phase = follower_.progress().phase;
  }

  planning::TrajectorySpec spec_;
  safety::RobotVector q_;
  planning::ReferenceTracker tracker_;
  const kinematics::ArmModel& model_;
  planning::TrackResult result_;
  planning::Follower follower_{kStepTime};
  std::vector<Vector3d> leader_;  ///< the shaft at the start
};

/// Under control an insertion keeps to what its tubes allow as far as the tolerance of its points lets the tip wander.
TEST(FollowTheLeader, AnInsertionIsHeldUnderControl) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int i = 0; i < 4; ++i) {
    Deployment one(random, "rigid", false, i < 2 ? Helix::kNone : Helix::kAny);
    for (int tube = 0; tube < one.tubes(); ++tube)  // inside the limits, where ends of tubes do not coincide
      one.q[tube] -= 2e-4 * tube;
    one.spec.tolerance = 0.1e-3;
    for (const Method method : {Method::kNspqp, Method::kSnsqp, Method::kSns, Method::kHqp}) {
      SCOPED_TRACE(std::string(control::name(method)) + ", arm " + std::to_string(i));
      if (i >= 2 && method == Method::kSns)
        continue;  // not held for helices
      const LeaderRun run(one.arms, one.spec, one.q, method, true);
      EXPECT_EQ(run.phase, planning::Phase::kFinished);
      EXPECT_LT(run.deviation, method == Method::kHqp ? 0.4e-3 : 0.1e-3);
      EXPECT_LT(run.difference, 1e-5);
    }
  }
}

/// Where the path of the tip is given and the tubes do not follow it by themselves, the task keeps the shaft nearer to
/// it.
TEST(FollowTheLeader, KeepsTheShaftNearerToItsPath) {
  const Pair pair("rigid");
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  double all_with = 0.0, all_without = 0.0;
  for (const Method method : {Method::kNspqp, Method::kSnsqp, Method::kSns, Method::kHqp}) {
    SCOPED_TRACE(control::name(method));
    double with = 0.0, without = 0.0;
    for (int i = 0; i < 6; ++i) {
      safety::RobotVector q;
      std::vector<kinematics::Tip> tips;
      while (!pair.known(pair.one, random, q, tips) || q[0] < -0.3 || q[0] > -0.05) {
      }
      planning::TrajectorySpec spec = lineBy(0.008 * tips[0].pose.linear().col(2), 10);
      spec.other_arm = planning::kNoArm;
      spec.tolerance = 0.1e-3;
      const LeaderRun task(pair.one, spec, q, method, true), none(pair.one, spec, q, method, false);
      EXPECT_LT(task.difference, 2e-5);
      with += task.deviation;
      without += none.deviation;
    }
    EXPECT_LT(with, without);
    all_with += with;
    all_without += without;
  }
  EXPECT_LT(all_with, 0.8 * all_without);
}

}  // namespace
}  // namespace tandem::test
