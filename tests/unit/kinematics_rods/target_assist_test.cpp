// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "kinematics/assist/target_assist.h"
#include "tests/unit/kinematics/differences.h"
#include "tests/unit/kinematics_rods/random_rods.h"
#include "tests/unit/kinematics_rods/two_rods_oracle.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using kinematics::assist::Chain;
using kinematics::assist::ChainBranch;
using kinematics::assist::Joints;
using kinematics::assist::Pair;
using kinematics::assist::Status;
using kinematics::assist::TargetAssist;
using kinematics::catheter::Actuation;
using kinematics::catheter::ElasticArm;
using kinematics::cosserat::Matrix6;
using kinematics::grasp::ContactType;

ElasticArm anyElastic(Random& random) {
  ElasticArm arm;
  arm.arm.bending_length = random.uniform(0.03, 0.06);
  arm.arm.tool.translation().z() = random.uniform(0.0, 0.008);
  const double diameter = random.uniform(2e-3, 2.8e-3);
  arm.proximal = kinematics::cosserat::tubeSection(0.1, diameter, 0.5 * diameter, random.uniform(0.3e9, 2e9), 0.4);
  arm.distal = kinematics::cosserat::tubeSection(0.1, diameter, 0.5 * diameter, random.uniform(0.1e9, 0.5e9), 0.4);
  arm.actuation = Actuation::kTension;  // that of the oracle
  return arm;
}

/** A target, and an assist arm that touches the start of its bending section from the side without a force. */
struct Meeting {
  explicit Meeting(Random& random, ContactType type = ContactType::kRigid) {
    pair.target = anyElastic(random);
    pair.assist = anyElastic(random);
    pair.type = type;
    pair.target.arm.base = anyPose(random);
    q << random.uniform(0.08, 0.15), random.uniform(-3.0, 3.0), random.uniform(-2.0, 2.0),  //
        random.uniform(0.03, 0.08), random.uniform(-3.0, 3.0), random.uniform(-1.0, 1.0);
    // The assist arm's base is such that its free tip is at the start of the bending section and points into it from
    // the side.
    Isometry3d tip = pair.target.arm.base * Eigen::Translation3d(0.0, 0.0, q[0]) *
                     Eigen::AngleAxisd(random.uniform(-3.0, 3.0), Vector3d::UnitZ()) *
                     Eigen::AngleAxisd(random.uniform(0.6, 1.6), Vector3d::UnitY());
    pair.contact.setIdentity();
    const Isometry3d free = TargetAssist::touching(pair, q);  // in the frame at the start of the bending section, for a
                                                              // base at the origin
    const Isometry3d bending_base = pair.target.arm.base * Eigen::Translation3d(0.0, 0.0, q[0]);
    pair.assist.arm.base = tip * (bending_base * free).inverse();
    pair.contact = TargetAssist::touching(pair, q);
  }
  /// Joints that advance the assist arm by up to `most` m, and bend both.
  Joints pushed(Random& random, double most) const {
    Joints there = q;
    there[3] += random.uniform(0.1, 1.0) * most;
    there[2] += random.uniform(-1.0, 1.0);
    there[5] += 20.0 * most * random.uniform(-1.0, 1.0);
    return there;
  }
  Pair pair;
  Joints q;
};

TEST(TargetAssist, TouchingArmsHaveNoForceAndTheTargetIsAlone) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(60); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const Meeting meeting(random);
    const TargetAssist model(meeting.pair);
    ChainBranch branch;
    Chain chain;
    const Status status = model.solve(meeting.q, branch, chain);
    ASSERT_TRUE(status == Status::kOk || std::abs(chain.push) < 1e-9) << describe(status);
    EXPECT_LT(chain.wrench.norm(), 1e-7);
    EXPECT_LT(poseDifference(chain.tip.pose, model.alone(meeting.q).pose).norm(), 1e-8);
  }
}

/// Contact closed within 1e-8 m, and agreement with an independent solution of two complete rods.
TEST(TargetAssist, AgreesWithTwoRodsSolvedTogether) {
  int compared = 0;
  double worst = 0.0, widest = 0.0, farthest = 0.0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(60); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const Meeting meeting(random, random.chance(0.5) ? ContactType::kRigid : ContactType::kPoint);
    const TargetAssist model(meeting.pair);
    const Joints q = meeting.pushed(random, 0.015);
    ChainBranch branch;
    Chain chain;
    const Status status = model.solve(q, branch, chain);
    if (status != Status::kOk)
      continue;
    EXPECT_LT(chain.gap, 1e-8);
    EXPECT_LT(chain.turn, 1e-8);
    const TwoRodsOracle oracle(meeting.pair, q, branch);
    EXPECT_LT(oracle.gap, 1e-8) << "contact of the other solution";
    EXPECT_LT((oracle.force_on_target + oracle.force_on_assist).norm(), 1e-8 * (1.0 + oracle.force_on_target.norm()));
    // Action and reaction, from each rod's own end, for the chain's solution.
    EXPECT_LT((oracle.force_on_target - chain.wrench).norm(), 1e-5 * (1e-3 + chain.wrench.norm()));
    const double distance = (oracle.tip.translation() - chain.tip.pose.translation()).norm();
    EXPECT_LT(distance, 1e-7);
    worst = std::max(worst, distance);
    widest = std::max(widest, chain.gap);
    farthest = std::max(farthest, (chain.tip.pose.translation() - model.alone(q).pose.translation()).norm());
    ++compared;
  }
  std::printf("compared %d, tips within %.1e m, contact within %.1e m, assisted by up to %.1f mm\n", compared, worst,
              widest, 1e3 * farthest);
  EXPECT_GT(compared, 15);
  EXPECT_GT(farthest, 3e-3);
}

TEST(TargetAssist, JacobianIsTheDerivativeOfTheClosedChain) {
  int compared = 0;
  double worst = 0.0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(60); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Meeting meeting(random, random.chance(0.5) ? ContactType::kRigid : ContactType::kPoint);
    meeting.pair.pushes_only = false;
    meeting.pair.assist.actuation = seed % 2 ? Actuation::kDisplacement : Actuation::kTension;
    meeting.pair.assist.wire_elasticity = 0.1 * (seed % 3);
    const TargetAssist model(meeting.pair);
    Joints q = meeting.pushed(random, 0.01);
    if (random.chance(0.3))
      q[2] = 0.0;  // straight
    ChainBranch branch;
    Chain chain;
    if (model.solve(q, branch, chain) != Status::kOk)
      continue;
    for (int j = 0; j < 6; ++j) {
      const Difference difference = differentiate(
          [&](double h) -> Eigen::VectorXd {
            ChainBranch there = branch;
            Chain moved;
            if (model.solve(q + h * Joints::Unit(j), there, moved) != Status::kOk)
              return {};
            Eigen::VectorXd both(12);
            both << poseDifference(chain.tip.pose, moved.tip.pose), moved.wrench - chain.wrench;
            return both;
          },
          j % 3 == 0 ? 1e-3 : 0.05);
      if (difference.value.size() == 0)
        continue;
      const Eigen::VectorXd tip = difference.value.head<6>(), wrench = difference.value.tail<6>();
      if (!(difference.error < 3e-7 * std::max(1.0, difference.value.norm())))
        continue;
      EXPECT_LT((tip - chain.tip.jacobian.col(j)).norm(), 1e-6 * std::max(1.0, tip.norm())) << "joint " << j;
      EXPECT_LT((wrench - chain.wrench_by_joints.col(j)).norm(), 1e-6 * std::max(1.0, wrench.norm())) << "joint " << j;
      worst = std::max(worst, (tip - chain.tip.jacobian.col(j)).norm() / std::max(1.0, tip.norm()));
      ++compared;
    }
  }
  std::printf("compared %d, worst %.1e\n", compared, worst);
  EXPECT_GT(compared, 150);
}

/// Tracked solutions equal those of a cold start, and a distant guess leads to the same solution or is refused.
TEST(TargetAssist, GuessesDoNotDecideTheAnswer) {
  int compared = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(40); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const Meeting meeting(random);
    const TargetAssist model(meeting.pair);
    const Joints q = meeting.pushed(random, 0.008);
    ChainBranch cold;
    Chain first;
    if (model.solve(q, cold, first) != Status::kOk)
      continue;
    ChainBranch guess = cold;
    guess.wrench.head<3>() += anyVector(random, 30.0);
    guess.wrench.tail<3>() += anyVector(random, 1.0);
    guess.target_moment += anyVector(random, 1.0);
    Chain again;
    ASSERT_EQ(model.solve(q, guess, again), Status::kOk);
    EXPECT_LT(again.gap, 1e-8);
    EXPECT_LT(poseDifference(first.tip.pose, again.tip.pose).norm(), 1e-7);
    ++compared;
  }
  EXPECT_GT(compared, 10);
}

TEST(TargetAssist, ContactForceNeverPulls) {
  int reported = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(40); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Meeting meeting(random, ContactType::kPoint);
    Joints q = meeting.q;
    q[3] -= 0.005;  // drawn back
    ChainBranch branch;
    Chain chain;
    const Status status = TargetAssist(meeting.pair).solve(q, branch, chain);
    if (status == Status::kOk) {
      EXPECT_GE(chain.push, 0.0);
      continue;
    }
    EXPECT_FALSE(branch.known);
    reported += status == Status::kNoContact;
    if (status != Status::kNoContact)
      continue;
    EXPECT_LT(chain.push, 0.0);
    meeting.pair.pushes_only = false;
    EXPECT_EQ(TargetAssist(meeting.pair).solve(q, branch, chain), Status::kOk) << "held, it can pull";
  }
  EXPECT_GT(reported, 20);
}

/// A slender assist arm that pushes axially against a stiff target buckles at Euler's load.
TEST(TargetAssist, ABucklingAssistArmIsReported) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(30); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Meeting meeting(random);
    Pair& pair = meeting.pair;
    pair.assist.proximal.moment_stiffness *= 1e-2;
    pair.assist.proximal.force_stiffness *= 1e-2;
    pair.assist.distal = pair.assist.proximal;
    pair.target.proximal.moment_stiffness *= 1e6;
    pair.target.proximal.force_stiffness *= 1e6;
    Joints q = meeting.q;
    q[5] = 0.0;  // straight
    pair.assist.arm.tool.setIdentity();
    // Axially, from the side.
    const Isometry3d place = pair.target.arm.base * Eigen::Translation3d(0.0, 0.0, q[0]) *
                             Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitY());
    pair.assist.arm.base = place * Eigen::Translation3d(0.0, 0.0, -(q[3] + pair.assist.arm.bending_length));
    pair.contact = TargetAssist::touching(pair, q);
    const double length = q[3] + pair.assist.arm.bending_length;
    const double ei = pair.assist.proximal.moment_stiffness.x(), ea = pair.assist.proximal.force_stiffness.z();
    // Clamped at both ends a column buckles at 4 pi^2 E I / L^2: an advance by d causes a force of about E A d / L.
    const double critical = 4.0 * std::numbers::pi * std::numbers::pi * ei / (length * length) * length / ea;
    ChainBranch branch;
    Chain chain;
    q[3] += 0.9 * critical;
    EXPECT_EQ(TargetAssist(pair).solve(q, branch, chain), Status::kOk);
    q[3] += 0.2 * critical;
    branch.known = false;
    const Status status = TargetAssist(pair).solve(q, branch, chain);
    EXPECT_EQ(status, Status::kBuckled) << describe(status) << ", push " << chain.push;
    EXPECT_GE(chain.conjugate_points, 1);
    EXPECT_FALSE(branch.known);
  }
}

/// The assisted target is less compliant than alone in every direction, as the assist arm adds stiffness.
TEST(TargetAssist, AssistanceStiffens) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(30); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Meeting meeting(random);
    meeting.pair.pushes_only = false;
    meeting.pair.target.arm.tool.setIdentity();
    Joints q = meeting.q;
    q[2] = 0.0;
    ChainBranch branch;
    Chain chain;
    ASSERT_EQ(TargetAssist(meeting.pair).solve(q, branch, chain), Status::kOk);
    ElasticArm stump = meeting.pair.target;  // the target up to the start of its bending section, with its tip moved
                                             // there
    const double l = q[0], ei = stump.proximal.moment_stiffness.x();
    const double alone = l * l * l / (3 * ei) + l / stump.proximal.force_stiffness.x();
    const Matrix6 c = [&] {  // from the tip back to the start of the bending section
      Matrix6 shift = Matrix6::Identity();
      const Vector3d back = stump.arm.base * Vector3d(0.0, 0.0, l) - chain.tip.pose.translation();
      shift.topRightCorner<3, 3>() = -kinematics::skew(back);
      return Matrix6(shift * chain.compliance);
    }();
    EXPECT_LT((c - c.transpose()).norm(), 1e-7 * c.norm());
    const Vector3d across = stump.arm.base.linear().col(0);
    const double assisted = across.dot(c.topLeftCorner<3, 3>() * across);
    EXPECT_GT(assisted, 0.0);
    EXPECT_LT(assisted, alone);
  }
}

TEST(TargetAssist, AllocatesNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "the sanitizer's allocator is not counted";
  Random random(baseSeed());
  const Meeting meeting(random);
  const TargetAssist model(meeting.pair);
  Joints q = meeting.q;
  ChainBranch branch;
  Chain chain;
  const std::size_t before = allocationCount();
  for (int k = 0; k < 10; ++k, q[3] += 1e-4)
    model.solve(q, branch, chain);
  EXPECT_EQ(allocationCount(), before);
}

TEST(TargetAssist, RefusesInvalidInput) {
  Random random(baseSeed());
  Meeting meeting(random);
  const TargetAssist model(meeting.pair);
  ChainBranch branch;
  Chain chain;
  Joints q = meeting.q;
  q[4] = std::nan("");
  EXPECT_EQ(model.solve(q, branch, chain), Status::kNotFinite);
  q = meeting.q;
  q[3] = -0.001;
  EXPECT_EQ(model.solve(q, branch, chain), Status::kDistalInside);
  const auto refused = [](Pair pair, auto change, const std::string& what) {
    change(pair);
    try {
      const TargetAssist made(pair);
      ADD_FAILURE() << "accepted: " << what;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
  };
  refused(
      meeting.pair, [](Pair& pair) { pair.type = ContactType::kFrictionless; }, "expected rigid or point");
  refused(
      meeting.pair, [](Pair& pair) { pair.target.proximal.moment_stiffness.x() *= 2.0; }, "about both axes");
  refused(
      meeting.pair, [](Pair& pair) { pair.assist.arm.bending_length = 0.0; }, "bending length");
  refused(
      meeting.pair, [](Pair& pair) { pair.assist.proximal.moment_stiffness.setZero(); }, "moment stiffness");
}

}  // namespace
}  // namespace tandem::test
