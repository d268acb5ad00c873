// SPDX-License-Identifier: Apache-2.0
#include "kinematics/tasks/shaft_search.h"

#include <gtest/gtest.h>

#include "kinematics/tasks/task_kind.h"
#include "tests/unit/kinematics/arms.h"
#include "tests/unit/kinematics/differences.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::test {
namespace {

using namespace kinematics;

constexpr const char* kModels[] = {"rigid", "compliant"};

/** A random arm at random joints on a stable branch. */
struct AnyShaft {
  std::unique_ptr<ArmModel> model;
  Eigen::VectorXd q;
  Branch branch;
  double length = 0.0;
  bool known = false;

  AnyShaft(const char* name, Random& random) {
    const ConcentricTubeArm arm = randomArm(random);
    model = makeArmModel(name, arm);
    q = randomInside(limitsOf(arm), random);
    Tip tip;
    known = model->tip(q, branch, tip) == ModelStatus::kOk && tip.conjugate_points == 0 && tip.stability > 0.1;
    BodySections sections;
    if (known)
      length = sections[static_cast<std::size_t>(model->sections(q, sections) - 1)].end;
    known = known && length > 0.05;
  }
  BackbonePoint at(double s) const {
    Branch aside = branch;
    std::vector<BackbonePoint> points;
    EXPECT_EQ(model->backbone(q, aside, {s}, false, points), ModelStatus::kOk);
    return points[0];
  }
  /// A point beside the shaft at s, at a distance.
  Eigen::Vector3d beside(double s, double distance, Random& random) const {
    const BackbonePoint point = at(s);
    const Eigen::Vector3d side = point.tangent.cross(anyVector(random, 1.0)).normalized();
    return point.position + distance * side;
  }
};

TEST(ShaftSearch, FootIsThePerpendicularFromThePoint) {
  int found = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 300; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const AnyShaft shaft(kModels[seed % 2], random);
    if (!shaft.known)
      continue;
    // Far below the least radius of curvature: one foot, where the point was put.
    const double s = random.uniform(0.0, 1.2) * shaft.length, distance = random.uniform(0.0, 0.01);
    const Eigen::Vector3d target = shaft.beside(s, distance, random);
    ShaftSearch search;
    ShaftPoint foot;
    ASSERT_EQ(search.find(*shaft.model, shaft.q, shaft.branch, target, false, foot), ModelStatus::kOk);
    const Eigen::Vector3d away = target - foot.pose.translation(), axis = foot.pose.linear().col(2);
    EXPECT_NEAR(away.dot(axis), 0.0, 1e-9);
    EXPECT_NEAR(foot.s, s, 1e-7);
    EXPECT_NEAR(away.norm(), distance, 1e-9);
    EXPECT_LT((axis - shaft.at(s).tangent).norm(), 1e-6);
    const TaskKindEntry& kind = *findTaskKind(idl::TaskKind::kRemoteCentre);
    EXPECT_NEAR(kind.error(kind.place(foot.pose, foot.pose), {target, Eigen::Quaterniond::Identity()}), distance, 1e-9);
    ++found;
  }
  EXPECT_GT(found, 100);
}

TEST(ShaftSearch, BehindTheEntryPointTheShaftIsTheAxisOfTheBase) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 100; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const AnyShaft shaft(kModels[seed % 2], random);
    if (!shaft.known)
      continue;
    const Eigen::Isometry3d& base = shaft.model->base();
    const Eigen::Vector3d target =
        base * Eigen::Vector3d(random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01), random.uniform(-0.1, -0.001));
    ShaftSearch search;
    ShaftPoint foot;
    ASSERT_EQ(search.find(*shaft.model, shaft.q, shaft.branch, target, true, foot), ModelStatus::kOk);
    EXPECT_NEAR(foot.s, (base.inverse() * target).z(), 1e-12);
    EXPECT_NEAR((base.inverse() * foot.pose.translation()).head<2>().norm(), 0.0, 1e-12);
    EXPECT_LT(foot.jacobian.norm(), 1e-12);
  }
}

/// |e| is differentiable, and its rate with joint velocities q' is -e . J q' / |e|.
TEST(ShaftSearch, JacobianIsTheDerivativeOfTheDistance) {
  std::array<int, 2> compared{}, beyond{};
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 200; ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const std::size_t which = seed % 4 == 0 ? 1 : 0;
    const AnyShaft shaft(kModels[which], random);
    if (!shaft.known)
      continue;
    const double s = random.uniform(0.1, 1.3) * shaft.length;
    const Eigen::Vector3d target = shaft.beside(s, random.uniform(1e-3, 8e-3), random);
    ShaftSearch search;
    const TaskKindEntry& kind = *findTaskKind(idl::TaskKind::kRemoteCentre);
    const TaskPlace wanted{target, Eigen::Quaterniond::Identity()};
    ShaftPoint foot;
    ASSERT_EQ(search.find(*shaft.model, shaft.q, shaft.branch, target, true, foot), ModelStatus::kOk);
    const TaskPlace at = kind.place(foot.pose, foot.pose);
    TaskRows rows;
    kind.maps(at, wanted, foot.pose, rows);
    const Eigen::VectorXd e = kind.residual(at, wanted);
    const Eigen::MatrixXd jacobian = rows.by_arm * foot.jacobian;
    for (int j = 0; j < shaft.q.size(); ++j) {
      const Difference slope = differentiate(
          [&](double step) -> Eigen::VectorXd {
            Eigen::VectorXd q = shaft.q;
            q[j] += step;
            ShaftPoint moved;
            Branch branch = shaft.branch;
            Tip tip;
            if (shaft.model->tip(q, branch, tip) != ModelStatus::kOk ||
                search.find(*shaft.model, q, branch, target, false, moved) != ModelStatus::kOk)
              return {};
            return Eigen::VectorXd::Constant(1, kind.error(kind.place(moved.pose, moved.pose), wanted));
          },
          1e-4);
      if (slope.error > 1e-6)
        continue;  // boundaries of sections cross
      EXPECT_NEAR(-e.dot(jacobian.col(j)) / e.norm(), slope.value[0], 1e-4 * (1.0 + jacobian.col(j).norm()))
          << "joint " << j << ", s " << s << " of " << shaft.length << ", " << kModels[which];
      ++compared[which];
      beyond[which] += s > shaft.length ? 1 : 0;
    }
  }
  EXPECT_GT(compared[0], 300);
  EXPECT_GT(compared[1], 50);
  EXPECT_GT(beyond[0], 30);
  EXPECT_GT(beyond[1], 5);
}

TEST(ShaftSearch, AllocatesNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  for (const char* name : kModels) {
    const auto model = makeArmModel(name, arkArm(0.0));
    Branch branch;
    Tip tip;
    const Eigen::VectorXd q = arkStart(1, 0);
    ASSERT_EQ(model->tip(q, branch, tip), ModelStatus::kOk);
    ShaftSearch search = ShaftSearch();
    ShaftPoint foot;
    const std::size_t before = allocationCount();
    for (int i = 0; i < 20; ++i)
      search.find(*model, q, branch, {0.001 * i, 0.0, 0.01 * i}, true, foot);
    EXPECT_EQ(allocationCount(), before) << name;
  }
}

TEST(ShaftSearch, RefusesAWrongNumberOfJoints) {
  const auto model = makeArmModel("rigid", arkArm(0.0));
  ShaftSearch search;
  ShaftPoint foot;
  EXPECT_EQ(search.find(*model, Eigen::VectorXd::Zero(4), {}, Eigen::Vector3d::Zero(), true, foot),
            ModelStatus::kWrongSize);
}

}  // namespace
}  // namespace tandem::test
