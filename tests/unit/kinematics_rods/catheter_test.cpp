// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <set>

#include "tests/unit/kinematics/differences.h"
#include "tests/unit/kinematics_rods/random_rods.h"

namespace tandem::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using kinematics::ModelStatus;
using kinematics::Tip;
using kinematics::catheter::Arm;
using kinematics::catheter::ConstantCurvature;

constexpr double kPi = std::numbers::pi;

TEST(Catheter, JacobianIsTheDerivativeStraightPoseIncluded) {
  double worst = 0.0;
  int straight = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(500); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const ConstantCurvature model(anyCatheter(random));
    const Vector3d q = anyCatheterJoints(random) + Vector3d(0.1, 0.0, 0.0);
    straight += q[2] == 0.0 ? 1 : 0;
    for (const bool at_tip : {true, false}) {
      const auto answer = [&](const Vector3d& joints) {
        Tip tip;
        EXPECT_EQ(at_tip ? model.tip(joints, tip) : model.bendingBase(joints, tip), ModelStatus::kOk);
        return tip;
      };
      const Tip here = answer(q);
      ASSERT_EQ(here.jacobian.cols(), 3);
      for (int j = 0; j < 3; ++j) {
        const Difference difference = differentiate(
            [&](double h) -> Eigen::VectorXd {
              return poseDifference(here.pose, answer(q + h * Vector3d::Unit(j)).pose);
            },
            j == 0 ? 0.02 : 0.2);
        ASSERT_LT(difference.error, 1e-9);
        const double error = (difference.value - here.jacobian.col(j)).norm() / std::max(1.0, difference.value.norm());
        EXPECT_LT(error, 1e-9) << "joint " << j << " at " << q.transpose();
        worst = std::max(worst, error);
      }
    }
  }
  std::printf("worst %.1e, straight %d\n", worst, straight);
  EXPECT_GT(straight, 5);
}

TEST(Catheter, BendIsSmoothThroughTheStraightPose) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(200); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const ConstantCurvature model(anyCatheter(random));
    Vector3d q = anyCatheterJoints(random);
    Tip before, here, after;
    q[2] = 0.0;
    ASSERT_EQ(model.tip(q, here), ModelStatus::kOk);
    const double step = std::pow(10.0, random.uniform(-9.0, -4.0));
    q[2] = -step;
    ASSERT_EQ(model.tip(q, before), ModelStatus::kOk);
    q[2] = step;
    ASSERT_EQ(model.tip(q, after), ModelStatus::kOk);
    EXPECT_LT((before.jacobian - here.jacobian).norm(), 2.0 * step);
    EXPECT_LT((after.jacobian - here.jacobian).norm(), 2.0 * step);
    EXPECT_LT((after.jacobian + before.jacobian - 2.0 * here.jacobian).norm(), 2.0 * step * step + 1e-15);
  }
}

/// A negative bend equals a positive bend with the roll changed by half a turn.
TEST(Catheter, NegativeBendIsAPositiveOneRolledByHalfATurn) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(100); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Arm arm = anyCatheter(random);
    arm.tool.translation().head<2>().setZero();
    const ConstantCurvature model(arm);
    const Vector3d q = anyCatheterJoints(random);
    Tip one, other;
    ASSERT_EQ(model.tip(q, one), ModelStatus::kOk);
    ASSERT_EQ(model.tip(Vector3d(q[0], q[1] + kPi, -q[2]), other), ModelStatus::kOk);
    EXPECT_LT((one.pose.translation() - other.pose.translation()).norm(), 1e-14);
  }
}

TEST(Catheter, ShapeIsAStraightPartAndAnArcThatEndsAtTheTip) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(100); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const Arm arm = anyCatheter(random);
    const ConstantCurvature model(arm);
    const Vector3d q = anyCatheterJoints(random);
    std::vector<kinematics::ShapePoint> shape;
    ASSERT_EQ(model.shape(q, 401, shape), ModelStatus::kOk);
    Tip tip;
    ASSERT_EQ(model.tip(q, tip), ModelStatus::kOk);
    EXPECT_LT(
        (shape.back().pose * arm.tool * tip.pose.inverse()).matrix().operator-(Eigen::Matrix4d::Identity()).norm(),
        1e-13);
    double length = 0.0;
    for (std::size_t k = 1; k < shape.size(); ++k) {
      const double chord = (shape[k].pose.translation() - shape[k - 1].pose.translation()).norm();
      length += chord;
      EXPECT_LE(chord, shape[k].s - shape[k - 1].s + 1e-15);
    }
    EXPECT_NEAR(length, q[0] + arm.bending_length, 1e-3 * arm.bending_length);
  }
}

TEST(Catheter, RefusesInvalidInput) {
  Random random(baseSeed());
  Arm arm = anyCatheter(random);
  const ConstantCurvature model(arm);
  Tip tip;
  EXPECT_EQ(model.tip(Eigen::Vector2d(0.1, 0.2), tip), ModelStatus::kWrongSize);
  EXPECT_EQ(model.tip(Vector3d(0.1, std::nan(""), 0.2), tip), ModelStatus::kNotFinite);
  EXPECT_EQ(model.tip(Vector3d(-1e-6, 0.0, 0.2), tip), ModelStatus::kDistalInside);
  EXPECT_TRUE(tip.pose.isApprox(Isometry3d::Identity(), 0.0)) << "touched";
  arm.bending_length = 0.0;
  EXPECT_THROW(ConstantCurvature{arm}, std::invalid_argument);
  arm.bending_length = 0.05;
  arm.tool.translation().x() = std::nan("");
  EXPECT_THROW(ConstantCurvature{arm}, std::invalid_argument);
}

// Equations of Norouzi-Ghazbi et al., as printed, in their variables.

struct Printed {
  double d1, theta2, theta3, L, d7;
  double d4() const { return L / (kPi / 2 - theta3) * std::cos(theta3); }  // (9)

  /// Table I. @param modified  Craig's convention, as in its caption, or the classical one
  /// @param sign  of theta_3 in link 5; printed: 1
  Eigen::Matrix4d table(bool modified, double sign) const {
    const double half = kPi / 2;
    const double rows[6][3] = {{0, d1, 0},
                               {half, 0, kPi + theta2},
                               {half, 0, half + theta3},
                               {half, d4(), 0},
                               {half, 0, 3 * half + sign * theta3},
                               {0, d7, 0}};
    Isometry3d pose = Isometry3d::Identity();
    for (const auto& [alpha, d, theta] : rows) {
      const Eigen::AngleAxisd twist(alpha, Vector3d::UnitX());
      if (modified)
        pose = pose * twist;
      pose = pose * Eigen::AngleAxisd(theta, Vector3d::UnitZ()) * Eigen::Translation3d(0.0, 0.0, d);
      if (!modified)
        pose = pose * twist;
    }
    return pose.matrix();
  }

  /// (7); the paper gives no value of d_3, which is the parameter `d3` here.
  Eigen::Matrix4d pose(double d3) const {
    const double c2 = std::cos(theta2), s2 = std::sin(theta2), C = std::cos(2 * theta3), S = std::sin(2 * theta3);
    const double c3 = std::cos(theta3), s3 = std::sin(theta3);
    Eigen::Matrix4d a;
    a << c2 * C, s2, -S * c2, -c2 * (d4() * c3 + d7 * S),  //
        s2 * C, -c2, -S * s2, -s2 * (d4() * c3 + d7 * S),  //
        -S, 0, -C, d1 + d3 * s3 - d7 * C,                  //
        0, 0, 0, 1;
    return a;
  }

  /// (8); columns theta_2, theta_3, d_1.
  Eigen::Matrix<double, 6, 3> jacobian() const {
    const double c2 = std::cos(theta2), s2 = std::sin(theta2), C = std::cos(2 * theta3), S = std::sin(2 * theta3);
    const double c3 = std::cos(theta3), s3 = std::sin(theta3), phi = kPi / 2 - theta3;
    const double slope = L * (-S / phi + c3 * c3 / (phi * phi)), across = L * c3 * c3 / phi + d7 * S;
    Eigen::Matrix<double, 6, 3> j;
    j << s2 * across, -c2 * (slope + 2 * d7 * c3), 0,           //
        -c2 * across, -s2 * (slope + 2 * d7 * s3), 0,           //
        0, d7 * s3 + L * C / phi + L * S / (2 * phi * phi), 1,  //
        0, -2 * s2, 0,                                          //
        0, 2 * c2, 0,                                           //
        1, 0, 0;
    return j;
  }

  /// (8) with the three entries corrected.
  Eigen::Matrix<double, 6, 3> corrected() const {
    Eigen::Matrix<double, 6, 3> j = jacobian();
    const double c2 = std::cos(theta2), s2 = std::sin(theta2), c3 = std::cos(theta3), s3 = std::sin(theta3);
    j(0, 1) += -c2 * 2 * d7 * (std::cos(2 * theta3) - c3);
    j(1, 1) += -s2 * 2 * d7 * (std::cos(2 * theta3) - s3);
    j(2, 1) += d7 * (2 * std::sin(2 * theta3) - s3);
    return j;
  }
};

/// A catheter in the paper's variables, and the model's result for it.
struct PaperCase {
  explicit PaperCase(Random& random) {
    Arm arm;
    arm.bending_length = random.uniform(0.02, 0.1);
    arm.tool.translation().z() = random.uniform(0.002, 0.02);
    const ConstantCurvature model(arm);
    const Vector3d q(random.uniform(0.01, 0.3), random.uniform(-3.0, 3.0), random.uniform(0.3, 2.5));
    printed = {q[0], q[1] + kPi, (kPi - q[2]) / 2, arm.bending_length, arm.tool.translation().z()};
    status = model.tip(q, tip);
    // Columns theta_2, theta_3, d_1: d bend / d theta_3 = -2.
    jacobian << tip.jacobian.col(1), -2.0 * tip.jacobian.col(2), tip.jacobian.col(0);
  }
  Printed printed{};
  Tip tip;
  ModelStatus status;
  Eigen::Matrix<double, 6, 3> jacobian;
};

template <class Matrix>
std::set<std::pair<int, int>> differing(const Matrix& one, const Matrix& other) {
  std::set<std::pair<int, int>> entries;
  for (int row = 0; row < one.rows(); ++row) {
    for (int column = 0; column < one.cols(); ++column) {
      if (std::abs(one(row, column) - other(row, column)) > 1e-12)
        entries.emplace(row + 1, column + 1);
    }
  }
  return entries;
}

using Entries = std::set<std::pair<int, int>>;

TEST(CatheterMisprints, EquationEightDiffersInThreeEntries) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(200); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const PaperCase at(random);
    ASSERT_EQ(at.status, ModelStatus::kOk);
    EXPECT_EQ(differing(at.printed.jacobian(), at.jacobian), (Entries{{1, 2}, {2, 2}, {3, 2}}));
    EXPECT_EQ(differing(at.printed.corrected(), at.jacobian), Entries{});
  }
}

TEST(CatheterMisprints, EquationSevenIsThePoseOnceD3IsD4) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(200); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const PaperCase at(random);
    EXPECT_EQ(differing(at.printed.pose(at.printed.d4()), at.tip.pose.matrix()), Entries{});
    EXPECT_EQ(differing(at.printed.pose(0.0), at.tip.pose.matrix()), (Entries{{3, 4}}));
  }
}

TEST(CatheterMisprints, TableOneUsesClassicalDhAndItsLinkFiveHasTheWrongSign) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(200); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const PaperCase at(random);
    EXPECT_EQ(differing(at.printed.table(false, -1.0), at.tip.pose.matrix()), Entries{});
    EXPECT_NE(differing(at.printed.table(false, 1.0), at.tip.pose.matrix()), Entries{});
    EXPECT_NE(differing(at.printed.table(true, 1.0), at.tip.pose.matrix()), Entries{});
    EXPECT_NE(differing(at.printed.table(true, -1.0), at.tip.pose.matrix()), Entries{});
    // As printed the tip points back to the base for any bend.
    EXPECT_NEAR(at.printed.table(false, 1.0)(2, 2), -1.0, 1e-12);
  }
}

}  // namespace
}  // namespace tandem::test
