// SPDX-License-Identifier: Apache-2.0
/** @file The Cosserat rod in cases with a closed-form solution. */
#include <gtest/gtest.h>

#include <boost/math/special_functions/ellint_1.hpp>
#include <boost/math/special_functions/ellint_2.hpp>

#include "tests/unit/kinematics/differences.h"
#include "tests/unit/kinematics_rods/random_rods.h"

namespace tandem::test {
namespace {

using Eigen::Vector3d;
using kinematics::ModelStatus;
using kinematics::Tip;
using kinematics::Wrench;
using kinematics::cosserat::Actuator;
using kinematics::cosserat::Matrix6;
using kinematics::cosserat::Rod;
using kinematics::cosserat::RodAnswer;
using kinematics::cosserat::RodBranch;
using kinematics::cosserat::RodInput;
using kinematics::cosserat::RodModel;
using kinematics::cosserat::Section;

/// One straight section.
Rod straightRod(Random& random) {
  Rod rod;
  const double diameter = random.uniform(1e-3, 3e-3);
  rod.sections.push_back(kinematics::cosserat::tubeSection(random.uniform(0.05, 0.3), diameter, 0.5 * diameter,
                                                           random.uniform(0.1e9, 60e9), random.uniform(0.2, 0.49)));
  return rod;
}

RodAnswer answerOf(const Rod& rod, const RodInput& input) {
  RodBranch branch;
  RodAnswer answer;
  EXPECT_EQ(RodModel(rod).solve(input, branch, answer), ModelStatus::kOk);
  return answer;
}

TEST(RodClosedForm, IsConstantCurvatureWithoutALoad) {
  double worst = 0.0, worst_column = 0.0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(200); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const auto arm = anyCatheter(random);
    const Vector3d q = anyCatheterJoints(random);
    Rod rod;
    rod.sections = {kinematics::cosserat::tubeSection(0.1, 2.3e-3, 1.2e-3, 1e9, 0.4),
                    kinematics::cosserat::tubeSection(arm.bending_length, 2.3e-3, 1.6e-3, 0.3e9, 0.4)};
    for (Section& section : rod.sections)
      section.force_stiffness.setConstant(1e9);
    rod.actuators = {{Actuator::kCurvature, 1, Vector3d(0.0, 1.0 / arm.bending_length, 0.0)}};
    rod.tool = arm.tool;
    RodInput input(rod);
    input.first_length = q[0];
    input.base = arm.base * Eigen::AngleAxisd(q[1], Vector3d::UnitZ());
    input.inputs[0] = q[2];
    const RodAnswer answer = answerOf(rod, input);
    Tip tip;
    ASSERT_EQ(kinematics::catheter::ConstantCurvature(arm).tip(q, tip), ModelStatus::kOk);
    const double distance = poseDifference(tip.pose, answer.tip).norm();
    EXPECT_LT(distance, 1e-9);
    Eigen::Matrix<double, 6, 3> jacobian;
    jacobian << answer.by_length, answer.by_base.rightCols<3>() * arm.base.linear().col(2), answer.by_input.col(0);
    EXPECT_LT((jacobian - tip.jacobian).cwiseAbs().maxCoeff(), 1e-8);
    EXPECT_EQ(answer.conjugate_points, 0);
    worst = std::max(worst, distance);
    worst_column = std::max(worst_column, (jacobian - tip.jacobian).cwiseAbs().maxCoeff());
  }
  std::printf("tips within %.1e, Jacobians within %.1e\n", worst, worst_column);
}

/// With stiff tendons the bend of constant curvature is tension times offset.
TEST(RodClosedForm, ATendonBendsAnArc) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(100); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Rod rod = straightRod(random);
    Section& section = rod.sections[0];
    section.force_stiffness *= 1e6;
    const double offset = random.uniform(0.3e-3, 1e-3), bend = random.uniform(0.0, 3.0);
    rod.actuators = {{Actuator::kTendon, 0, Vector3d(offset, 0.0, 0.0)}};
    RodInput input(rod);
    input.inputs[0] = bend / section.length * section.moment_stiffness.y() / offset;
    const RodAnswer answer = answerOf(rod, input);
    // A tendon at +x pulls the tip toward +x, a rotation about +y.
    const kinematics::Arc arc(Vector3d(0.0, bend / section.length, 0.0), section.length);
    EXPECT_LT((answer.tip.translation() - arc.position()).norm(), 1e-6 * section.length);
    EXPECT_LT((answer.tip.linear() - arc.rotation()).norm(), 1e-6);
  }
}

TEST(RodClosedForm, ComplianceOfACantileverIsThatOfTimoshenkosBeam) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(100); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const Rod rod = straightRod(random);
    const double l = rod.sections[0].length, ei = rod.sections[0].moment_stiffness.x();
    const double gj = rod.sections[0].moment_stiffness.z();
    const double ga = rod.sections[0].force_stiffness.x(), ea = rod.sections[0].force_stiffness.z();
    Matrix6 expected = Matrix6::Zero();
    expected.diagonal() << l * l * l / (3 * ei) + l / ga, l * l * l / (3 * ei) + l / ga, l / ea, l / ei, l / ei, l / gj;
    expected(0, 4) = expected(4, 0) = l * l / (2 * ei);
    expected(1, 3) = expected(3, 1) = -l * l / (2 * ei);
    RodInput input(rod);
    const RodAnswer free = answerOf(rod, input);
    const Eigen::Matrix<double, 6, 1> unit = expected.diagonal().cwiseSqrt();
    EXPECT_LT((unit.cwiseInverse().asDiagonal() * (free.compliance - expected) * unit.cwiseInverse().asDiagonal())
                  .cwiseAbs()
                  .maxCoeff(),
              1e-8);
    // A small force: beam theory up to the square of the angle.
    const double angle = 1e-5;
    input.tip.head<3>() = anyVector(random, 1.0).normalized() * angle * ei / (l * l);
    const RodAnswer loaded = answerOf(rod, input);
    const Vector3d expected_shift = expected.topLeftCorner<3, 3>() * input.tip.head<3>();
    EXPECT_LT((loaded.tip.translation() - Vector3d(0.0, 0.0, l) - expected_shift).norm(), 3.0 * angle * angle * l);
  }
}

TEST(RodClosedForm, AnEndMomentBendsACircle) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(100); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const Rod rod = straightRod(random);
    const double l = rod.sections[0].length, angle = random.uniform(-4.0, 4.0), plane = random.uniform(-3.0, 3.0);
    const Vector3d axis(std::cos(plane), std::sin(plane), 0.0);
    RodInput input(rod);
    input.tip.tail<3>() = rod.sections[0].moment_stiffness.x() * angle / l * axis;
    const RodAnswer answer = answerOf(rod, input);
    const kinematics::Arc arc(angle / l * axis, l);
    EXPECT_LT((answer.tip.translation() - arc.position()).norm(), 1e-9);
    EXPECT_LT((answer.tip.linear() - arc.rotation()).norm(), 1e-9);
  }
}

/// Bisshopp and Drucker 1945: a force P of constant direction, perpendicular to the clamped end.
TEST(RodClosedForm, ADeadForceBendsTheElastica) {
  double worst = 0.0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(100); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Rod rod = straightRod(random);
    const double l = rod.sections[0].length, ei = rod.sections[0].moment_stiffness.x();
    rod.sections[0].force_stiffness.setConstant(1e10 * ei / (l * l));
    const double k = random.uniform(0.72, 0.995), amplitude = std::asin(1.0 / (k * std::sqrt(2.0)));
    const double root = boost::math::ellint_1(k) - boost::math::ellint_1(k, amplitude);  // sqrt(P L^2 / E I)
    const double across = l * (1.0 - 2.0 / root * (boost::math::ellint_2(k) - boost::math::ellint_2(k, amplitude)));
    const double along = l * std::sqrt(2.0 * (2.0 * k * k - 1.0)) / root;
    const double slope = std::asin(2.0 * k * k - 1.0), plane = random.uniform(-3.0, 3.0);
    const Vector3d direction(std::cos(plane), std::sin(plane), 0.0);
    RodInput input(rod);
    input.tip.head<3>() = root * root * ei / (l * l) * direction;
    const RodAnswer answer = answerOf(rod, input);
    const Vector3d expected = across * direction + along * Vector3d::UnitZ();
    const double distance = (answer.tip.translation() - expected).norm() / l;
    EXPECT_LT(distance, 1e-8) << "P L^2 / E I = " << root * root;
    EXPECT_NEAR(std::asin(answer.tip.linear().col(2).dot(direction)), slope, 1e-7);
    EXPECT_EQ(answer.conjugate_points, 0);
    worst = std::max(worst, distance);
  }
  std::printf("elastica within %.1e of its length\n", worst);
}

TEST(RodClosedForm, TorsionAndTensionOfAStraightRod) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(100); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const Rod rod = straightRod(random);
    const double l = rod.sections[0].length, twist = random.uniform(-3.0, 3.0), stretch = random.uniform(-1e-4, 1e-2);
    RodInput input(rod);
    input.tip[5] = rod.sections[0].moment_stiffness.z() * twist / l;
    input.tip[2] = rod.sections[0].force_stiffness.z() * stretch;
    const RodAnswer answer = answerOf(rod, input);
    EXPECT_LT((answer.tip.translation() - Vector3d(0.0, 0.0, l * (1.0 + stretch))).norm(), 1e-11);
    EXPECT_LT((answer.tip.linear() - Eigen::AngleAxisd(twist, Vector3d::UnitZ()).toRotationMatrix()).norm(), 1e-10);
  }
}

/// Euler: a column clamped at one end buckles at pi^2 E I / 4 L^2, clamped at both at 4 pi^2 E I / L^2, in two planes.
TEST(RodClosedForm, AColumnBucklesAtEulersLoads) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(40); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Rod rod = straightRod(random);
    const double l = rod.sections[0].length;
    rod.sections[0].moment_stiffness.y() *= random.uniform(1.3, 2.0);
    const double ei = rod.sections[0].moment_stiffness.x(), other = rod.sections[0].moment_stiffness.y();
    rod.sections[0].force_stiffness.setConstant(1e6 * ei / (l * l));
    const double pi = std::numbers::pi;
    const auto indices = [&](double factor, double stiffness) {
      RodInput input(rod);
      input.base = anyPose(random);
      input.tip.head<3>() = -factor * pi * pi * stiffness / (l * l) * input.base.linear().col(2);
      const RodAnswer answer = answerOf(rod, input);
      return std::pair(answer.conjugate_points, answer.held_conjugate_points);
    };
    EXPECT_EQ(indices(0.25 * 0.99, ei).first, 0);
    EXPECT_EQ(indices(0.25 * 1.01, ei).first, 1);
    EXPECT_EQ(indices(0.25 * 1.01, other).first, 2);
    EXPECT_EQ(indices(4.0 * 0.99, ei).second, 0);
    EXPECT_EQ(indices(4.0 * 1.01, ei).second, 1);
    EXPECT_EQ(indices(4.0 * 1.01, other).second, 2);
  }
}

}  // namespace
}  // namespace tandem::test
