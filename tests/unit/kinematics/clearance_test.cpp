// SPDX-License-Identifier: Apache-2.0
#include "kinematics/clearance.h"

#include <gtest/gtest.h>

#include "kinematics/rigid_model.h"
#include "tests/unit/kinematics/arms.h"
#include "tests/unit/kinematics/differences.h"

namespace tandem::test {
namespace {

using namespace kinematics;

/// Smallest distance by brute force: many points on both backbones with the radius of the outermost tube there.
double bruteForce(const TubeModel& a, const Eigen::VectorXd& qa, const TubeModel& b, const Eigen::VectorXd& qb) {
  std::vector<ShapePoint> sa, sb;
  EXPECT_EQ(a.shape(qa, 1500, sa), ModelStatus::kOk);
  EXPECT_EQ(b.shape(qb, 1500, sb), ModelStatus::kOk);
  double least = 1e9;
  for (const ShapePoint& p : sa) {
    for (const ShapePoint& r : sb) {
      const double radii = 0.5 * (a.arm().tubes[p.outermost_tube - 1].outer_diameter +
                                  b.arm().tubes[r.outermost_tube - 1].outer_diameter);
      least = std::min(least, (p.pose.translation() - r.pose.translation()).norm() - radii);
    }
  }
  return least;
}

TEST(Backbone, OfARigidArmIsItsShapeAndEndsInItsTip) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int trial = 0; trial < 200; ++trial) {
    const auto arm = randomArm(random);
    const RigidModel model(arm);
    const Eigen::VectorXd q = randomInside(limitsOf(arm), random);
    std::vector<ShapePoint> shape;
    if (model.shape(q, 50, shape) != ModelStatus::kOk)
      continue;
    std::vector<double> s;
    for (const ShapePoint& point : shape)
      s.push_back(point.s);
    std::vector<BackbonePoint> points;
    Branch branch;
    ASSERT_EQ(model.backbone(q, branch, s, true, points), ModelStatus::kOk);
    for (std::size_t i = 0; i < s.size(); ++i) {
      EXPECT_LT((points[i].position - shape[i].pose.translation()).norm(), 1e-12);
      EXPECT_LT((points[i].tangent - shape[i].pose.linear().col(2)).norm(), 1e-12);
    }
    Body body;  // its last node moves with the end of tube 1
    ASSERT_EQ(makeBody(model, q, branch, true, body), ModelStatus::kOk);
    auto bare = arm;
    bare.tool.setIdentity();
    Tip tip;
    ASSERT_EQ(RigidModel(bare).tip(q, tip), ModelStatus::kOk);
    EXPECT_LT((body.nodes.back().position - tip.pose.translation()).norm(), 1e-12);
    EXPECT_LT((body.nodes.back().jacobian - tip.jacobian.topRows<3>()).norm(), 1e-9);
    std::vector<BackbonePoint> general;
    ASSERT_EQ(model.ArmModel::backbone(q, branch, s, true, general), ModelStatus::kOk);
    for (std::size_t i = 0; i < s.size(); ++i)
      EXPECT_LT((points[i].position - general[i].position).norm(), 2e-4) << "Hermite";
  }
}

template <class Distance>
void expectGradient(const Eigen::VectorXd& q, const Gradient& gradient, const Distance& distance, int& checked) {
  for (int j = 0; j < q.size(); ++j) {
    Eigen::VectorXd moved = q;
    const auto difference = differentiate(
        [&](double h) -> Eigen::VectorXd {
          moved[j] = q[j] + h;
          const auto d = distance(moved);
          return d ? Eigen::VectorXd::Constant(1, *d) : Eigen::VectorXd();
        },
        1e-4);
    if (difference.error > 1e-7)
      continue;  // at a kink: two pairs have the same distance, or boundaries meet
    ++checked;
    EXPECT_NEAR(gradient[j], difference.value[0], 2e-6) << "joint " << j;
  }
}

void checkPair(const char* name, int trials, double tolerance) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  const auto a = makeArmModel(name, arkArm(0.005)), b = makeArmModel(name, arkArm(-0.005));
  const safety::ArmLimits limits = limitsOf(arkArm(0.0));
  int checked = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const Eigen::VectorXd qa = randomInside(limits, random), qb = randomInside(limits, random);
    const auto body = [](const ArmModel& model, const Eigen::VectorXd& q, bool derivatives) -> std::optional<Body> {
      Body result;
      Branch branch;
      if (makeBody(model, q, branch, derivatives, result) != ModelStatus::kOk)
        return {};
      return result;
    };
    const auto at_a = body(*a, qa, true), at_b = body(*b, qb, true);
    if (!at_a || !at_b)
      continue;
    const Clearance found = clearance(*at_a, *at_b);
    EXPECT_NEAR(found.distance, bruteForce(*a, qa, *b, qb), tolerance);
    const Clearance swapped = clearance(*at_b, *at_a);
    EXPECT_NEAR(found.distance, swapped.distance, 1e-9);
    if (found.distance < -1.5e-3)
      continue;  // the backbones cross
    expectGradient(
        qa, found.by_a,
        [&](const Eigen::VectorXd& q) -> std::optional<double> {
          const auto moved = body(*a, q, false);
          return moved ? std::optional(clearance(*moved, *at_b).distance) : std::nullopt;
        },
        checked);
    Port port;
    port.radius = 8e-3;
    port.depth = trial % 2 == 0 ? 0.0 : 15e-3;
    expectGradient(
        qa, clearance(*at_a, port).by_a,
        [&](const Eigen::VectorXd& q) -> std::optional<double> {
          const auto moved = body(*a, q, false);
          return moved ? std::optional(clearance(*moved, port).distance) : std::nullopt;
        },
        checked);
  }
  EXPECT_GT(checked, 6 * trials) << "most differences can be trusted";
}

TEST(Clearance, OfRigidArmsAgreesWithBruteForceAndItsGradientWithDifferences) { checkPair("rigid", 60, 2e-4); }
TEST(Clearance, OfCompliantArmsAgreesWithBruteForceAndItsGradientWithDifferences) { checkPair("compliant", 8, 3e-4); }

TEST(Clearance, ToThePortIsThatOfItsPlateAndItsHole) {
  // A straight arm: 5 mm beside the axis of a hole of 8 mm radius.
  auto arm = arkArm(0.005);
  for (Tube& tube : arm.tubes) {
    for (TubeSection& section : tube.sections)
      section.curvature = 0.0;
  }
  const RigidModel model(arm);
  Body body;
  Branch branch;
  ASSERT_EQ(makeBody(model, arkStart(0, 0), branch, true, body), ModelStatus::kOk);
  Port port;
  port.radius = 8e-3;
  port.depth = 20e-3;
  const Clearance found = clearance(body, port);
  EXPECT_NEAR(found.distance, 8e-3 - 5e-3 - 1.082e-3, 1e-12);
  EXPECT_LT(found.s_a, 20e-3 + 1e-9);
  port.radius = 5.5e-3;
  EXPECT_NEAR(clearance(body, port).distance, 5.5e-3 - 5e-3 - 1.082e-3, 1e-12) << "touching";
}

}  // namespace
}  // namespace tandem::test
