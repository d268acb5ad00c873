// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

#include "kinematics/tube_model.h"
#include "sim/plant_tips.h"
#include "sim/simulated_arm.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::sim {
namespace {

constexpr double kMu = 0.02;
constexpr double kStraight = 0.3, kCurved = 0.1;  // m

/// Two tubes with straight parts behind the entry point and curved ones in front, which end together.
kinematics::ConcentricTubeArm twoTubes() {
  kinematics::ConcentricTubeArm arm;
  arm.tubes = {{1.5e-3, 1.3e-3, 58e9, 0.3, {}}, {1.8e-3, 1.6e-3, 58e9, 0.3, {}}};
  for (std::size_t i = 0; i < 2; ++i) {
    arm.tubes[i].addSection(kStraight, 0.0);
    arm.tubes[i].addSection(kCurved, i == 0 ? 12.0 : 5.0);
  }
  return arm;
}

safety::ArmVector joints(double first, double second) {
  safety::ArmVector q(4);
  q << -kStraight, -kStraight, first, second;
  return q;
}

/// w_i of untwisted tubes at an angle to each other, in closed form: concentrated moments at both ends of the overlap,
/// and the force that keeps the torsional moments in equilibrium.
double windUp(int tube, double angle) {
  const kinematics::ConcentricTubeArm arm = twoTubes();
  const auto &one = arm.tubes[0].sections.back(), &two = arm.tubes[1].sections.back();
  const double k1 = one.bending_stiffness, k2 = two.bending_stiffness, total = k1 + k2, cosine = std::cos(angle);
  const auto length = [&](double a, double b, double sign) {
    return std::sqrt(a * a + b * b + sign * 2.0 * a * b * cosine);
  };
  const double moment = k1 * k2 / total * length(one.curvature, two.curvature, -1.0);
  const double u = length(k1 * one.curvature, k2 * two.curvature, 1.0) / total;
  const double force = 2.0 * k1 * one.curvature * k2 * two.curvature / total * std::abs(std::sin(angle)) * u * kCurved;
  // At the entry point the moment jumps from 0, as tubes are straight there, and at the end back to 0.
  const auto& of = arm.tubes[static_cast<std::size_t>(tube)];
  const double torque = kMu * (2.0 * moment + 0.5 * of.outer_diameter * force);
  return torque * kStraight / of.sections[0].torsional_stiffness;
}

PlantTips plantWith(double mu, const char* model = "rigid") {
  PlantOptions options;
  options.model = model;
  options.friction = mu;
  ArmModels models;
  models.push_back(kinematics::makeArmModel(model, twoTubes()));
  std::vector<TubeContact> contacts;
  contacts.push_back(makeContact(twoTubes(), twoTubes(), options));
  return {std::move(models), options, std::move(contacts)};
}

/// Direction in which the tip of the rigid plant is, seen along z, rad.
double azimuth(const PlantTips& tips) {
  const Eigen::Vector3d tip = tips.pose(0).translation();
  return std::atan2(tip.y(), tip.x());
}

TEST(TubeFriction, WindUpIsFrictionTorqueTimesLengthOverStiffness) {
  for (const double angle : {0.0, 0.4, 1.5, 3.0, -2.0}) {
    TubeFriction friction(twoTubes(), twoTubes(), kMu);
    const safety::ArmVector q = joints(angle, 0.0);
    EXPECT_EQ(friction.follow(q), q) << "starts without wind-up";
    friction.update(q, {});
    for (int i = 0; i < 2; ++i)
      EXPECT_NEAR(friction.windUp()[i], windUp(i, angle), 1e-9) << angle;
  }
}

/// Both tubes turn together: their contact stays as it is, and so does the width of the loop.
TEST(TubeFriction, TurningBackAndForthMakesALoopOfTwiceTheWindUp) {
  TubeFriction friction(twoTubes(), twoTubes(), kMu);
  const double w = windUp(0, 0.0);
  const auto turned = [&](double angle) {
    const safety::ArmVector tubes = friction.follow(joints(angle, angle));
    friction.update(joints(0.0, 0.0), {});
    return tubes[2];
  };
  turned(0.0);
  EXPECT_EQ(turned(0.9 * w), 0.0) << "sticks";
  EXPECT_NEAR(turned(1.0), 1.0 - w, 1e-12) << "slides";
  EXPECT_NEAR(turned(1.0 - 1.9 * w), 1.0 - w, 1e-12) << "sticks after the reversal";
  EXPECT_NEAR(turned(0.0), w, 1e-12);
  EXPECT_NEAR(turned(1.0), 1.0 - w, 1e-12) << "the same loop again";
  friction.restart();
  EXPECT_EQ(turned(0.3), 0.3) << "a reset starts without wind-up";
}

/// motor -> backlash -> friction -> tube: at a reversal the lost rotation is the sum.
TEST(TubeFriction, LostRotationIsBacklashPlusLoop) {
  constexpr double kBacklash = 0.05;
  JointOptions options;
  options.mechanics.backlash.rotation = kBacklash;
  options.kinds.fill(safety::JointKind::kTranslation);
  options.kinds[2] = options.kinds[3] = safety::JointKind::kRotation;
  const PlantLimits ideal{safety::ArmVector::Constant(4, safety::kUnlimited),
                          safety::ArmVector::Constant(4, safety::kUnlimited)};
  SimulatedArm arm(joints(0.0, 0.0), ideal, options);
  PlantTips tips = plantWith(kMu);
  const auto move = [&](double angle) {
    arm.step(0.1, joints(angle, angle));
    tips.update(0, arm.tubes());
    return azimuth(tips);
  };
  tips.update(0, arm.tubes());
  double forth = 0.0;
  for (int i = 1; i <= 100; ++i)
    forth = move(0.01 * i);
  int lost = 0;  // steps of 1 mrad until the tip turns by 1 mrad
  while (lost < 1000 && std::abs(move(1.0 - 1e-3 * lost) - forth) < 1e-3)
    ++lost;
  // Both tubes slide in turn: the first one to move is the one with the smaller wind-up.
  const double w = std::min(windUp(0, 0.0), windUp(1, 0.0));
  EXPECT_GT(1e-3 * lost, kBacklash + 2.0 * w - 2e-3);
  EXPECT_LT(1e-3 * lost, kBacklash + 2.0 * std::max(windUp(0, 0.0), windUp(1, 0.0)) + 0.02);
}

TEST(TubeFriction, TipOfTheCompliantPlantHasALoopThatRepeatsBitForBit) {
  PlantTips tips = plantWith(kMu, "compliant"), ideal = plantWith(0.0, "compliant");
  const auto turn = [](PlantTips& plant) {
    std::vector<Eigen::Vector3d> way;
    plant.restart();
    for (int i = -40; i <= 120; ++i) {
      const double angle = 0.02 * (i <= 40 ? i : 80 - i);  // -0.8 to 0.8 and back
      plant.update(0, joints(angle, 0.0));
      EXPECT_TRUE(plant.valid(0));
      way.emplace_back(plant.pose(0).translation());
    }
    return way;
  };
  const auto way = turn(tips), again = turn(tips), exact = turn(ideal);
  for (std::size_t i = 0; i < way.size(); ++i)
    EXPECT_EQ(way[i], again[i]);
  const auto width = [](const auto& of) { return (of[40] - of[120]).norm(); };  // at 0, forth and back
  EXPECT_LT(width(exact), 1e-7);
  EXPECT_GT(width(way), 1e-3);
  std::printf("loop %.2f mm\n", 1e3 * width(way));
}

TEST(TubeFriction, AllocatesNothing) {
  if (!test::canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  PlantTips tips = plantWith(kMu, "compliant");
  tips.update(0, joints(0.0, 0.0));
  const std::size_t before = test::allocationCount();
  for (int i = 0; i < 50; ++i) {
    Eigen::Matrix<double, 4, 1> q(-kStraight, -kStraight, 0.01 * i, 0.0);
    tips.update(0, q);
  }
  EXPECT_EQ(test::allocationCount(), before);
}

/// One neighbouring pair: the tube around it ends at the same place, so only half the clearance is left.
TEST(TipPlay, IsAsWideAsClearanceAndTiltAllow) {
  const TipPlay together(twoTubes(), 0.1e-3, 0.06e-3);
  EXPECT_NEAR(together.radius(joints(0, 0)), 0.5 * 0.13e-3, 1e-12);
  safety::ArmVector q = joints(0, 0);
  q[1] -= 0.04;  // tube 1 is 40 mm longer, and is guided by the last 100 mm of tube 2
  EXPECT_NEAR(together.radius(q), 0.13e-3 * (0.5 + 0.4), 1e-12);
}

TEST(TipPlay, TipStaysInPlaceInsideThePlayAndFollowsBeyondIt) {
  constexpr double kClearance = 0.2e-3;
  TipPlay play(twoTubes(), kClearance, 0.0);
  const safety::ArmVector q = joints(0, 0);
  const auto at = [&](double x, double z) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = Eigen::Vector3d(x, 0.0, z);
    play.apply(q, pose);
    return Eigen::Vector3d(pose.translation());
  };
  const double d = 0.5 * kClearance;
  EXPECT_EQ(at(0, 0).x(), 0.0);
  EXPECT_NEAR(at(0.9 * d, 0).x(), 0.0, 1e-15);
  EXPECT_NEAR(at(5 * d, 0).x(), 4 * d, 1e-15);
  EXPECT_NEAR(at(3.1 * d, 0).x(), 4 * d, 1e-15) << "lost motion";
  EXPECT_NEAR(at(0, 0).x(), d, 1e-15);
  EXPECT_NEAR(at(0, 0.01).z(), 0.01, 1e-15) << "no play along the tube";
  play.restart();
  EXPECT_EQ(at(7 * d, 0).x(), 7 * d);
}

TEST(ResidualCurvature, BendsStraightSectionsAloneAndKeepsTheOtherErrors) {
  PlantOptions options;
  options.tube_deviation = {0.05, 0.1, 0.08, 0.01};
  PlantOptions bent = options;
  bent.tube_deviation.residual_curvature = 0.5;
  double squares = 0.0;
  constexpr int kArms = 500;
  for (int k = 0; k < kArms; ++k) {
    const auto without = withErrors(twoTubes(), k, options), with = withErrors(twoTubes(), k, bent);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(without.tubes[i].sections[0].curvature, 0.0);
      EXPECT_EQ(without.tubes[i].sections[1].curvature, with.tubes[i].sections[1].curvature);
      EXPECT_EQ(without.tubes[i].sections[0].length, with.tubes[i].sections[0].length);
      squares += std::pow(with.tubes[i].sections[0].curvature, 2);
    }
  }
  EXPECT_NEAR(std::sqrt(squares / (2 * kArms)), 0.5, 0.04);
  bent.tube_errors = {{0, 1, {0, 0, 0, 0, -0.7}}};
  EXPECT_EQ(withErrors(twoTubes(), 0, bent).tubes[1].sections[0].curvature, -0.7);
}

}  // namespace
}  // namespace tandem::sim
