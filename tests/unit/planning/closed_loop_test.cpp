// SPDX-License-Identifier: Apache-2.0
/** @file Random tasks in closed loop, compared with the result of plan check. */
#include <gtest/gtest.h>

#include <map>

#include "control/detail/active_set.h"
#include "kinematics/clearance.h"
#include "planning/feasibility.h"
#include "planning/rehearsal.h"
#include "tests/unit/planning/arm_pair.h"

namespace tandem::test {
namespace {

using namespace planning;

/// Joints inside the limits; sometimes all tubes of both arms in one plane.
safety::RobotVector anyStart(const Pair& robot, Random& random) {
  safety::RobotVector q(12);
  q << randomInside(robot.limits, random), randomInside(robot.limits, random);
  if (random.chance(0.2)) {
    q.segment(3, 3).setConstant(q[3]);
    q.tail(3).setConstant(q[9]);
  }
  return q;
}

TrajectorySpec anyTask(Random& random) {
  const Eigen::Vector3d displacement =
      0.02 * Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
  TrajectorySpec spec;
  spec.name = "random";
  spec.point_count = 10;
  if (random.chance(0.5))
    spec.shape = Line{displacement};
  else
    spec.shape = Circle{0.5 * displacement, displacement.unitOrthogonal(), 1.0};
  return spec;
}

/** First-order optimality residual of a nearest pose. With F the square of the tips' errors that the point's
 * relative position leaves free, u the joints' units and y = (mu, lambda >= 0),
 *
 *   min_y |u (grad F + J_AB^T mu + sum over active limits lambda_i a_i)| / |u grad F|. */
struct Nearest {
  double with_limits = 0.0, without = 0.0;
  int active = 0;
};

Nearest judgeNearest(const Pair& robot, const PointReport& point) {
  constexpr double kStandsAt = 1e-5;
  kinematics::Tip a, b;
  robot.a->tip(point.q.head(6), a);
  robot.b->tip(point.q.tail(6), b);
  Eigen::MatrixXd Ja = Eigen::MatrixXd::Zero(3, 12), Jb = Ja;
  Ja.leftCols(6) = a.jacobian.topRows<3>();
  Jb.rightCols(6) = b.jacobian.topRows<3>();
  Eigen::VectorXd unit(12);
  for (int j = 0; j < 12; ++j)
    unit[j] = PoseProblem::unit(robot.both, j);
  const Eigen::Vector3d r_a = a.pose.translation() - point.wanted.tip;
  const Eigen::Vector3d r_b = b.pose.translation() - (point.wanted.tip - point.wanted.relative);
  const bool kept = (r_a - r_b).norm() < 1e-5;
  Eigen::VectorXd pull = Ja.transpose() * r_a;
  if (!kept)
    pull += Jb.transpose() * r_b;
  pull = unit.cwiseProduct(pull);
  std::vector<Eigen::VectorXd> columns, active;
  for (int i = 0; kept && i < 3; ++i)
    columns.push_back(unit.cwiseProduct((Ja - Jb).row(i).transpose()));
  for (int arm = 0; arm < 2; ++arm) {
    for (int j = 0; j < 6; ++j) {
      const double q = point.q[6 * arm + j];
      const auto& joint = robot.limits.joints[static_cast<std::size_t>(j)];
      if (joint.upper - q < kStandsAt)
        active.push_back(unit[6 * arm + j] * Eigen::VectorXd::Unit(12, 6 * arm + j));
      if (q - joint.lower < kStandsAt)
        active.push_back(-unit[6 * arm + j] * Eigen::VectorXd::Unit(12, 6 * arm + j));
    }
    for (const safety::LinearRow& row : robot.limits.rows) {
      if (row.b - row.a.dot(point.q.segment(6 * arm, 6)) > kStandsAt)
        continue;
      Eigen::VectorXd column = Eigen::VectorXd::Zero(12);
      column.segment(6 * arm, 6) = row.a;
      active.push_back(unit.cwiseProduct(column));
    }
  }
  const auto residual = [&](bool limits) {
    std::vector<Eigen::VectorXd> all = columns;
    if (limits)
      all.insert(all.end(), active.begin(), active.end());
    if (all.empty())
      return 1.0;
    const int n = static_cast<int>(all.size());
    Eigen::MatrixXd M(12, n);
    for (int k = 0; k < n; ++k)
      M.col(k) = all[static_cast<std::size_t>(k)].normalized();
    control::QuadraticProgram qp;
    qp.resize(n, 0, 0);
    qp.H = M.transpose() * M;
    qp.H.diagonal().array() += 1e-12;
    const Eigen::VectorXd direction = pull.normalized();
    qp.g = M.transpose() * direction;
    qp.lower.tail(n - static_cast<int>(columns.size())).setZero();
    control::QpSolution solution;
    control::ActiveSet().solve(qp, solution);
    return solution.status == control::QpStatus::kSolved ? (direction + M * solution.x).norm() : 1.0;
  };
  return {residual(true), residual(false), static_cast<int>(active.size())};
}

/// A kink of the rigid model nearby: a small change of a translation changes the Jacobian significantly.
bool atKink(const Pair& robot, const PointReport& point) {
  constexpr double kAside = 1e-4, kJump = 1e-2;
  for (int arm = 0; arm < 2; ++arm) {
    kinematics::Tip here, there;
    const auto& model = arm == 0 ? *robot.a : *robot.b;
    Eigen::VectorXd q = point.q.segment(6 * arm, 6);
    if (model.tip(q, here) != kinematics::ModelStatus::kOk)
      return true;
    for (int j = 0; j < 3; ++j) {
      for (const double side : {-kAside, kAside}) {
        q[j] += side;
        if (model.tip(q, there) == kinematics::ModelStatus::kOk &&
            (there.jacobian - here.jacobian).topRows<3>().norm() > kJump * here.jacobian.topRows<3>().norm())
          return true;
        q[j] -= side;
      }
    }
  }
  return false;
}

/** Checks the reason given for a point independently. @return contradiction; empty if none is found. */
std::string refute(const Pair& robot, const PointReport& point) {
  if (point.reason.empty())
    return "a refusal without words";
  for (int arm = 0; arm < 2; ++arm) {
    if (safety::largestViolation(robot.limits, point.q.segment(6 * arm, 6)) > 1e-7)
      return "the nearest pose is outside the limits";
  }
  if (point.reach == Reach::kReconfiguration) {
    const InverseKinematics inverse(robot.both);
    const auto answer =
        inverse.solve({{0, point.wanted.tip, {}}, {1, point.wanted.tip - point.wanted.relative, {}}}, point.q);
    return answer.reach == Reach::kReached || answer.largestError() < 1e-5 ? "" : "no other configuration gets there";
  }
  constexpr double kSmall = 2e-2;
  const Nearest nearest = judgeNearest(robot, point);
  if (point.reach == Reach::kLimits) {
    if (nearest.active == 0)
      return "no limit is active at the nearest pose";
    if (nearest.without < 1e-6)
      return "no limit holds the nearest pose";
    return nearest.with_limits < kSmall || atKink(robot, point) ? "" : "the nearest pose is not one at first order";
  }
  if (point.reach == Reach::kOutsideWorkspace)
    return nearest.without < kSmall || atKink(robot, point) ? ""
                                                            : "the edge of the workspace is not one at first order";
  return "reason " + std::string(name(point.reach));
}

struct Counts {
  int tasks = 0, feasible = 0, planar = 0, refused = 0, refuted = 0, refused_completed = 0;
  std::map<std::string, int> completed, without_posture, reasons;
};

void expectSafe(const Rehearsal& run, control::Method method) {
  EXPECT_LT(run.largest_violation, 1e-9) << control::name(method);
  EXPECT_LE(run.fastest_rotation, control::MethodParameters{}.rotation_velocity + 1e-9) << control::name(method);
  EXPECT_TRUE(run.end == RehearsalEnd::kCompleted || !run.reason.empty());
}

/// Every task completes with its plan, or is refused beforehand with a correct reason. No limit is violated.
TEST(ClosedLoop, EveryTaskConvergesWithItsPlanOrIsRefusedWithTheRightReason) {
  Pair robot("rigid");
  robot.limits = limitsOf(arkArm(0.0), 5e-3, 1e-3);
  Counts n;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(8); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const safety::RobotVector start = anyStart(robot, random);
    const TrajectorySpec spec = anyTask(random);
    kinematics::Tip tip;
    if (robot.a->tip(start.head(6), tip) != kinematics::ModelStatus::kOk ||
        robot.b->tip(start.tail(6), tip) != kinematics::ModelStatus::kOk)
      continue;  // all tubes withdrawn behind the entry point: no tip
    FeasibilityOptions check;
    check.stop_after = 1;
    check.ik.starts = 3;  // a refusal is checked independently
    const FeasibilityReport report = checkTrajectory(robot.both, spec, start, check);
    ++n.tasks;
    n.planar += report.planar_start ? 1 : 0;
    (report.feasible ? n.feasible : n.refused) += 1;
    bool any_completed = false;
    for (int m = 0; m < control::kMethodCount; ++m) {
      RehearsalOptions options;
      options.settings.method = static_cast<control::Method>(m);
      const bool sure = options.settings.method == control::Method::kNspqp;
      const bool exact = sure || options.settings.method == control::Method::kSnsqp;
      const std::string method(control::name(options.settings.method));
      if (report.feasible) {
        const Rehearsal with = rehearse(robot.both, spec, start, report.path(), options);
        expectSafe(with, options.settings.method);
        n.completed[method] += with.end == RehearsalEnd::kCompleted ? 1 : 0;
        EXPECT_TRUE(!sure || with.end == RehearsalEnd::kCompleted) << with.reason;
        if (exact && with.end != RehearsalEnd::kCompleted)
          std::printf("seed %u feasible, yet %s\n", seed, with.reason.c_str());
      }
      const Rehearsal without = rehearse(robot.both, spec, start, {}, options);
      expectSafe(without, options.settings.method);
      n.without_posture[method] += report.feasible && without.end == RehearsalEnd::kCompleted ? 1 : 0;
      any_completed = any_completed || (exact && without.end == RehearsalEnd::kCompleted);
    }
    if (report.feasible)
      continue;
    const PointReport& last = report.points.back();
    n.reasons[std::string(name(last.reach))] += 1;
    const std::string against = refute(robot, last);
    if (!against.empty()) {
      ++n.refuted;
      std::printf("seed %u: %s: point %d, %s, %.3g mm: %s\n", seed, against.c_str(), last.point,
                  std::string(name(last.reach)).c_str(), 1e3 * std::max(last.error, last.relative_error),
                  last.reason.c_str());
    }
    if (any_completed) {
      ++n.refused_completed;
      std::printf("seed %u refused, yet within the tolerance: point %d, %s, %.3g mm\n", seed, last.point,
                  std::string(name(last.reach)).c_str(), 1e3 * std::max(last.error, last.relative_error));
    }
  }
  std::printf("%d tasks, %d planar: %d feasible, %d refused (%d refuted, %d within the tolerance of a run)\n", n.tasks,
              n.planar, n.feasible, n.refused, n.refuted, n.refused_completed);
  for (const auto& [reason, count] : n.reasons)
    std::printf("  refused for %s: %d\n", reason.c_str(), count);
  for (const auto& [method, count] : n.completed)
    std::printf("  %s: %d of the feasible with the planned posture, %d without\n", method.c_str(), count,
                n.without_posture[method]);
  EXPECT_GT(n.feasible, 0);
  // snsqp first maximises its scale, however small, before it follows the posture, and rotates at 0.5 rad/s: some
  // points take longer than their iterations. plan check --method predicts this.
  EXPECT_LE(50 * (n.feasible - n.completed["snsqp"]), n.feasible);
  // Where the rigid model's Jacobian jumps, a nearest pose need not satisfy the first-order conditions.
  EXPECT_LE(20 * n.refuted, n.refused);
}

/// One task in closed loop: of a robot with one arm, and of one arm of a pair, whose other arm has no task.
TEST(ClosedLoop, ATipAloneIsTracked) {
  int feasible = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(12); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const Pair robot("rigid");
    TrajectorySpec spec = anyTask(random);
    spec.other_arm = kNoArm;
    const safety::RobotVector start = anyStart(robot, random);
    FeasibilityOptions options;
    const FeasibilityReport one = checkTrajectory(robot.one, spec, start.head(6), options);
    const FeasibilityReport both = checkTrajectory(robot.both, spec, start, options);
    if (!both.start.empty())
      continue;
    EXPECT_EQ(one.feasible, both.feasible) << "the other arm matters";
    if (!one.feasible || one.planar_start)
      continue;
    ++feasible;
    for (const control::Method method :
         {control::Method::kNspqp, control::Method::kSnsqp, control::Method::kSns, control::Method::kHqp}) {
      RehearsalOptions rehearsal;
      rehearsal.settings.method = method;
      for (const Arms* arms : {&robot.one, &robot.both}) {
        const Rehearsal run = rehearse(*arms, spec, start.head(arms->jointCount()), {}, rehearsal);
        EXPECT_EQ(run.end, RehearsalEnd::kCompleted) << name(method) << ": " << run.reason;
        kinematics::Tip tip;
        ASSERT_EQ(robot.a->tip(run.q.head(6), tip), kinematics::ModelStatus::kOk);
        EXPECT_EQ(run.path.joints.front().q, start.head(arms->jointCount()));
        EXPECT_EQ(run.path.joints.back().q, run.q);
        EXPECT_LE((tip.pose.translation() - one.points.back().wanted.tip).norm(), spec.tolerance) << name(method);
        // hqp's last level moves all joints away from their limits.
        if (arms == &robot.both && method != control::Method::kHqp) {
          EXPECT_LT((run.q.tail(6) - start.tail(6)).norm(), 1e-9) << name(method);
        }
      }
    }
  }
  EXPECT_GE(feasible, static_cast<int>(cases(12)) / 4);
}

}  // namespace
}  // namespace tandem::test
