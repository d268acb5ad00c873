// SPDX-License-Identifier: Apache-2.0
#include "planning/tips.h"

#include <gtest/gtest.h>

#include "kinematics/tube_model.h"
#include "tests/unit/safety/allocation_counter.h"
#include "tests/unit/support/random_tubes.h"

namespace tandem::test {
namespace {

using planning::TipFollower;

/// Two tubes that are twisted against each other until they snap.
kinematics::ConcentricTubeArm windingArm() {
  kinematics::ConcentricTubeArm arm;
  arm.tubes = {{1.5e-3, 1.3e-3, 58e9, 0.3, {}}, {1.8e-3, 1.6e-3, 58e9, 0.3, {}}};
  for (int i = 0; i < 2; ++i) {
    arm.tubes[static_cast<std::size_t>(i)].addSection(0.4 - 0.1 * i, 0.0);
    arm.tubes[static_cast<std::size_t>(i)].addSection(0.1, 18.0);
  }
  return arm;
}

safety::RobotVector wound(double angle) {
  safety::RobotVector q(4);
  q << -0.30, -0.20, angle, 0.1;
  return q;
}

TEST(TipFollower, ResultIsIndependentOfQueryRate) {
  const auto model = kinematics::makeArmModel("compliant", windingArm());
  TipFollower once({model.get()}), often({model.get()});
  Random random(baseSeed());
  SCOPED_TRACE(trace(baseSeed()));
  for (int i = 0; i < 200; ++i) {
    const auto q = wound(0.05 * i);
    ASSERT_TRUE(once.update(q));
    for (int k = random.integer(1, 5); k > 0; --k)
      ASSERT_TRUE(often.update(q));
    ASSERT_EQ(once.tip(0).pose.matrix(), often.tip(0).pose.matrix()) << i;
  }
  EXPECT_EQ(once.snaps(0), often.snaps(0));
}

TEST(TipFollower, ContinuesFromTheLastTipsAndRestartsOnRequest) {
  const auto model = kinematics::makeArmModel("compliant", windingArm());
  TipFollower first({model.get()}), second({model.get()});
  const double far = 1.15 * std::numbers::pi;  // an equilibrium other than that of a cold start
  for (int i = 0; i <= 100; ++i)
    ASSERT_TRUE(first.update(wound(0.01 * i * far)));
  second.continueFrom(first);
  ASSERT_TRUE(second.update(wound(far)));
  EXPECT_EQ(second.tip(0).pose.matrix(), first.tip(0).pose.matrix());
  ASSERT_TRUE(second.update(wound(far + 1e-3)));
  EXPECT_LT((second.tip(0).pose.translation() - first.tip(0).pose.translation()).norm(), 1e-3) << "the same branch";
  second.restart();
  ASSERT_TRUE(second.update(wound(far + 1e-3)));
  TipFollower cold({model.get()});
  ASSERT_TRUE(cold.update(wound(far + 1e-3)));
  EXPECT_EQ(second.tip(0).pose.matrix(), cold.tip(0).pose.matrix());
}

TEST(TipFollower, SaysWhichArmHasNoAnswerAndKeepsTheOthers) {
  const auto a = kinematics::makeArmModel("rigid", arkArm(0.005)),
             b = kinematics::makeArmModel("rigid", arkArm(-0.005));
  TipFollower tips({a.get(), b.get()});
  safety::RobotVector q(12);
  q << arkStart(0, 0), arkStart(0, 1);
  ASSERT_TRUE(tips.update(q));
  const Eigen::Isometry3d before = tips.tip(1).pose;
  q[0] -= 1e-3;
  q[8] = std::nan("");
  EXPECT_FALSE(tips.update(q));
  EXPECT_EQ(tips.failedArm(), 1);
  EXPECT_EQ(tips.status(), kinematics::ModelStatus::kNotFinite);
  EXPECT_EQ(tips.tip(1).pose.matrix(), before.matrix());
  EXPECT_FALSE(tips.update(q.head(6)));
  EXPECT_EQ(tips.status(), kinematics::ModelStatus::kWrongSize);
}

TEST(TipFollower, UpdatesAllocateNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  const auto model = kinematics::makeArmModel("rigid", windingArm());
  TipFollower tips({model.get()}), other({model.get()});
  const std::size_t before = allocationCount();
  for (int i = 0; i < 100; ++i)
    tips.update(wound(0.02 * i));
  other.continueFrom(tips);
  tips.restart();
  EXPECT_EQ(allocationCount(), before);
}

TEST(Feedback, NamesRoundTrip) {
  for (const char* text : {"model", "sensor"}) {
    ASSERT_TRUE(idl::fromName<planning::Feedback>(text));
    EXPECT_EQ(planning::name(*idl::fromName<planning::Feedback>(text)), text);
  }
  EXPECT_FALSE(idl::fromName<planning::Feedback>("eye"));
}

}  // namespace
}  // namespace tandem::test
