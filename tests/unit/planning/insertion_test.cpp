// SPDX-License-Identifier: Apache-2.0
#include "planning/insertion.h"

#include <gtest/gtest.h>

#include "planning/follower.h"
#include "planning/leader_path.h"
#include "planning/task_freedom.h"
#include "task_loop.h"

namespace tandem::test {
namespace {

using control::Method;
using Eigen::Vector3d;
using planning::Insertion;

constexpr int kRandomArms = 100, kPoints = 12;
constexpr double kCurved = 0.05;  // m, of every tube at its end

/** An arm of tubes that are curved over their last 50 mm, and an insertion: outer tubes first. */
struct Deployment {
  kinematics::ConcentricTubeArm arm;
  safety::ArmLimits limits;
  std::unique_ptr<kinematics::ArmModel> model;
  planning::Arms arms;
  safety::RobotVector q;
  planning::TrajectorySpec spec;

  /// Ends of all tubes 5 to 15 mm in front of the entry point, rotations at random or all alike.
  Deployment(Random& random, const char* kind, bool planar) : arm(arkArm(0.0)) {
    const int n = random.integer(2, 3);
    arm.tubes.resize(static_cast<std::size_t>(n));
    arm.base.linear() = Eigen::Quaterniond::UnitRandom().toRotationMatrix();
    arm.base.translation() = anyVector(random, 0.05);
    const double end = random.uniform(0.005, 0.015), turn = random.uniform(-3.0, 3.0);
    q.resize(2 * n);
    Insertion insertion;
    for (int i = 0; i < n; ++i) {
      kinematics::TubeSection& bend = arm.tubes[static_cast<std::size_t>(i)].sections.back();
      bend.curvature = random.uniform(2.0, 12.0) * (random.chance(0.5) ? 1.0 : -1.0);
      q[i] = end - arm.tubes[static_cast<std::size_t>(i)].length();
      q[n + i] = planar ? turn : random.uniform(-3.0, 3.0);
      insertion.stages.push_back({n - i, random.uniform(0.002, (kCurved - end) / n)});
    }
    limits = limitsOf(arm);
    model = kinematics::makeArmModel(kind, arm);
    arms = {{model.get()}, {&limits}};
    spec.other_arm = planning::kNoArm;
    spec.shape = insertion;
    spec.point_count = kPoints;
  }
  int tubes() const { return arm.tubeCount(); }
  Insertion& insertion() { return std::get<Insertion>(spec.shape); }
  /// The start and the points, one column each.
  Eigen::MatrixXd path() {
    planning::setInsertion(arms, q, spec);
    Eigen::MatrixXd path(q.size(), kPoints + 1);
    path.col(0) = q;
    for (int k = 0; k < kPoints; ++k)
      path.col(k + 1) = insertion().joints[static_cast<std::size_t>(k)];
    return path;
  }
  double deviation() { return planning::leaderDeviation(arms, 0, path()).distance; }
  double length(const Eigen::VectorXd& at) const { return at[0] + arm.tubes[0].length(); }
};

/// Position on the backbone of tubes with constant curvature in front of the entry point, in closed form: arcs of
/// circles between the ends of the tubes, u = sum EI_i kappa_i (-sin alpha_i, cos alpha_i, 0) / sum EI_i.
Vector3d onArcs(const kinematics::ConcentricTubeArm& arm, const Eigen::VectorXd& q, double s) {
  const int n = arm.tubeCount();
  Eigen::Isometry3d frame = arm.base;
  double from = 0.0;
  for (int present = n; present >= 1 && from < s; --present) {
    const double to = std::min(s, q[present - 1] + arm.tubes[static_cast<std::size_t>(present - 1)].length());
    Vector3d u = Vector3d::Zero();
    double stiffness = 0.0;
    for (int i = 0; i < present; ++i) {
      const kinematics::TubeSection& bend = arm.tubes[static_cast<std::size_t>(i)].sections.back();
      u += bend.bending_stiffness * bend.curvature * Vector3d(-std::sin(q[n + i]), std::cos(q[n + i]), 0.0);
      stiffness += bend.bending_stiffness;
    }
    u /= stiffness;
    const double piece = to - from, curvature = u.norm(), angle = curvature * piece;
    const Vector3d axis = u / curvature, z = Vector3d::UnitZ();
    Eigen::Isometry3d arc = Eigen::Isometry3d::Identity();
    arc.linear() = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
    arc.translation() = (std::sin(angle) * z + (1.0 - std::cos(angle)) * axis.cross(z)) / curvature;
    frame = frame * arc;
    from = to;
  }
  return frame.translation();
}

/// Largest distance of a point where the tip has been from the shaft, by many points of the shaft.
double deviationByPoints(const Deployment& of, const Eigen::MatrixXd& path) {
  constexpr int kMany = 4001;
  std::vector<Vector3d> leader;
  double largest = 0.0;
  for (Eigen::Index k = 0; k < path.cols(); ++k) {
    std::vector<kinematics::ShapePoint> shape;
    EXPECT_EQ(of.model->shape(path.col(k), kMany, shape), kinematics::ModelStatus::kOk);
    for (std::size_t i = 0; k == 0 && i < shape.size(); i += 40)
      leader.push_back(shape[i].pose.translation());
    leader.push_back(shape.back().pose.translation());
    for (const Vector3d& x : leader) {
      double nearest = 1.0;
      for (const auto& point : shape)
        nearest = std::min(nearest, (point.pose.translation() - x).norm());
      largest = std::max(largest, nearest);
    }
  }
  return largest;
}

/// Gilbert, Neimat & Webster 2015, circular case: at every point of the insertion the whole shaft is on the curve that
/// the arcs of circles of its end make, however the tubes are turned.
TEST(Insertion, OfCurvedTubesFollowsItsLeaderExactly) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int i = 0; i < kRandomArms; ++i) {
    Deployment one(random, "rigid", false);
    const Eigen::MatrixXd path = one.path();
    double away = 0.0;
    for (int k = 0; k <= kPoints; ++k) {
      const double length = one.length(path.col(k));
      std::vector<double> s;
      for (int j = 0; j <= 20; ++j)
        s.push_back(length * j / 20);
      kinematics::Branch branch;
      std::vector<kinematics::BackbonePoint> shaft;
      ASSERT_EQ(one.model->backbone(path.col(k), branch, s, false, shaft), kinematics::ModelStatus::kOk);
      for (const auto& point : shaft)
        away = std::max(away, (point.position - onArcs(one.arm, path.col(kPoints), point.s)).norm());
    }
    EXPECT_LT(away, 1e-12) << "arm " << i;
    EXPECT_LT(one.deviation(), 1e-9) << "arm " << i;
  }
}

/// What the conditions exclude leaves the path, by what many points of the shaft say: tubes that end apart but advance
/// together, inner ones before outer ones, a bend that moves in front of the entry point.
TEST(Insertion, OutsideTheConditionsLeavesItsPathAsSaid) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int i = 0; i < 9; ++i) {
    Deployment one(random, "rigid", false);
    if (i % 3 == 0) {
      one.q[0] += 0.02;
    } else if (i % 3 == 1) {
      std::ranges::reverse(one.insertion().stages);
    } else {
      one.q.head(one.tubes()).array() += kCurved;
    }
    const Eigen::MatrixXd path = one.path();
    const planning::LeaderDeviation said = planning::leaderDeviation(one.arms, 0, path);
    EXPECT_NEAR(said.distance, deviationByPoints(one, path), 1e-5) << "case " << i;
    EXPECT_GT(said.distance, 1e-6) << "case " << i;
    EXPECT_GT(said.point, 0);
  }
}

/// Elastic tubes twist each other unless they are bent in one plane.
TEST(Insertion, OfElasticTubesFollowsItsLeaderInOnePlaneOnly) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int i = 0; i < 20; ++i) {
    Deployment one(random, "compliant", true);
    for (kinematics::Tube& tube : one.arm.tubes)
      tube.sections.back().curvature = std::abs(tube.sections.back().curvature);
    one.model = kinematics::makeArmModel("compliant", one.arm);
    one.arms.models = {one.model.get()};
    EXPECT_LT(one.deviation(), 2e-8) << "arm " << i;
    one.q[one.tubes()] += 1.5;
    EXPECT_GT(one.deviation(), 2e-7) << "arm " << i;
  }
}

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

TEST(Insertion, RefusesTubesThatTheArmDoesNotHave) {
  Random random(1);
  Deployment one(random, "rigid", true);
  one.insertion().stages = {{one.tubes() + 1, 0.01}};
  EXPECT_THROW(planning::setInsertion(one.arms, one.q, one.spec), std::invalid_argument);
  one.insertion().stages = {{1, 0.01}};
  EXPECT_THROW(planning::sample(one.spec, {Vector3d::Zero(), Vector3d::Zero()}), std::invalid_argument)
      << "the joints at the start are not known";
  one.q[0] = -1.0;
  EXPECT_THROW(planning::setInsertion(one.arms, one.q, one.spec), std::invalid_argument) << "no solution of the model";
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
    Deployment one(random, "rigid", false);
    for (int tube = 0; tube < one.tubes(); ++tube)  // inside the limits, where ends of tubes do not coincide
      one.q[tube] -= 2e-4 * tube;
    one.spec.tolerance = 0.1e-3;
    for (const Method method : {Method::kNspqp, Method::kSnsqp, Method::kSns, Method::kHqp}) {
      SCOPED_TRACE(std::string(control::name(method)) + ", arm " + std::to_string(i));
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
