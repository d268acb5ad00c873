// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "insertion_arms.h"

namespace tandem::test {
namespace {

using Eigen::Vector3d;

constexpr int kRandomArms = 100;

/// Position on the backbone of tubes with constant curvature and one torsion tau in front of the entry point, in closed
/// form: arcs of helices, or circles, between the ends of the tubes. In the frame that turns about the backbone by tau
/// per length u = (0, 0, tau) + sum EI_i kappa_i (-sin psi_i, cos psi_i, 0) / sum EI_i is constant, with psi_i the
/// direction in which tube i bends at the entry point.
Vector3d onArcs(const kinematics::ConcentricTubeArm& arm, const Eigen::VectorXd& q, double s) {
  const int n = arm.tubeCount();
  Eigen::Isometry3d frame = arm.base;
  double from = 0.0;
  const double torsion = arm.tubes[0].sections.back().helix_torsion;
  for (int present = n; present >= 1 && from < s; --present) {
    const double to = std::min(s, q[present - 1] + arm.tubes[static_cast<std::size_t>(present - 1)].length());
    Vector3d u = Vector3d::Zero();
    double stiffness = 0.0;
    for (int i = 0; i < present; ++i) {
      const kinematics::TubeSection& bend = arm.tubes[static_cast<std::size_t>(i)].sections.back();
      const double behind = -q[i] - arm.tubes[static_cast<std::size_t>(i)].sections.front().length;
      const double psi = q[n + i] + torsion * behind;
      u += bend.bending_stiffness * bend.curvature * Vector3d(-std::sin(psi), std::cos(psi), 0.0);
      stiffness += bend.bending_stiffness;
    }
    u /= stiffness;
    u.z() = torsion;
    const double piece = to - from, rate = u.norm(), angle = rate * piece;
    const Vector3d axis = u / rate, z = Vector3d::UnitZ(), along = axis.z() * axis, across = z - along;
    Eigen::Isometry3d arc = Eigen::Isometry3d::Identity();
    arc.linear() = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
    arc.translation() = piece * along + (std::sin(angle) * across + (1.0 - std::cos(angle)) * axis.cross(z)) / rate;
    frame = frame * arc;
    from = to;
  }
  return frame.translation();
}

/// Largest distance of a point where the tip has been from the shaft, by many points of the shaft.
double deviationByPoints(const Deployment& of, const Eigen::MatrixXd& path) {
  constexpr int kMany = 4001;
  std::vector<Vector3d> leader;
  double largest = 0.0;
  for (Eigen::Index k = 0; k < path.cols(); ++k) {
    std::vector<kinematics::ShapePoint> shape;
    EXPECT_EQ(of.model->shape(path.col(k), kMany, shape), kinematics::ModelStatus::kOk);
    for (std::size_t i = 0; k == 0 && i < shape.size(); i += 40)
      leader.push_back(shape[i].pose.translation());
    leader.push_back(shape.back().pose.translation());
    for (const Vector3d& x : leader) {
      double nearest = 1.0;
      for (const auto& point : shape)
        nearest = std::min(nearest, (point.pose.translation() - x).norm());
      largest = std::max(largest, nearest);
    }
  }
  return largest;
}

/// Gilbert, Neimat & Webster 2015, circular case: at every point of the insertion the whole shaft is on the curve that
/// the arcs of circles of its end make, however the tubes are turned.
TEST(Insertion, OfCurvedTubesFollowsItsLeaderExactly) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int i = 0; i < kRandomArms; ++i) {
    Deployment one(random, "rigid", false);
    const Eigen::MatrixXd path = one.path();
    double away = 0.0;
    for (int k = 0; k <= kPoints; ++k) {
      const double length = one.length(path.col(k));
      std::vector<double> s;
      for (int j = 0; j <= 20; ++j)
        s.push_back(length * j / 20);
      kinematics::Branch branch;
      std::vector<kinematics::BackbonePoint> shaft;
      ASSERT_EQ(one.model->backbone(path.col(k), branch, s, false, shaft), kinematics::ModelStatus::kOk);
      for (const auto& point : shaft)
        away = std::max(away, (point.position - onArcs(one.arm, path.col(kPoints), point.s)).norm());
    }
    EXPECT_LT(away, 1e-12) << "arm " << i;
    EXPECT_LT(one.deviation(), 1e-9) << "arm " << i;
  }
}

/// Largest distance of the shaft, at every point of the insertion, from the curve that it makes at the last one.
double awayFromLast(Deployment& of, const Eigen::MatrixXd& path) {
  constexpr int kPlaces = 20;
  const auto shaft = [&](int k, const std::vector<double>& s) {
    kinematics::Branch branch;
    std::vector<kinematics::BackbonePoint> points;
    EXPECT_EQ(of.model->backbone(path.col(k), branch, s, false, points), kinematics::ModelStatus::kOk);
    return points;
  };
  double away = 0.0;
  for (int k = 0; k <= kPoints; ++k) {
    std::vector<double> s;
    for (int j = 0; j <= kPlaces; ++j)
      s.push_back(of.length(path.col(k)) * j / kPlaces);
    const auto now = shaft(k, s), last = shaft(kPoints, s);
    for (std::size_t j = 0; j < s.size(); ++j)
      away = std::max(away, (now[j].position - last[j].position).norm());
  }
  return away;
}

/// The same paper, helical case. Rigid in torsion: every tube on its own helix, however it is turned. With torsion:
/// helices of one torsion that bend in one plane everywhere, to the same side or to opposite ones.
TEST(Insertion, OfHelicalTubesFollowsItsLeaderExactly) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int i = 0; i < kRandomArms; ++i) {
    Deployment any(random, "rigid", false, Helix::kAny);
    EXPECT_LT(awayFromLast(any, any.path()), 1e-11) << "arm " << i;
    EXPECT_LT(any.deviation(), 1e-9) << "arm " << i;
    for (const char* kind : {"rigid", "compliant"}) {
      Deployment alike(random, kind, true, Helix::kCommon);
      // alpha such that all bend in one direction at the entry point
      for (int tube = 0; tube < alike.tubes(); ++tube) {
        kinematics::TubeSection& bend = alike.arm.tubes[static_cast<std::size_t>(tube)].sections.back();
        bend.curvature = std::abs(bend.curvature);
        alike.q[alike.tubes() + tube] -= alike.model->helixAngle(alike.q, tube);
      }
      alike.remake(kind);
      const Eigen::MatrixXd path = alike.path();
      EXPECT_LT(awayFromLast(alike, path), 1e-11) << kind << ", arm " << i;
      EXPECT_LT(alike.deviation(), 1e-8) << kind << ", arm " << i;
      Vector3d tip = Vector3d::Zero();
      for (int k = 0; k <= kPoints; ++k) {
        kinematics::Tip end;
        ASSERT_EQ(alike.model->tip(path.col(k), end), kinematics::ModelStatus::kOk);
        tip = end.pose.translation();
        EXPECT_LT((tip - onArcs(alike.arm, path.col(kPoints), alike.length(path.col(k)))).norm(), 1e-11)
            << "point " << k;
      }
      EXPECT_GT((tip - onArcs(alike.arm, path.col(0), alike.length(path.col(0)))).norm(), 1e-3);
    }
  }
}

/// What the conditions exclude leaves the path: tubes that advance without turning, elastic ones of different torsion
/// or in different directions.
TEST(Insertion, OfHelicalTubesOutsideTheConditionsLeavesItsPath) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int i = 0; i < 20; ++i) {
    Deployment stiff(random, "rigid", false, Helix::kAny);
    Eigen::MatrixXd path = stiff.path();
    path.bottomRows(stiff.tubes()).colwise() = Eigen::VectorXd(path.col(0).tail(stiff.tubes()));
    EXPECT_GT(awayFromLast(stiff, path), 1e-5) << "does not turn, arm " << i;
    EXPECT_GT(planning::leaderDeviation(stiff.arms, 0, path).distance, 1e-5);
    for (const Helix helix : {Helix::kAny, Helix::kCommon}) {
      Deployment elastic(random, "compliant", false, helix);
      for (int tube = 0; tube < elastic.tubes(); ++tube) {
        const double apart = helix == Helix::kCommon ? 1.5 * tube : 0.0;
        elastic.q[elastic.tubes() + tube] = apart - elastic.model->helixAngle(elastic.q, tube);
      }
      EXPECT_GT(awayFromLast(elastic, elastic.path()), 1e-9)
          << (helix == Helix::kAny ? "different torsions" : "turned") << ", arm " << i;
    }
  }
}

/// What the conditions exclude leaves the path, by what many points of the shaft say: tubes that end apart but advance
/// together, inner ones before outer ones, a bend that moves in front of the entry point.
TEST(Insertion, OutsideTheConditionsLeavesItsPathAsSaid) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int i = 0; i < 9; ++i) {
    Deployment one(random, "rigid", false);
    if (i % 3 == 0) {
      one.q[0] += 0.02;
    } else if (i % 3 == 1) {
      std::ranges::reverse(one.insertion().stages);
    } else {
      one.q.head(one.tubes()).array() += kCurved;
    }
    const Eigen::MatrixXd path = one.path();
    const planning::LeaderDeviation said = planning::leaderDeviation(one.arms, 0, path);
    EXPECT_NEAR(said.distance, deviationByPoints(one, path), 1e-5) << "case " << i;
    EXPECT_GT(said.distance, 1e-6) << "case " << i;
    EXPECT_GT(said.point, 0);
  }
}

/// Elastic tubes twist each other unless they are bent in one plane.
TEST(Insertion, OfElasticTubesFollowsItsLeaderInOnePlaneOnly) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int i = 0; i < 20; ++i) {
    Deployment one(random, "compliant", true);
    for (kinematics::Tube& tube : one.arm.tubes)
      tube.sections.back().curvature = std::abs(tube.sections.back().curvature);
    one.remake("compliant");
    EXPECT_LT(one.deviation(), 2e-8) << "arm " << i;
    one.q[one.tubes()] += 1.5;
    EXPECT_GT(one.deviation(), 2e-7) << "arm " << i;
  }
}

TEST(Insertion, RefusesTubesThatTheArmDoesNotHave) {
  Random random(1);
  Deployment one(random, "rigid", true);
  one.insertion().stages = {{one.tubes() + 1, 0.01}};
  EXPECT_THROW(planning::setInsertion(one.arms, one.q, one.spec), std::invalid_argument);
  one.insertion().stages = {{1, 0.01}};
  EXPECT_THROW(planning::sample(one.spec, {Vector3d::Zero(), Vector3d::Zero()}), std::invalid_argument)
      << "the joints at the start are not known";
  one.q[0] = -1.0;
  EXPECT_THROW(planning::setInsertion(one.arms, one.q, one.spec), std::invalid_argument) << "no solution of the model";
}

}  // namespace
}  // namespace tandem::test
