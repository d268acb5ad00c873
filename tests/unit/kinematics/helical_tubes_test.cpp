// SPDX-License-Identifier: Apache-2.0
#include "kinematics/detail/relaxation.h"
#include "kinematics/rigid_model.h"
#include "kinematics/tube_loads.h"
#include "tests/unit/kinematics/arms.h"

namespace tandem::test {
namespace {

using Eigen::Vector3d;
using kinematics::Branch;
using kinematics::CompliantModel;
using kinematics::ConcentricTubeArm;
using kinematics::makeArmModel;
using kinematics::ModelStatus;
using kinematics::RigidModel;
using kinematics::ShapePoint;
using kinematics::Tip;

constexpr int kArms = 100;

/// Tubes with one curvature and one torsion over all of their part in front of the entry point; straight behind it, and
/// there the helix begins `behind` of it. The same torsion for all, or one each.
struct Helices {
  ConcentricTubeArm arm;
  Eigen::VectorXd q;
  std::vector<double> behind;

  Helices(Random& random, bool alike) {
    const int n = random.integer(2, 4);
    q.resize(2 * n);
    double inner = 0.6e-3, length = random.uniform(0.08, 0.15);
    const double common = random.uniform(5.0, 40.0) * (random.chance(0.5) ? 1.0 : -1.0);
    for (int i = 0; i < n; ++i, length *= random.uniform(0.5, 0.9)) {
      kinematics::Tube tube{inner + 0.3e-3, inner, 60e9, random.uniform(0.2, 0.5), {}};
      const double straight = 0.4 - 0.08 * i;
      behind.push_back(random.uniform(0.0, 0.05));
      tube.addSection(straight, 0.0);
      tube.addSection(length + behind.back(), random.uniform(2.0, 12.0), alike ? common : random.uniform(-40.0, 40.0));
      arm.tubes.push_back(tube);
      q[i] = -straight - behind.back();
      q[n + i] = random.uniform(-std::numbers::pi, std::numbers::pi);
      inner += 0.35e-3;
    }
  }
  double torsion(int tube) const { return arm.tubes[static_cast<std::size_t>(tube)].sections.back().helix_torsion; }
  /// Circular tubes that bend in the same directions at the entry point.
  Helices planar() const {
    Helices other = *this;
    for (int i = 0; i < arm.tubeCount(); ++i) {
      other.q[arm.tubeCount() + i] += torsion(i) * behind[static_cast<std::size_t>(i)];
      other.arm.tubes[static_cast<std::size_t>(i)].sections.back().helix_torsion = 0.0;
    }
    return other;
  }
};

/// A tube alone is the helix of its curvature and torsion: on a cylinder of radius kappa / (kappa^2 + tau^2), with the
/// pitch 2 pi tau / (kappa^2 + tau^2), right-handed for tau > 0.
TEST(HelicalTubes, AloneAreHelices) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int k = 0; k < kArms; ++k) {
    Helices one(random, false);
    const int n = one.arm.tubeCount();
    for (int i = 1; i < n; ++i)
      one.q[i] = -one.arm.tubes[static_cast<std::size_t>(i)].length() - 0.01;  // behind the entry point
    const double kappa = one.arm.tubes[0].sections.back().curvature, tau = one.torsion(0);
    const double square = kappa * kappa + tau * tau, radius = kappa / square, turns = std::sqrt(square);
    const double direction = one.q[n] + tau * one.behind[0];  // in which it bends at the entry point
    const Vector3d normal(std::cos(direction), std::sin(direction), 0.0), binormal = Vector3d::UnitZ().cross(normal);
    const Vector3d axis = (tau * Vector3d::UnitZ() + kappa * binormal) / turns, center = radius * normal;
    for (const char* name : {"rigid", "compliant"}) {
      std::vector<ShapePoint> shape;
      const auto model = makeArmModel(name, one.arm);
      ASSERT_EQ(model->shape(one.q, 60, shape), ModelStatus::kOk);
      for (const ShapePoint& point : shape) {
        const Vector3d expected =
            center + Eigen::AngleAxisd(turns * point.s, axis) * (-radius * normal) + axis * (tau / turns * point.s);
        ASSERT_LT((point.pose.translation() - expected).norm(), 1e-12) << name << ", arm " << k << ", s " << point.s;
        EXPECT_NEAR(point.curvature.norm(), kappa, 1e-9);
        const Vector3d bends = Eigen::AngleAxisd(turns * point.s, axis) * normal;
        EXPECT_LT((point.pose.linear().col(0) - bends).norm(), 1e-11) << "x is the direction in which the tube bends";
      }
      Tip tip;
      ASSERT_EQ(model->tip(one.q, tip), ModelStatus::kOk);
      EXPECT_LT((tip.pose.matrix() - shape.back().pose.matrix()).norm(), 1e-11);
      EXPECT_NEAR(tip.stability, 1.0, 1e-12);
    }
  }
}

/// Helices of one torsion are circular tubes whose cross-sections all turn by tau per length: the same angles between
/// the tubes, moments, energy and stability at every s; only the backbone is another.
TEST(HelicalTubes, OfOneTorsionTwistEachOtherAsCircularOnes) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  int twisted = 0;
  for (int k = 0; k < kArms; ++k) {
    const Helices one(random, true), planar = one.planar();
    const int n = one.arm.tubeCount();
    Branch branch, other;
    Tip tip, circular;
    std::vector<ShapePoint> shape, arcs;
    const CompliantModel model(one.arm), flat(planar.arm);
    ASSERT_EQ(model.tip(one.q, branch, tip), ModelStatus::kOk);
    ASSERT_EQ(flat.tip(planar.q, other, circular), ModelStatus::kOk);
    EXPECT_NEAR(tip.stability, circular.stability, 1e-8);
    EXPECT_NEAR(tip.stability_at, circular.stability_at, 1e-4);
    EXPECT_GT((tip.pose.translation() - circular.pose.translation()).norm(), 1e-4);
    ASSERT_EQ(model.shape(one.q, kinematics::Wrench::Zero(), branch, 40, shape), ModelStatus::kOk);
    ASSERT_EQ(flat.shape(planar.q, kinematics::Wrench::Zero(), other, 40, arcs), ModelStatus::kOk);
    for (std::size_t j = 0; j < shape.size(); ++j) {
      for (int i = 0; i < shape[j].outermost_tube; ++i) {
        const auto tube = static_cast<std::size_t>(i);
        EXPECT_NEAR(shape[j].psi[tube], arcs[j].psi[tube] + one.torsion(0) * shape[j].s, 1e-7);
        EXPECT_NEAR(shape[j].moment[tube], arcs[j].moment[tube], 1e-9);
        twisted += std::abs(arcs[j].moment[tube]) > 1e-5 ? 1 : 0;
      }
    }
    const auto loads = [&](const Helices& of, const Branch& at) {
      kinematics::Segmentation parts;
      segment(of.arm, of.q, parts);
      return tubeLoads(of.arm, parts, kinematics::TubeJoints(of.q).beta, at.end_angle);
    };
    EXPECT_NEAR(loads(one, branch).energy, loads(planar, other).energy, 1e-7 * loads(planar, other).energy);
    EXPECT_LT((loads(one, branch).couple - loads(planar, other).couple).norm(), 1e-7) << n;
  }
  EXPECT_GT(twisted, 1000);
}

/// Goes over into the closed form of circular tubes, in proportion to the torsion.
TEST(HelicalTubes, BecomeCircularAsTheirTorsionVanishes) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int k = 0; k < kArms; ++k) {
    Helices one(random, false);
    Helices planar = one;
    for (kinematics::Tube& tube : planar.arm.tubes)
      tube.sections.back().helix_torsion = 0.0;
    for (const char* name : {"rigid", "compliant"}) {
      Tip circular;
      ASSERT_EQ(makeArmModel(name, planar.arm)->tip(planar.q, circular), ModelStatus::kOk);
      double before = 0.0;
      for (const double share : {1e-7, 2e-7}) {
        Helices little = one;
        for (kinematics::Tube& tube : little.arm.tubes)
          tube.sections.back().helix_torsion *= share;
        Tip tip;
        ASSERT_EQ(makeArmModel(name, little.arm)->tip(little.q, tip), ModelStatus::kOk);
        const double away = (tip.pose.matrix() - circular.pose.matrix()).norm();
        EXPECT_LT(away, 1e-4 / circular.stability);
        EXPECT_LT((tip.jacobian - circular.jacobian).norm(), 1e-3 / circular.stability);
        if (before > 0.0) {
          EXPECT_NEAR(away / before, 2.0, 1e-2) << name << ", arm " << k;
        }
        before = away;
      }
    }
  }
}

/// The work of a motor's moment is the change of the elastic energy.
TEST(HelicalTubes, MomentsAreTheDerivativeOfTheEnergy) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int k = 0; k < kArms; ++k) {
    const Helices one(random, false);
    const CompliantModel model(one.arm);
    const auto energy_at = [&](const Eigen::VectorXd& q, Branch branch) {
      Tip tip;
      EXPECT_EQ(model.tip(q, branch, tip), ModelStatus::kOk);
      kinematics::Segmentation parts;
      segment(one.arm, q, parts);
      return tubeLoads(one.arm, parts, kinematics::TubeJoints(q).beta, branch.end_angle).energy;
    };
    Branch branch;
    Tip tip;
    std::vector<ShapePoint> shape;
    ASSERT_EQ(model.tip(one.q, branch, tip), ModelStatus::kOk);
    ASSERT_EQ(model.shape(one.q, kinematics::Wrench::Zero(), branch, 2, shape), ModelStatus::kOk);
    for (int i = 0; i < one.arm.tubeCount() && tip.stability > 0.1; ++i) {
      constexpr double kStep = 1e-3;
      Eigen::VectorXd more = one.q, less = one.q;
      more[one.arm.tubeCount() + i] += kStep;
      less[one.arm.tubeCount() + i] -= kStep;
      // A motor that turns further twists its tube less: t_i = c_i psi_i' points the other way.
      const double work = (energy_at(more, branch) - energy_at(less, branch)) / (2.0 * kStep);
      EXPECT_NEAR(work, -shape.front().moment[static_cast<std::size_t>(i)], 2e-7) << "arm " << k << ", tube " << i;
    }
  }
}

/// The descent of the energy arrives at the equilibrium that the boundary value problem gives.
TEST(HelicalTubes, RelaxToTheirEquilibrium) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int k = 0; k < kArms; ++k) {
    const Helices one(random, false);
    Branch branch;
    Tip tip;
    ASSERT_EQ(CompliantModel(one.arm).tip(one.q, branch, tip), ModelStatus::kOk);
    if (tip.stability < 0.2)
      continue;  // so flat that finite elements may leave it
    kinematics::Segmentation parts;
    segment(one.arm, one.q, parts);
    kinematics::TubeVector theta = branch.end_angle;
    ASSERT_TRUE(relax(one.arm, parts, one.q, 0.02 * kinematics::TubeVector(0.0, 1.0, 2.0, 3.0), theta));
    EXPECT_LT((theta - branch.end_angle).head(one.arm.tubeCount()).norm(), 2e-2) << "arm " << k;
  }
}

/// A helix that is held straight in the guide presses on it all along; a circular tube at its ends only.
TEST(HelicalTubes, PressOnTheirGuide) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  for (int k = 0; k < kArms; ++k) {
    Helices one(random, false);
    for (int i = 1; i < one.arm.tubeCount(); ++i)
      one.q[i] = -one.arm.tubes[static_cast<std::size_t>(i)].length() - 0.01;
    const kinematics::TubeSection& bend = one.arm.tubes[0].sections.back();
    const double moment = bend.bending_stiffness * bend.curvature, tau = std::abs(bend.helix_torsion);
    kinematics::Segmentation parts;
    segment(one.arm, one.q, parts);
    const kinematics::TubeVector theta = untwistedEnds(one.arm, parts, one.q);
    const auto loads = tubeLoads(one.arm, parts, kinematics::TubeJoints(one.q).beta, theta, false);
    EXPECT_NEAR(loads.force[0], moment * tau * (2.0 + tau * one.behind[0]), 1e-9);
    EXPECT_NEAR(loads.couple[0], 2.0 * moment, 1e-9);
  }
}

TEST(HelicalTubes, HaveNoTorsionWhereTheyAreStraight) {
  ConcentricTubeArm arm = arkArm(0.0);
  arm.tubes[1].sections[0].helix_torsion = 1.0;
  EXPECT_THROW(checkArm(arm), std::invalid_argument);
  arm.tubes[1].sections[0].helix_torsion = 0.0;
  arm.tubes[1].sections[1].helix_torsion = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(checkArm(arm), std::invalid_argument);
}

}  // namespace
}  // namespace tandem::test
