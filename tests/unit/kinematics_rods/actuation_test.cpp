// SPDX-License-Identifier: Apache-2.0
/** @file Catheters whose pull wires have a given displacement, and those whose pull wires have a given tension. */
#include <gtest/gtest.h>

#include "kinematics/catheter/elastic.h"
#include "kinematics/spectrum.h"
#include "tests/unit/kinematics/differences.h"
#include "tests/unit/kinematics_rods/random_rods.h"

namespace tandem::test {
namespace {

using Eigen::Vector3d;
using kinematics::LoadedTip;
using kinematics::ModelStatus;
using kinematics::Wrench;
using kinematics::catheter::Actuation;
using kinematics::catheter::ElasticArm;
using kinematics::catheter::ElasticCatheter;
using kinematics::cosserat::Actuator;
using kinematics::cosserat::Rod;
using kinematics::cosserat::RodBranch;
using kinematics::cosserat::RodInput;
using kinematics::cosserat::RodModel;
using kinematics::cosserat::RodPoint;

ElasticArm anyArm(Random& random, Actuation actuation) {
  ElasticArm arm;
  arm.arm = anyCatheter(random);
  arm.proximal = kinematics::cosserat::tubeSection(0.1, 2.6e-3, 1.4e-3, random.uniform(0.5e9, 2e9), 0.4);
  arm.distal = kinematics::cosserat::tubeSection(0.1, 2.6e-3, 1.4e-3, random.uniform(0.1e9, 0.5e9), 0.4);
  arm.actuation = actuation;
  arm.wire_elasticity = random.chance(0.5) ? random.uniform(0.0, 1.0) : 0.0;
  return arm;
}

ElasticArm with(ElasticArm arm, Actuation actuation) {
  arm.actuation = actuation;
  return arm;
}

/// A straight bending section without a passive end; the insertion has to be 0.
ElasticArm beam() {
  ElasticArm arm;
  arm.arm.bending_length = 0.065;
  arm.proximal = arm.distal = kinematics::cosserat::tubeSection(0.065, 2.333e-3, 1.5e-3, 0.36e9, 0.4);
  return arm;
}

LoadedTip tipOf(const ElasticArm& arm, const Vector3d& q, const Wrench& wrench) {
  LoadedTip tip;
  RodBranch branch;
  EXPECT_EQ(ElasticCatheter(arm).tip(q, wrench, branch, tip), ModelStatus::kOk);
  return tip;
}

Wrench anyWrench(Random& random, double force, double moment) {
  Wrench wrench;
  wrench << anyVector(random, force), anyVector(random, moment);
  return wrench;
}

/// Clamped beam: L^3 / 3 E I across at constant tension, L^3 / 12 E I with a locked tip angle; shear L / G A in both.
TEST(Actuation, ComplianceOfABeamIsThatOfTheClosedForm) {
  ElasticArm arm = beam();
  const double l = arm.arm.bending_length, ei = arm.distal.moment_stiffness.y(), cube = l * l * l / ei;
  const double shear = l / arm.distal.force_stiffness.x();
  const auto across = [&](Actuation actuation, double elasticity) {
    arm.wire_elasticity = elasticity;
    return Eigen::Vector2d(
        tipOf(with(arm, actuation), Vector3d::Zero(), Wrench::Zero()).compliance.diagonal().head<2>());
  };
  EXPECT_NEAR(across(Actuation::kTension, 0.0).x(), cube / 3.0 + shear, 1e-8 * cube);
  EXPECT_NEAR(across(Actuation::kDisplacement, 0.0).x(), cube / 12.0 + shear, 1e-8 * cube);
  EXPECT_NEAR(across(Actuation::kDisplacement, 0.6).x(), cube / 3.0 - cube / 4.0 / 1.6 + shear, 1e-8 * cube);
  EXPECT_NEAR(across(Actuation::kDisplacement, 0.0).y(), cube / 3.0 + shear, 1e-8 * cube) << "across the wires' plane";
}

/// A column that can only buckle in the plane of its wires: pi^2 E I / 4 L^2, and pi^2 E I / L^2 with a locked angle.
TEST(Actuation, AColumnBucklesAtEulersLoads) {
  ElasticArm arm = beam();
  arm.distal.moment_stiffness.x() *= 1e3;
  arm.distal.force_stiffness *= 1e6;
  const double l = arm.arm.bending_length;
  const double euler = std::pow(std::numbers::pi / l, 2) * arm.distal.moment_stiffness.y();
  for (const auto& [actuation, critical] :
       {std::pair{Actuation::kTension, euler / 4.0}, {Actuation::kDisplacement, euler}}) {
    for (const double part : {0.98, 1.02}) {
      Wrench wrench = Wrench::Zero();
      wrench.z() = -part * critical;
      EXPECT_EQ(tipOf(with(arm, actuation), Vector3d::Zero(), wrench).conjugate_points, part > 1.0 ? 1 : 0)
          << nameOf(actuation) << ", " << part;
    }
  }
}

/// The same column behind a passive one of a third of its length L, both tips held: it buckles as a whole at
/// 4 pi^2 E I / (4 L / 3)^2. The locked wire keeps the angle between the ends of the bending section, which then
/// buckles alone, at 4 pi^2 E I / L^2.
TEST(Actuation, ALockedWireKeepsAColumnWithItsTipHeldFromBuckling) {
  ElasticArm arm = beam();
  const double l = arm.arm.bending_length;
  for (kinematics::cosserat::Section* section : {&arm.proximal, &arm.distal}) {
    section->moment_stiffness.x() *= 1e3;
    section->force_stiffness *= 1e6;
  }
  const double euler = std::pow(2.0 * std::numbers::pi / l, 2) * arm.distal.moment_stiffness.y();
  for (const auto& [actuation, critical] :
       {std::pair{Actuation::kTension, euler / std::pow(4.0 / 3.0, 2)}, {Actuation::kDisplacement, euler}}) {
    const RodModel model(rodOf(with(arm, actuation)));
    RodInput input(model.rod());
    input.first_length = l / 3.0;
    actuate(with(arm, actuation), 0.0, kinematics::cosserat::Inputs::UnitX(), input);
    for (const double part : {0.98, 1.02}) {
      input.tip.z() = -part * critical;
      RodBranch branch;
      kinematics::cosserat::RodAnswer answer;
      ASSERT_EQ(model.solve(input, branch, answer), ModelStatus::kOk);
      EXPECT_EQ(answer.held_conjugate_points, part > 1.0 ? 1 : 0) << nameOf(actuation) << ", " << part;
    }
  }
}

TEST(Actuation, ShapesWithoutLoadsAreTheSame) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(60); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const ElasticArm arm = anyArm(random, Actuation::kTension);
    const Vector3d q = anyCatheterJoints(random);
    const LoadedTip free = tipOf(arm, q, Wrench::Zero());
    const LoadedTip locked = tipOf(with(arm, Actuation::kDisplacement), q, Wrench::Zero());
    EXPECT_LT(poseDifference(free.pose, locked.pose).norm(), 1e-11);
    EXPECT_LT((free.jacobian - locked.jacobian).norm(), 1e-8);
  }
}

/// A given tension is an input of the rod without a wire.
TEST(Actuation, ATensionIsAnInputOfTheRod) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(30); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const ElasticArm arm = anyArm(random, Actuation::kTension);
    const Vector3d q = anyCatheterJoints(random);
    Rod rod = rodOf(arm);
    rod.tool = arm.arm.tool;
    RodInput input(rod);
    input.base = arm.arm.base * Eigen::AngleAxisd(q[1], Vector3d::UnitZ());
    input.first_length = q[0];
    input.inputs[0] = q[2];
    input.tip = anyWrench(random, 0.01, 1e-4);
    RodBranch branch, other;
    kinematics::cosserat::RodAnswer answer;
    LoadedTip tip;
    const ModelStatus status = RodModel(rod).solve(input, branch, answer);
    ASSERT_EQ(ElasticCatheter(arm).tip(q, input.tip, other, tip), status);
    if (status != ModelStatus::kOk)
      continue;
    EXPECT_TRUE(tip.pose.matrix() == answer.tip.matrix());
    EXPECT_TRUE(tip.compliance == answer.compliance);
    EXPECT_TRUE(tip.jacobian.col(2) == answer.by_input.col(0));
  }
}

TEST(Actuation, DerivativesAreThoseOfTheSolution) {
  int compared = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(40); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const Actuation actuation = seed % 2 ? Actuation::kDisplacement : Actuation::kTension;
    const ElasticCatheter model(anyArm(random, actuation));
    const Vector3d q = anyCatheterJoints(random) + Vector3d(0.02, 0.0, 0.0);
    const Wrench wrench = anyWrench(random, 0.03, 1e-3);
    RodBranch branch;
    LoadedTip tip;
    if (model.tip(q, wrench, branch, tip) != ModelStatus::kOk || tip.conjugate_points > 0)
      continue;
    const double softness = tip.compliance.norm();
    for (int j = 0; j < 9; ++j) {
      const Difference difference = differentiate(
          [&](double h) -> Eigen::VectorXd {
            RodBranch there = branch;
            LoadedTip moved;
            const Vector3d joints = j < 3 ? Vector3d(q + h * Vector3d::Unit(j)) : q;
            const Wrench load = j < 3 ? wrench : Wrench(wrench + h * Wrench::Unit(j - 3));
            return model.tip(joints, load, there, moved) == ModelStatus::kOk
                       ? Eigen::VectorXd(poseDifference(tip.pose, moved.pose))
                       : Eigen::VectorXd();
          },
          j == 0  ? 2e-3
          : j < 3 ? 0.05
                  : 0.1 / softness);
      const double size = std::max(1.0, difference.value.norm());
      if (!(difference.error < 2e-7 * size))
        continue;
      const Eigen::VectorXd found = j < 3 ? Eigen::VectorXd(tip.jacobian.col(j)) : tip.compliance.col(j - 3);
      EXPECT_LT((difference.value - found).norm(), 1e-6 * size) << nameOf(actuation) << ", column " << j;
      ++compared;
    }
  }
  EXPECT_GT(compared, 150);
}

/// The wire's condition holds along the shape. At the tension found, the arm without the lock has the same shape, is
/// softer, and has as many negative directions or one more.
TEST(Actuation, ALockedWireAddsAConstraint) {
  int compared = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(200); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const ElasticArm arm = anyArm(random, Actuation::kDisplacement);
    const ElasticCatheter locked(arm), free(with(arm, Actuation::kTension));
    const Vector3d q(0.0, random.uniform(-3.0, 3.0), random.uniform(-2.0, 2.0));
    const double l = arm.arm.bending_length, force = 8.0 * arm.distal.moment_stiffness.y() / (l * l);
    const Wrench wrench = anyWrench(random, random.uniform(0.1, 1.0) * force, 0.0);
    RodBranch branch;
    LoadedTip tip, same;
    std::vector<RodPoint> shape;
    if (locked.tip(q, wrench, branch, tip) != ModelStatus::kOk)
      continue;
    const double pull = branch.pull;
    ASSERT_EQ(locked.shape(q, wrench, branch, 201, shape), ModelStatus::kOk);
    // The first point belongs to the passive end, which has no length here.
    shape[0].curvature = 3.0 * (shape[1].curvature - shape[2].curvature) + shape[3].curvature;
    double bend = 0.0;
    for (std::size_t k = 0; k < shape.size(); ++k) {
      const double weight = k == 0 || k + 1 == shape.size() ? 1.0 : k % 2 ? 4.0 : 2.0;
      bend += weight / 3.0 * l / 200.0 * shape[k].curvature.y();
    }
    EXPECT_NEAR(bend + arm.wire_elasticity * pull, (1.0 + arm.wire_elasticity) * q[2], 1e-6);
    RodBranch there = branch;
    if (free.tip(Vector3d(q[0], q[1], pull), wrench, there, same) != ModelStatus::kOk ||
        poseDifference(tip.pose, same.pose).norm() > 1e-7)
      continue;  // the other arm has another equilibrium at this load, too
    ++compared;
    EXPECT_LE(tip.conjugate_points, same.conjugate_points);
    EXPECT_GE(tip.conjugate_points + 1, same.conjugate_points);
    if (same.conjugate_points == 0) {
      EXPECT_EQ(kinematics::negativeDirections(same.compliance - tip.compliance, 1e-6), 0);
    }
  }
  EXPECT_GT(compared, 100);
}

/** A rod with two antagonistic tendons, as the judge: at a given difference of their lengths, or of their tensions. */
struct TendonPair {
  TendonPair(const ElasticArm& arm, double offset, double bias, const Eigen::Isometry3d& base)
      : rod(rodWith(arm, offset)), model(rod), input(rod), r(offset), preload(bias) {
    input.base = base;
  }
  static Rod rodWith(const ElasticArm& arm, double offset) {
    Rod rod;
    rod.sections = {arm.distal};
    rod.sections[0].length = arm.arm.bending_length;
    rod.actuators = {{Actuator::kTendon, 0, offset * Vector3d::UnitX()},
                     {Actuator::kTendon, 0, -offset * Vector3d::UnitX()}};
    rod.tool = arm.arm.tool;
    return rod;
  }
  /// Difference of the tendons' lengths by 2 r, rad, for a difference of their tensions; NaN without a solution.
  double bendAt(double tension) {
    std::vector<RodPoint> shape;
    input.inputs.head<2>() << preload + tension / 2.0, preload - tension / 2.0;
    if (model.shape(input, branch, 201, shape) != ModelStatus::kOk)
      return std::nan("");
    double bend = 0.0;
    for (std::size_t k = 0; k < shape.size(); ++k) {
      const double weight = k == 0 || k + 1 == shape.size() ? 1.0 : k % 2 ? 4.0 : 2.0;
      const Vector3d turned = shape[k].curvature.cross(r * Vector3d::UnitX());
      bend += weight / 3.0 * rod.sections[0].length / 200.0 *
              ((shape[k].stretch - turned).norm() - (shape[k].stretch + turned).norm()) / (2.0 * r);
    }
    return bend;
  }
  /// Tension at which the difference of lengths is that of `bend`; NaN without one.
  double tensionFor(double bend, double from) {
    const double unit = rod.sections[0].moment_stiffness.y() / (rod.sections[0].length * r);
    double before = from, value = bendAt(before) - bend, tension = before - 0.8 * value * unit;
    for (int k = 0; k < 20 && std::abs(value) > 1e-10; ++k) {
      const double now = bendAt(tension) - bend, next = tension - now * (tension - before) / (now - value);
      before = tension;
      value = now;
      tension = next;
    }
    return std::abs(value) < 1e-8 ? before : std::nan("");
  }
  /// Tip at a difference of tensions.
  Eigen::Isometry3d tip(double tension) {
    kinematics::cosserat::RodAnswer answer;
    bendAt(tension);
    EXPECT_EQ(model.solve(input, branch, answer), ModelStatus::kOk);
    return answer.tip;
  }
  Rod rod;
  RodModel model;
  RodInput input;
  RodBranch branch;
  double r, preload;
};

/// Deflections by random loads against a rod with tendons: small strains, so that both theories agree.
TEST(Actuation, AgreesWithARodWithTendons) {
  int compared = 0;
  double worst[2] = {0.0, 0.0}, apart = 0.0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(40); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    ElasticArm arm = beam();
    arm.arm.base = anyPose(random);
    const double l = arm.arm.bending_length, ei = arm.distal.moment_stiffness.y(), r = 0.3e-3;
    arm.distal.force_stiffness *= 100.0;  // strains of shear and extension are neglected in the catheter's wires
    const Vector3d q(0.0, 0.0, random.uniform(-1.5, 1.5));
    const Wrench wrench = anyWrench(random, 0.6 * ei / (l * l), 0.2 * ei / l);
    TendonPair tendons(arm, r, ei / (l * r), arm.arm.base);
    const double start = tendons.tensionFor(q[2], ei * q[2] / (l * r));
    ASSERT_TRUE(std::isfinite(start));
    const Eigen::Isometry3d unloaded = tendons.tip(start);
    tendons.input.tip = wrench;
    Eigen::Matrix<double, 6, 2> moved, judged;
    bool solved = true;
    for (const Actuation actuation : {Actuation::kTension, Actuation::kDisplacement}) {
      const int column = actuation == Actuation::kDisplacement;
      const double tension = column ? tendons.tensionFor(q[2], start) : start;
      solved = solved && std::isfinite(tension);
      if (!solved)
        break;
      judged.col(column) = poseDifference(unloaded, tendons.tip(tension));
      const ElasticArm actuated = with(arm, actuation);
      moved.col(column) = poseDifference(tipOf(actuated, q, Wrench::Zero()).pose, tipOf(actuated, q, wrench).pose);
    }
    if (!solved)
      continue;
    const Eigen::DiagonalMatrix<double, 6> scale(1.0 / l, 1.0 / l, 1.0 / l, 1.0, 1.0, 1.0);
    for (int k = 0; k < 2; ++k) {
      const double error = (scale * (moved - judged).col(k)).norm() / (scale * judged.col(k)).norm();
      worst[k] = std::max(worst[k], error);
      EXPECT_LT(error, 0.02) << (k ? "displacement" : "tension");
    }
    apart = std::max(apart, (scale * (moved.col(0) - moved.col(1))).norm() / (scale * moved.col(1)).norm());
    ++compared;
  }
  std::printf("compared %d, worst %.1e at constant tension, %.1e at constant displacement, apart up to %.1f\n",
              compared, worst[0], worst[1], apart);
  EXPECT_GT(compared, 30);
  EXPECT_GT(apart, 1.0);
}

}  // namespace
}  // namespace tandem::test
