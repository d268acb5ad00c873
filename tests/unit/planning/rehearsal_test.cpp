// SPDX-License-Identifier: Apache-2.0
#include "planning/rehearsal.h"

#include <gtest/gtest.h>

#include <numbers>
#include <regex>

#include "kinematics/clearance.h"
#include "tests/unit/planning/arm_pair.h"

namespace tandem::test {
namespace {

using namespace planning;

/// Each method considers only one step of a task; a rehearsal reports where that fails.
TEST(Rehearsal, NamesWhatHoldsTheMethod) {
  Pair robot("rigid");
  robot.limits = limitsOf(arkArm(0.0), 5e-3, 1e-3);
  const safety::RobotVector start = home(robot.both);
  TrajectorySpec spec;
  spec.shape = Line{{0.0, 0.0, 0.2}};  // farther than the tubes can be extended
  spec.point_count = 20;
  for (const control::Method method : {control::Method::kNspqp, control::Method::kSnsqp}) {
    RehearsalOptions options;
    options.settings.method = method;
    options.arms = {"left", "right"};
    int shown = 0;
    options.progress = [&](int, int points) { shown += points == 20 ? 1 : 0; };
    const Rehearsal run = rehearse(robot.both, spec, start, {}, options);
    EXPECT_EQ(run.end, RehearsalEnd::kStalls);
    EXPECT_EQ(name(run.end), "method_stalls");
    EXPECT_EQ(shown, 20);
    EXPECT_GT(run.point, 1);
    EXPECT_EQ(run.converged, run.point - 1);
    ASSERT_FALSE(run.limits.empty());
    EXPECT_NE(run.reason.find("front travel limit of tube 1 of arm"), std::string::npos) << run.reason;
    options.cancelled = [] { return true; };
    EXPECT_EQ(rehearse(robot.both, spec, start, {}, options).end, RehearsalEnd::kCancelled);
  }
}

/// A point may be missed by a further task alone.
TEST(Rehearsal, NamesTheFurtherTaskThatIsMissed) {
  const Pair robot("rigid");
  TrajectorySpec spec;
  spec.shape = Line{{0.0, 5e-3, 5e-3}};
  spec.point_count = 20;
  FurtherTask turn;
  turn.kind = TaskKind::kTipOrientation;
  turn.priority = 2;
  turn.heading = Heading::kWaypoints;
  turn.waypoints = {{1.0, {0.0, 0.0, 0.7}}};
  turn.tolerance = 2.0 * std::numbers::pi / 180.0;
  spec.further = {turn};
  RehearsalOptions options;
  options.arms = {"left", "right"};
  const Rehearsal run = rehearse(robot.both, spec, home(robot.both), {}, options);
  ASSERT_EQ(run.end, RehearsalEnd::kStalls) << run.reason;
  EXPECT_LT(run.tip_error, spec.tolerance);
  EXPECT_TRUE(std::regex_search(run.reason, std::regex(R"(orientation of left [\d.]+ deg away \(tolerance 2\), )")))
      << run.reason;
}

/// A stability has no unit of length.
TEST(Rehearsal, NamesTheStabilityThatIsMissed) {
  const Pair robot("compliant");
  TrajectorySpec spec;
  spec.shape = Line{{0.0, 0.0, 2e-3}};
  spec.point_count = 2;
  FurtherTask stability;
  stability.kind = TaskKind::kElasticStability;
  stability.priority = 2;
  stability.target = {2.0, 0.0, 0.0};  // more than any arm has
  stability.tolerance = 1e-3;
  spec.further = {stability};
  RehearsalOptions options;
  options.arms = {"left", "right"};
  const Rehearsal run = rehearse(robot.both, spec, home(robot.both), {}, options);
  ASSERT_EQ(run.end, RehearsalEnd::kStalls) << run.reason;
  EXPECT_NE(run.reason.find(" stability away (tolerance 0.001), "), std::string::npos) << run.reason;
}

/// A rehearsal says how near the arms come on the way, also where they would pass through each other.
TEST(Rehearsal, SaysHowNearTheArmsCome) {
  const Pair robot("rigid");
  const safety::RobotVector start = home(robot.both);
  kinematics::Tip a, b;
  ASSERT_EQ(robot.a->tip(start.head(6), a), kinematics::ModelStatus::kOk);
  ASSERT_EQ(robot.b->tip(start.tail(6), b), kinematics::ModelStatus::kOk);
  double nearest = safety::kUnlimited;
  for (const double share : {0.1, 0.5, 1.0}) {
    TrajectorySpec spec;
    spec.other_arm = kNoArm;
    spec.shape = Line{share * (b.pose.translation() - a.pose.translation())};
    spec.point_count = 20;
    const Rehearsal run = rehearse(robot.both, spec, start, {}, {});
    ASSERT_FALSE(run.path.joints.empty()) << run.reason;
    double least = safety::kUnlimited;
    for (const RehearsedJoints& at : run.path.joints) {
      kinematics::Body bodies[2];
      kinematics::Branch branch;
      ASSERT_EQ(kinematics::makeBody(*robot.a, at.q.head(6), branch, false, bodies[0]), kinematics::ModelStatus::kOk);
      ASSERT_EQ(kinematics::makeBody(*robot.b, at.q.tail(6), branch, false, bodies[1]), kinematics::ModelStatus::kOk);
      least = std::min(least, kinematics::clearance(bodies[0], bodies[1]).distance);
    }
    EXPECT_DOUBLE_EQ(run.least_clearance, least);
    EXPECT_LT(run.least_clearance, nearest) << "the way to the other tip comes nearer the farther it goes";
    nearest = run.least_clearance;
  }
  EXPECT_LT(nearest, 0.0) << "the tips are at one place";
  EXPECT_EQ(rehearse(robot.one, {}, start.head(6), {}, {}).least_clearance, safety::kUnlimited);
}

/// Whatever the number of periods: the start, every stride-th period in order, and the end; never too many, never few
/// of many.
TEST(Rehearsal, ThePathIsEquallySpacedAndBounded) {
  for (int periods = 1; periods < 3000; periods += periods < 300 ? 1 : 97) {
    SCOPED_TRACE(periods);
    RehearsedPath path;
    const auto at = [](int period) { return RehearsedJoints{safety::RobotVector::Constant(2, period), period}; };
    for (int period = 0; period <= periods; ++period)
      path.add(period, at(period));
    path.finish(periods, at(periods));
    ASSERT_LE(path.joints.size(), RehearsedPath::kMost);
    EXPECT_GE(path.joints.size(),
              std::min<std::size_t>(static_cast<std::size_t>(periods) + 1, RehearsedPath::kMost / 2));
    for (std::size_t k = 0; k + 1 < path.joints.size(); ++k)
      EXPECT_EQ(path.joints[k].point, static_cast<int>(k) * path.stride);
    EXPECT_EQ(path.joints.back().q, at(periods).q);
  }
}

TEST(Rehearsal, RefusesWhatMakesNoSense) {
  const Pair robot("rigid");
  TrajectorySpec spec;
  spec.shape = Line{{0.0, 0.0, 0.01}};
  EXPECT_EQ(rehearse(robot.both, spec, safety::RobotVector::Zero(11), {}, {}).end, RehearsalEnd::kInvalid);
  const auto run = rehearse(robot.both, spec, home(robot.both), {home(robot.both)}, {});
  EXPECT_EQ(run.end, RehearsalEnd::kInvalid) << "one posture for a hundred points";
  EXPECT_NE(run.reason.find("found 1"), std::string::npos) << run.reason;
  spec.other_arm = 3;
  EXPECT_EQ(rehearse(robot.both, spec, home(robot.both), {}, {}).end, RehearsalEnd::kInvalid);
}

}  // namespace
}  // namespace tandem::test
