// SPDX-License-Identifier: Apache-2.0
#include "planning/inverse_kinematics.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>
#include <map>
#include <utility>

#include "kinematics/tube_model.h"
#include "tests/unit/kinematics/differences.h"
#include "tests/unit/planning/arm_pair.h"

namespace tandem::test {
namespace {

using namespace planning;

enum class Turned { kFree, kDirection, kOrientation };

/// Poses computed from known joints are reached, all but `may_miss` of them.
void reachKnown(const char* model, bool pair, Turned turned, std::uint32_t count, double may_miss = 0.0) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  const Pair robot(model);
  const Arms& arms = pair ? robot.both : robot.one;
  const InverseKinematics ik(arms);
  int done = 0, starts = 0, iterations = 0, missed = 0;
  while (std::cmp_less(done, count)) {
    safety::RobotVector q;
    std::vector<kinematics::Tip> tips;
    if (!robot.known(arms, random, q, tips))
      continue;
    ++done;
    std::vector<TipTarget> targets;
    for (int k = 0; k < arms.count(); ++k) {
      const Eigen::Isometry3d& pose = tips[static_cast<std::size_t>(k)].pose;
      targets.push_back({k, pose.translation(), {}});
      if (turned == Turned::kDirection)
        targets.back().direction = pose.linear().col(2);
      if (turned == Turned::kOrientation)
        targets.back().orientation = Eigen::Quaterniond(pose.linear());
    }
    const IkAnswer answer = ik.solve(targets, home(arms));
    starts += answer.starts;
    iterations += answer.iterations;
    missed += answer.reach == Reach::kReached ? 0 : 1;
    EXPECT_TRUE(answer.reach == Reach::kReached || may_miss > 0.0)
        << "case " << done << ": " << answer.reason << "; joints " << q.transpose();
    if (answer.reach == Reach::kReached)
      expectKept(arms, answer, targets);
  }
  std::printf("%d poses, %d missed, %.2f starts, %.1f iterations a pose\n", done, missed, 1.0 * starts / done,
              1.0 * iterations / done);
  EXPECT_LE(missed, may_miss * done);
}

TEST(InverseKinematics, ReachesRandomKnownTipsOfOneArm) { reachKnown("rigid", false, Turned::kFree, cases(200)); }
TEST(InverseKinematics, ReachesRandomKnownTipsOfThePair) { reachKnown("rigid", true, Turned::kFree, cases(60)); }
TEST(InverseKinematics, ReachesRandomKnownTipsWithDirections) {
  reachKnown("rigid", false, Turned::kDirection, cases(60));
}
/// Six conditions of six joints: a search may end beside the few joints that satisfy them.
TEST(InverseKinematics, ReachesMostRandomKnownPoses) {
  reachKnown("rigid", false, Turned::kOrientation, cases(60), 0.1);
}
TEST(InverseKinematics, ReachesRandomKnownTipsOfCompliantArms) {
  reachKnown("compliant", false, Turned::kFree, cases(30));
}

/// From joints nearby, as from point to point of a path.
TEST(InverseKinematics, ReachesPosesNearTheReference) {
  Random random(baseSeed());
  SCOPED_TRACE(trace(baseSeed()));
  const Pair robot("rigid");
  IkOptions options;
  options.local = true;
  const InverseKinematics ik(robot.one, options);
  int missed = 0, done = 0;
  while (std::cmp_less(done, cases(100))) {
    safety::RobotVector q;
    std::vector<kinematics::Tip> tips;
    if (!robot.known(robot.one, random, q, tips))
      continue;
    ++done;
    safety::RobotVector near = q;
    for (int j = 0; j < near.size(); ++j)
      near[j] += random.uniform(-0.02, 0.02) * PoseProblem::unit(robot.one, j);
    TipTarget target{0, tips[0].pose.translation(), {}};
    target.orientation = Eigen::Quaterniond(tips[0].pose.linear());
    const IkAnswer answer = ik.solve({target}, near);
    missed += answer.reach == Reach::kReached ? 0 : 1;
    if (answer.reach == Reach::kReached)
      expectKept(robot.one, answer, {target});
  }
  std::printf("%d of %d poses near the reference were missed\n", missed, done);
  EXPECT_LE(missed, done / 20);
}

/// A tip turned by half a turn, which points back to the entry point: the answer says how far it is from both.
TEST(InverseKinematics, SaysByHowMuchAPoseIsMissed) {
  const Pair robot("rigid");
  const InverseKinematics ik(robot.one);
  kinematics::Tip tip;
  ASSERT_EQ(robot.a->tip(home(robot.one), tip), kinematics::ModelStatus::kOk);
  TipTarget target{0, tip.pose.translation(), {}};
  target.orientation = Eigen::Quaterniond(tip.pose.linear() * Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  const IkAnswer answer = ik.solve({target}, home(robot.one));
  ASSERT_NE(answer.reach, Reach::kReached);
  ASSERT_EQ(answer.angle.size(), 1u);
  ASSERT_EQ(robot.a->tip(answer.q, tip), kinematics::ModelStatus::kOk);
  EXPECT_GT(answer.angle[0], 0.1);
  EXPECT_NEAR(answer.angle[0],
              Eigen::AngleAxisd(tip.pose.linear().transpose() * target.orientation->toRotationMatrix()).angle(), 1e-9);
  EXPECT_NE(answer.reason.find(" degrees "), std::string::npos) << answer.reason;
  target.orientation->coeffs() *= 2.0;
  EXPECT_EQ(ik.solve({target}, home(robot.one)).reach, Reach::kInvalid);
}

TEST(InverseKinematics, RefusesTipsOutsideTheWorkspaceWithTheNearestOne) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  const Pair robot("rigid");
  const InverseKinematics ik(robot.one);
  std::map<Reach, int> reasons;
  double most = 0.0;
  for (std::uint32_t done = 0; done < cases(30); ++done) {
    // No arm is longer than 437 mm.
    const Eigen::Vector3d direction(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    const Eigen::Vector3d far = Eigen::Vector3d(0, 0.005, 0) + direction.normalized() * random.uniform(0.438, 0.6);
    const IkAnswer answer = ik.solve({{0, far, {}}}, home(robot.one));
    ++reasons[answer.reach];
    ASSERT_TRUE(answer.reach == Reach::kOutsideWorkspace || answer.reach == Reach::kLimits)
        << name(answer.reach) << " " << far.transpose();
    EXPECT_FALSE(answer.reason.empty());
    EXPECT_LE(safety::largestViolation(robot.limits, answer.q), 1e-9);
    double nearer = 0.0;  // no permitted configuration, near or far, is nearer
    for (int k = 0; k < 3000; ++k) {
      safety::ArmVector q = randomInside(robot.limits, random);
      if (k % 2 == 0) {  // in a neighbourhood
        const double blend = std::pow(10.0, random.uniform(-6, 0));
        q = answer.q + blend * (q - answer.q);
      }
      kinematics::Tip tip;
      if (robot.a->tip(q, tip) != kinematics::ModelStatus::kOk)
        continue;
      nearer = std::max(nearer, answer.error[0] - (tip.pose.translation() - far).norm());
    }
    EXPECT_LT(nearer, 1e-6) << far.transpose();
    most = std::max(most, nearer);
  }
  std::printf("nothing nearer by more than %.2g m\n", most);
  for (const auto& [reason, count] : reasons)
    std::printf("%s: %d\n", std::string(name(reason)).c_str(), count);
}

/// Gradients of the objective and of every constraint compared with differences, and the Hessian with those of the
/// gradients.
void checkDerivatives(const char* model, bool nearest, int count) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  const Pair robot(model);
  int checked = 0, kinks = 0;
  for (int done = 0; done < count;) {
    safety::RobotVector q, other;
    std::vector<kinematics::Tip> tips, there;
    if (!robot.known(robot.both, random, q, tips) || !robot.known(robot.both, random, other, there))
      continue;
    ++done;
    PoseProblem problem{&robot.both, {}, other, {}, nearest, nearest && done % 2 == 0, {0.1, 1e-3, {}, 1e-3}};
    problem.demands.port.emplace().radius = 8e-3;
    for (int k = 0; k < 2; ++k)
      problem.targets.push_back({k, there[static_cast<std::size_t>(k)].pose.translation(), Eigen::Vector3d::UnitZ()});
    problem.targets[1].orientation = Eigen::Quaterniond(there[1].pose.linear());
    const PosePoint here = evaluate(problem, q);
    ASSERT_TRUE(here.answered);
    if (here.constraints.tail(3).minCoeff() < -0.15)
      continue;  // the backbones cross: their distance has no gradient
    for (int j = 0; j < q.size(); ++j) {
      const double unit = PoseProblem::unit(robot.both, j);
      const auto at = [&](double h) {
        safety::RobotVector moved = q;
        moved[j] += h * unit;
        return evaluate(problem, moved);
      };
      const auto difference = [&](const auto& part) {
        return differentiate(
            [&](double h) -> Eigen::VectorXd {
              const PosePoint point = at(h);
              return point.answered ? part(point) : Eigen::VectorXd();
            },
            1e-4);
      };
      const auto objective = difference([](const PosePoint& p) { return Eigen::VectorXd::Constant(1, p.objective); });
      if (objective.error < 1e-6 * std::max(1.0, here.objective)) {
        EXPECT_NEAR(objective.value[0], here.gradient[j], 1e-5 * std::max(1.0, here.objective));
      }
      for (Eigen::Index row = 0; row < here.constraints.size(); ++row) {
        const auto one =
            difference([row](const PosePoint& p) { return Eigen::VectorXd(p.constraints.segment(row, 1)); });
        const double scale = std::max(1.0, std::abs(here.jacobian(row, j)));
        ++(one.error < 1e-6 * scale ? checked : kinks);
        if (one.error >= 1e-6 * scale)
          continue;
        EXPECT_NEAR(one.value[0], here.jacobian(row, j), 2e-5 * scale)
            << "row " << row << " joint " << j << " kind " << static_cast<int>(here.names[row].kind);
      }
    }
  }
  EXPECT_GT(checked, 2 * kinks) << "most differences can be trusted";
}

TEST(PoseProblem, DerivativesOfRigidArmsAreThoseOfDifferences) {
  checkDerivatives("rigid", false, 4);
  checkDerivatives("rigid", true, 4);
}
TEST(PoseProblem, DerivativesOfCompliantArmsAreThoseOfDifferences) { checkDerivatives("compliant", true, 1); }

/// The clearance of an answer is that of the nearest pair, in whatever order the arms stand.
TEST(InverseKinematics, ClearanceIsThatOfTheNearestPair) {
  const Pair robot("rigid");
  const auto far = kinematics::makeArmModel("rigid", arkArm(0.2));
  const safety::RobotVector own = home(robot.both);
  const auto clearance_of = [&](std::vector<const kinematics::ArmModel*> models) {
    const Arms arms{std::move(models), std::vector<const safety::ArmLimits*>(3, &robot.limits)};
    safety::RobotVector q(18);
    q << own.head(6), own.head(6), own.head(6);
    IkOptions options;
    options.demands.clearance = -1.0;  // m: always met
    kinematics::Tip tip;
    EXPECT_EQ(arms.models[0]->tip(q.head(6), tip), kinematics::ModelStatus::kOk);
    const IkAnswer answer = InverseKinematics(arms, options).judge({{0, tip.pose.translation(), {}}}, q, {});
    EXPECT_EQ(answer.reach, Reach::kReached);
    return answer.clearance;
  };
  const double near = clearance_of({far.get(), robot.a.get(), robot.b.get()});
  EXPECT_LT(near, 0.01) << "bases of a and b are 10 mm apart";
  EXPECT_NEAR(clearance_of({robot.a.get(), robot.b.get(), far.get()}), near, 1e-12);
}

TEST(InverseKinematics, KeepsTheArmsApart) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  const Pair robot("rigid");
  IkOptions options;
  options.demands.clearance = 2e-3;
  const InverseKinematics free(robot.both), apart(robot.both, options);
  int touching = 0, reached = 0;
  for (std::uint32_t done = 0; done < cases(16); ++done) {
    safety::RobotVector q;
    std::vector<kinematics::Tip> tips;
    if (!robot.known(robot.both, random, q, tips))
      continue;
    // Tip b is to be close to tip a: the arms often have to go around each other, or cannot reach it.
    const Eigen::Vector3d p = tips[0].pose.translation(), aside(0.0, -random.uniform(3e-3, 10e-3), 5e-3);
    const std::vector<TipTarget> targets{{0, p, {}}, {1, p + aside, {}}};
    if (free.solve(targets, home(robot.both)).reach != Reach::kReached)
      continue;
    const IkAnswer answer = apart.solve(targets, home(robot.both));
    if (answer.q.size() == 0 || answer.tips.empty())
      continue;
    kinematics::Body a, b;
    kinematics::Branch branch;
    ASSERT_EQ(makeBody(*robot.a, answer.q.head(6), branch, false, a), kinematics::ModelStatus::kOk);
    ASSERT_EQ(makeBody(*robot.b, answer.q.tail(6), branch, false, b), kinematics::ModelStatus::kOk);
    EXPECT_GT(clearance(a, b).distance, 2e-3 - 2e-6) << name(answer.reach);
    touching += answer.reach == Reach::kArmsTouch;
    reached += answer.reach == Reach::kReached;
    EXPECT_TRUE(answer.reach == Reach::kReached || answer.reach == Reach::kArmsTouch) << name(answer.reach);
  }
  std::printf("%d reached apart, %d refused\n", reached, touching);
  EXPECT_GT(reached, 0);
}

TEST(InverseKinematics, KeepsCompliantArmsStable) {
  const Pair soft("compliant");
  // All tubes curved over a larger part of their length: opposed ones may snap.
  auto arm = arkArm(0.0);
  for (kinematics::Tube& tube : arm.tubes) {
    tube.sections[0].length -= 0.1;
    tube.sections[1].length += 0.1;
  }
  const auto model = kinematics::makeArmModel("compliant", arm);
  const Arms arms{{model.get()}, {&soft.limits}};
  IkOptions options;
  options.demands.stability = 0.7;
  options.starts = 4;
  const InverseKinematics ik(arms, options);
  Random random(baseSeed());
  SCOPED_TRACE(trace(baseSeed()));
  int weak = 0, reached = 0, refused = 0;
  for (int done = 0; done < 400 && weak < 6; ++done) {
    const Eigen::VectorXd q = randomInside(soft.limits, random);
    kinematics::Tip tip;
    if (model->tip(q, tip) != kinematics::ModelStatus::kOk || tip.conjugate_points > 0 || tip.stability > 0.6)
      continue;
    ++weak;
    const IkAnswer answer = ik.solve({{0, tip.pose.translation(), {}}}, q);
    reached += answer.reach == Reach::kReached;
    refused += answer.reach == Reach::kUnstable;
    if (!answer.tips.empty()) {
      EXPECT_GT(answer.stability, 0.7 - 2e-6) << name(answer.reach) << " " << answer.reason;
    }
  }
  std::printf("%d weak poses: %d reached otherwise, %d refused\n", weak, reached, refused);
  EXPECT_GT(weak, 2);
  EXPECT_GT(reached, 0);
}

TEST(InverseKinematics, GivesTheSameAnswerForTheSameSeedAndCanBeCancelled) {
  const Pair robot("rigid");
  const Eigen::Vector3d far(0.1, 0.2, 0.6);
  IkOptions options;
  const IkAnswer first = InverseKinematics(robot.one, options).solve({{0, far, {}}}, home(robot.one));
  const IkAnswer second = InverseKinematics(robot.one, options).solve({{0, far, {}}}, home(robot.one));
  EXPECT_EQ(first.q, second.q);
  EXPECT_EQ(first.reason, second.reason);
  int asked = 0;
  options.cancelled = [&asked] { return ++asked > 3; };
  const IkAnswer stopped = InverseKinematics(robot.one, options).solve({{0, far, {}}}, home(robot.one));
  EXPECT_EQ(stopped.reach, Reach::kCancelled);
  EXPECT_LT(stopped.iterations, 10);
  const Eigen::Vector3d nan(0, 0, std::nan(""));
  EXPECT_EQ(InverseKinematics(robot.one).solve({{0, nan, {}}}, home(robot.one)).reach, Reach::kInvalid);
  EXPECT_EQ(InverseKinematics(robot.one).solve({{3, far, {}}}, home(robot.one)).reach, Reach::kInvalid);
}

}  // namespace
}  // namespace tandem::test
