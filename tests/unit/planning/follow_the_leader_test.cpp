// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "insertion_arms.h"
#include "planning/follower.h"
#include "planning/task_freedom.h"

namespace tandem::test {
namespace {

using control::Method;
using Eigen::Vector3d;

constexpr std::array kHardLimits{Method::kNspqp, Method::kSnsqp, Method::kSns, Method::kHqp};  // with hard limits

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

/** An arm with joints that follow control exactly, its shaft by many points, and the path of its leader. */
struct LeaderRun {
  double deviation = 0.0;   ///< largest during the run, m
  double difference = 0.0;  ///< largest, of the error that the follower reports from the deviation then, m
  double hidden = 0.0;      ///< largest, of the shaft's distance from where its tip has been beyond that error, m
  planning::Progress progress;

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
    path_ = shaft(planning::LeaderPath::kNodes);
    trail_ = shaft(kPieces + 1);
    go();
  }

 private:
  static constexpr int kPieces = 500;
  using Points = std::vector<Vector3d>;

  Points shaft(int count) const {
    std::vector<kinematics::ShapePoint> shape;
    EXPECT_EQ(model_.shape(q_, count, shape), kinematics::ModelStatus::kOk);
    Points points;
    for (const auto& point : shape)
      points.push_back(point.pose.translation());
    return points;
  }
  /// Largest distance of points from a line.
  static double distance(const Points& points, const Points& line) {
    double largest = 0.0;
    for (const Vector3d& x : points) {
      double nearest = (x - line[0]).norm();
      for (std::size_t k = 1; k < line.size() && nearest > largest; ++k)
        nearest = std::min(nearest, toPiece(x, line[k - 1], line[k]));
      largest = std::max(largest, nearest);
    }
    return largest;
  }
  void compare() {
    Points now = shaft(kPieces + 1);
    trail_.push_back(now.back());
    const double from_trail = distance(now, trail_);
    now.push_back(now.back() + (now.back() - now[kPieces - 1]).normalized());  // the straight line beyond the end
    const double present = distance(path_, now);
    deviation = std::max(deviation, present);
    if (spec_.further.empty())
      return;
    const double reported = follower_.progress().further_error[0];
    difference = std::max(difference, std::abs(present - reported));
    hidden = std::max(hidden, from_trail - reported);
  }
  void go() {
    planning::Reference reference;
    for (int point = 0; follower_.update(tracker_.tips(), nullptr, reference); point = follower_.progress().point) {
      compare();
      if (point > 0 && follower_.progress().point > point)
        path_.push_back(trail_.back());
      tracker_.step(q_, q_, reference, result_);
      ASSERT_EQ(result_.status, planning::TrackStatus::kOk);
      q_ += kStepTime * result_.solution.velocity;
      ASSERT_TRUE(tracker_.computeTips(q_, result_));
    }
    compare();
    progress = follower_.progress();
  }

  planning::TrajectorySpec spec_;
  safety::RobotVector q_;
  planning::ReferenceTracker tracker_;
  const kinematics::ArmModel& model_;
  planning::TrackResult result_;
  planning::Follower follower_{kStepTime};
  Points path_;   ///< the shaft at the start, and the tip at the end of every point
  Points trail_;  ///< the shaft at the start, and the tip in every period
};

constexpr double kPointTolerance = 0.1e-3;  // m

/// Inside the limits, where ends of tubes do not coincide.
Deployment insideLimits(Random& random, Helix helix) {
  Deployment one(random, "rigid", false, helix);
  for (int tube = 0; tube < one.tubes(); ++tube)
    one.q[tube] -= 2e-4 * tube;
  one.spec.tolerance = kPointTolerance;
  return one;
}

/// Under control an insertion keeps to what its tubes allow as far as the tolerance of its points lets the tip wander.
TEST(FollowTheLeader, AnInsertionIsHeldUnderControl) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int i = 0; i < 6; ++i) {
    const Deployment one = insideLimits(random, i < 2 ? Helix::kNone : Helix::kAny);
    for (const Method method : kHardLimits) {
      SCOPED_TRACE(std::string(control::name(method)) + ", arm " + std::to_string(i));
      const LeaderRun run(one.arms, one.spec, one.q, method, true);
      EXPECT_EQ(run.progress.phase, planning::Phase::kFinished) << planning::describeMisses(run.progress);
      EXPECT_LT(run.deviation, (method == Method::kHqp || method == Method::kSns ? 4.0 : 1.0) * kPointTolerance);
      EXPECT_LT(run.difference, 1e-5);
      EXPECT_LT(run.hidden, 2.0 * kPointTolerance);
    }
  }
}

/// The path is where the tip has gone, also where it did not get to the points of its trajectory.
TEST(FollowTheLeader, ReportsTheDeviationOfArmsThatMissTheirPoints) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  int missed = 0;
  for (int i = 0; i < 6; ++i) {
    Deployment one = insideLimits(random, i % 2 == 0 ? Helix::kNone : Helix::kAny);
    one.spec.max_iterations = random.integer(1, 3);
    if (random.chance(0.5)) {
      one.spec.following = planning::Following::kTimed;
      one.spec.speed = 0.02;
    }
    for (const Method method : kHardLimits) {
      SCOPED_TRACE(std::string(control::name(method)) + ", arm " + std::to_string(i));
      const LeaderRun run(one.arms, one.spec, one.q, method, true);
      missed += run.progress.missed_points;
      EXPECT_LT(run.difference, 1e-5);
      EXPECT_LT(run.hidden, 2.0 * kPointTolerance);
    }
  }
  EXPECT_GT(missed, 20);
}

/// Where the path of the tip is given and the tubes do not follow it by themselves, the task keeps the shaft nearer to
/// it.
TEST(FollowTheLeader, KeepsTheShaftNearerToItsPath) {
  const Pair pair("rigid");
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  double all_with = 0.0, all_without = 0.0;
  for (const Method method : kHardLimits) {
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
