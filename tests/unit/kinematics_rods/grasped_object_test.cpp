// SPDX-License-Identifier: Apache-2.0
#include "kinematics/grasp/grasped_object.h"

#include <gtest/gtest.h>

#include "tests/unit/kinematics/differences.h"
#include "tests/unit/kinematics_rods/random_rods.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using kinematics::Wrench;
using kinematics::catheter::ElasticArm;
using kinematics::grasp::Contact;
using kinematics::grasp::ContactType;
using kinematics::grasp::Grasp;
using kinematics::grasp::GraspedObject;
using kinematics::grasp::GraspEquilibrium;
using kinematics::grasp::GraspStatus;
using kinematics::grasp::Matrix6;
using kinematics::grasp::Touch;
using kinematics::grasp::Twist;

constexpr ContactType kTypes[] = {ContactType::kFrictionless, ContactType::kPoint, ContactType::kSoftFinger,
                                  ContactType::kRigid};

Isometry3d turnedBy(const Isometry3d& pose, const Twist& twist) {
  Isometry3d result = pose;
  result.translation() += twist.head<3>();
  const double angle = twist.tail<3>().norm();
  if (angle > 0.0)
    result.linear() = Eigen::AngleAxisd(angle, twist.tail<3>() / angle) * pose.linear();
  return result;
}

/// Tips near the object's contacts; rigid contacts closed.
Contact anyContact(ContactType type, const Isometry3d& object, const Isometry3d& tip, Random& random) {
  Contact contact;
  contact.type = type;
  Isometry3d frame = anyPose(random);
  frame.translation() = tip.translation() + anyVector(random, 0.01);
  contact.frame = object.inverse() * frame;
  contact.hand = tip.inverse() * frame;
  return contact;
}

/// The contact velocity is the derivative of the contact gap, for tilted and displaced ones, too: contact forces and
/// velocities are power conjugate.
TEST(Touch, RowsAreTheDerivativesOfTheResidual) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(100); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const ContactType type = kTypes[random.integer(0, 3)];
    const Isometry3d object = anyPose(random);
    Isometry3d tip = anyPose(random);
    const Contact contact = anyContact(type, object, tip, random);
    const auto b = selection(type);
    Twist away = Twist::Zero();
    if (type != ContactType::kRigid)
      away << anyVector(random, 0.003), anyVector(random, 0.6);
    tip = turnedBy(tip, away);
    const Touch touch(contact, object, tip);
    for (int k = 0; k < 6; ++k) {
      const auto by = [&](bool arm) {
        return differentiate(
            [&](double h) -> VectorXd {
              const Twist step = h * Twist::Unit(k);
              return b *
                     Touch(contact, arm ? object : turnedBy(object, step), arm ? turnedBy(tip, step) : tip).residual();
            },
            k < 3 ? 1e-3 : 0.05);
      };
      EXPECT_LT((by(true).value - b * touch.rows(touch.to_tip).col(k)).norm(), 1e-8) << nameOf(type);
      EXPECT_LT((by(false).value + b * touch.rows(touch.to_body).col(k)).norm(), 1e-8) << nameOf(type);
    }
  }
}

TEST(Touch, StiffnessIsTheDerivativeOfTheWrenches) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(100); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const ContactType type = kTypes[random.integer(0, 3)];
    const Isometry3d object = anyPose(random), tip = turnedBy(object, Twist::Constant(0.2));
    const Contact contact = anyContact(type, object, anyPose(random), random);
    const auto b = selection(type);
    Twist force;
    force << anyVector(random, 1.0), anyVector(random, 0.02);
    force = b.transpose() * b * force;
    const auto stiffness = stiffnessOf(Touch(contact, object, tip), force);
    for (int k = 0; k < 6; ++k) {
      const auto by = [&](bool arm, bool of_arm) {
        return VectorXd(differentiate(
                            [&](double h) -> VectorXd {
                              const Twist step = h * Twist::Unit(k);
                              const Touch at(contact, arm ? object : turnedBy(object, step),
                                             arm ? turnedBy(tip, step) : tip);
                              return at.rows(of_arm ? at.to_tip : at.to_body).transpose() * force;
                            },
                            k < 3 ? 1e-3 : 0.05)
                            .value);
      };
      EXPECT_LT((by(true, true) - stiffness.on_arm_by_tip.col(k)).norm(), 1e-8);
      EXPECT_LT((by(false, true) - stiffness.on_arm_by_object.col(k)).norm(), 1e-8);
      EXPECT_LT((by(true, false) - stiffness.on_object_by_tip.col(k)).norm(), 1e-8);
      EXPECT_LT((by(false, false) - stiffness.on_object_by_object.col(k)).norm(), 1e-8);
    }
  }
}

/** Two or three soft catheters that grasp an object, with squeeze and load. */
struct Held {
  Held(Random& random, ContactType type, bool moments) : q(), load(Wrench::Zero()) {
    const int count = random.integer(2, 3);
    std::vector<Isometry3d> tips;
    q.resize(3 * count);
    for (int k = 0; k < count; ++k) {
      ElasticArm arm;
      arm.arm.bending_length = random.uniform(0.04, 0.08);
      arm.arm.tool.translation().z() = random.uniform(0.0, 0.015);
      const double around = 2.0 * std::numbers::pi * k / count;
      arm.arm.base = Isometry3d(Eigen::AngleAxisd(around, Vector3d::UnitZ())) * Eigen::Translation3d(-0.06, 0.0, 0.0);
      arm.proximal = kinematics::cosserat::tubeSection(0.1, 2.6e-3, 1.4e-3, random.uniform(1e9, 2e9), 0.4);
      arm.distal = kinematics::cosserat::tubeSection(0.1, 2.6e-3, 1.4e-3, random.uniform(0.2e9, 0.5e9), 0.4);
      arms.push_back(arm);
      q.segment<3>(3 * k) << random.uniform(0.03, 0.08), random.uniform(-0.3, 0.3), random.uniform(0.8, 1.6);
      kinematics::Tip tip;
      kinematics::catheter::ConstantCurvature(arm.arm).tip(q.segment<3>(3 * k), tip);
      tips.push_back(tip.pose);
      object.translation() += tip.pose.translation() / count;
    }
    object.linear() = anyPose(random).linear();
    for (const Isometry3d& tip : tips) {
      Isometry3d frame = Isometry3d::Identity();
      frame.translation() = tip.translation() + anyVector(random, random.chance(0.5) ? 3e-3 : 0.0);
      frame.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), object.translation() - tip.translation())
                           .toRotationMatrix();
      Contact contact;
      contact.type = type;
      contact.frame = object.inverse() * frame;
      contact.hand = tip.inverse() * frame;
      contacts.push_back(contact);
    }
    for (Eigen::Index j = 0; j < q.size(); ++j)
      q[j] += j % 3 == 0 ? random.uniform(-3e-3, 3e-3) : random.uniform(-0.05, 0.05);
    load.head<3>() = anyVector(random, 0.02);
    if (moments)
      load.tail<3>() = anyVector(random, 2e-4);
  }
  GraspedObject model() const { return {Grasp(contacts, 0.02), arms}; }

  std::vector<ElasticArm> arms;
  std::vector<Contact> contacts;
  Isometry3d object = Isometry3d::Identity();
  VectorXd q;
  Wrench load;
};

/// Contact types that carry any load.
ContactType anyHolding(Random& random) { return kTypes[random.integer(1, 3)]; }

TEST(GraspedObject, ForcesCarryTheLoadWithContactsClosed) {
  int held = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(60); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const Held scene(random, anyHolding(random), true);
    const GraspedObject model = scene.model();
    GraspEquilibrium equilibrium = model.start(scene.object);
    if (model.solveEquilibrium(scene.q, scene.load, equilibrium) != GraspStatus::kOk)
      continue;
    EXPECT_LT(equilibrium.state.residual.norm(), 1e-10);
    // Independent check: the arms' own wrenches about the object's origin.
    Wrench sum = scene.load;
    for (int k = 0; k < static_cast<int>(scene.arms.size()); ++k) {
      const Wrench on_arm = model.wrenchOn(k, equilibrium);
      const Vector3d lever =
          equilibrium.tips[static_cast<std::size_t>(k)].pose.translation() - equilibrium.pose.translation();
      sum.head<3>() -= on_arm.head<3>();
      sum.tail<3>() -= on_arm.tail<3>() + lever.cross(on_arm.head<3>());
      kinematics::LoadedTip tip;
      kinematics::cosserat::RodBranch branch = equilibrium.branches[static_cast<std::size_t>(k)];
      ASSERT_EQ(model.arms()[static_cast<std::size_t>(k)].tip(scene.q.segment<3>(3 * k), on_arm, branch, tip),
                kinematics::ModelStatus::kOk);
      EXPECT_LT(poseDifference(tip.pose, equilibrium.tips[static_cast<std::size_t>(k)].pose).norm(), 1e-9);
    }
    EXPECT_LT(sum.norm(), 1e-9);
    ++held;
  }
  EXPECT_GT(held, cases(60) / 2);
}

/// With squeeze and load, compared with differences of equilibria: derivatives of the object's pose and forces by
/// joints; compliance.
TEST(GraspedObject, DerivativesMatchTheEquilibrium) {
  int compared = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(12); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const ContactType type = anyHolding(random);
    const Held scene(random, type, true);
    const GraspedObject model = scene.model();
    GraspEquilibrium equilibrium = model.start(scene.object);
    if (model.solveEquilibrium(scene.q, scene.load, equilibrium) != GraspStatus::kOk || equilibrium.unstable > 0)
      continue;
    const auto change = [&](const VectorXd& joints, const Wrench& load) -> VectorXd {
      GraspEquilibrium there = equilibrium;
      if (model.solveEquilibrium(scene.q + joints, scene.load + load, there) != GraspStatus::kOk)
        return {};
      VectorXd both(6 + equilibrium.force.size());
      both << poseDifference(equilibrium.pose, there.pose), there.force - equilibrium.force;
      return both;
    };
    const auto compare = [&](const Difference& difference, const VectorXd& pose, const VectorXd& force) {
      VectorXd both(pose.size() + force.size());
      both << pose, force;
      if (!(difference.error < 1e-7 * difference.value.norm()))
        return;
      EXPECT_LT((difference.value - both).norm(), 1e-6 * difference.value.norm()) << nameOf(type);
      ++compared;
    };
    const VectorXd still = VectorXd::Zero(scene.q.size());
    for (Eigen::Index j = 0; j < scene.q.size(); ++j) {
      compare(differentiate([&](double h) { return change(h * VectorXd::Unit(still.size(), j), Wrench::Zero()); },
                            j % 3 == 0 ? 1e-3 : 0.02),
              equilibrium.jacobian.col(j), equilibrium.force_by_joints.col(j));
    }
    for (int k = 0; k < 6; ++k) {
      compare(differentiate([&](double h) { return change(still, h * Wrench::Unit(k)); }, k < 3 ? 2e-3 : 3e-5),
              equilibrium.displacement_by_load.col(k), equilibrium.force_by_load.col(k));
    }
  }
  EXPECT_GT(compared, 6 * cases(12));
}

/// Compliance is the inverse of the stiffness; both are symmetric if all loads have a potential.
TEST(GraspedObject, ComplianceIsReciprocal) {
  int compared = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(60); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const ContactType type = anyHolding(random);
    const Held scene(random, type, false);
    const GraspedObject model = scene.model();
    GraspEquilibrium equilibrium = model.start(scene.object);
    if (model.solveEquilibrium(scene.q, scene.load, equilibrium) != GraspStatus::kOk || equilibrium.unstable > 0)
      continue;
    Twist scale = Twist::Ones();
    scale.tail<3>().setConstant(1.0 / model.grasp().length());
    const Matrix6 stiffness = scale.asDiagonal() * equilibrium.stiffness * scale.asDiagonal();
    EXPECT_LT((stiffness - stiffness.transpose()).norm(), 1e-7 * stiffness.norm()) << nameOf(type);
    const Matrix6 back = equilibrium.stiffness * equilibrium.displacement_by_load * equilibrium.stiffness;
    EXPECT_LT((scale.asDiagonal() * (back - equilibrium.stiffness) * scale.asDiagonal()).norm(),
              1e-6 * stiffness.norm());
    ++compared;
  }
  EXPECT_GT(compared, cases(60) / 2);
}

/// Without loads H is that of the paper, and the arms' stiffnesses are summed.
TEST(GraspedObject, IsTheGraspWithoutALoad) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(40); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const Held scene(random, anyHolding(random), false);
    const GraspedObject model = scene.model();
    GraspEquilibrium equilibrium = model.start(scene.object);
    VectorXd q = scene.q;
    for (std::size_t k = 0; k < scene.arms.size(); ++k) {  // back to the joints at which the contacts were closed
      const auto segment = static_cast<Eigen::Index>(3 * k);
      kinematics::Tip tip;
      const Isometry3d wanted = scene.object * scene.contacts[k].frame * scene.contacts[k].hand.inverse();
      for (int step = 0; step < 30; ++step) {
        kinematics::catheter::ConstantCurvature(scene.arms[k].arm).tip(q.segment<3>(segment), tip);
        q.segment<3>(segment) += tip.jacobian.colPivHouseholderQr().solve(poseDifference(tip.pose, wanted));
      }
    }
    ASSERT_EQ(model.solveEquilibrium(q, Wrench::Zero(), equilibrium), GraspStatus::kOk);
    EXPECT_LT(equilibrium.force.norm(), 1e-6);
    EXPECT_EQ(equilibrium.unstable, 0);
    std::vector<const kinematics::Tip*> tips;
    std::vector<Matrix6> compliances;
    for (std::size_t k = 0; k < scene.arms.size(); ++k) {
      tips.push_back(&equilibrium.tips[k]);
      compliances.push_back(equilibrium.tips[k].compliance);
    }
    const Matrix6 sum = model.grasp().objectStiffness(equilibrium.pose, tips, compliances);
    EXPECT_LT((sum - equilibrium.stiffness).norm(), 1e-4 * sum.norm());
    // An admissible velocity moves the object by H and causes no force.
    const Eigen::MatrixXd consistency = equilibrium.state.consistency;
    VectorXd velocity(q.size());
    for (Eigen::Index j = 0; j < q.size(); ++j)
      velocity[j] = random.uniform(-1.0, 1.0);
    velocity -= consistency.completeOrthogonalDecomposition().solve(consistency * velocity);
    const Twist twist = equilibrium.jacobian * velocity, seen = equilibrium.state.jacobian * velocity;
    EXPECT_LT((equilibrium.state.by_object * (twist - seen)).norm(), 1e-5 * (1.0 + seen.norm()));
    EXPECT_LT((equilibrium.force_by_joints * velocity).norm(), 1e-4 * equilibrium.force_by_joints.norm());
  }
}

TEST(GraspedObject, AllocatesNothingAndNamesWhyThereIsNoEquilibrium) {
  Random random(baseSeed());
  const Held scene(random, ContactType::kRigid, false);
  const GraspedObject model = scene.model();
  GraspEquilibrium equilibrium = model.start(scene.object);
  const std::size_t before = allocationCount();
  ASSERT_EQ(model.solveEquilibrium(scene.q, scene.load, equilibrium), GraspStatus::kOk);
  if (canCountAllocations()) {
    EXPECT_EQ(allocationCount(), before);
  }
  const Isometry3d pose = equilibrium.pose;
  VectorXd q = scene.q;
  q[3] = -0.1;
  EXPECT_EQ(model.solveEquilibrium(q, scene.load, equilibrium), GraspStatus::kArm);
  EXPECT_EQ(equilibrium.arm, 1);
  EXPECT_EQ(equilibrium.arm_status, kinematics::ModelStatus::kDistalInside);
  EXPECT_EQ(model.solveEquilibrium(q.head(3), scene.load, equilibrium), GraspStatus::kNotFinite);
  EXPECT_EQ(model.solveEquilibrium(scene.q, Wrench::Constant(NAN), equilibrium), GraspStatus::kNotFinite);
  EXPECT_LT(poseDifference(pose, equilibrium.pose).norm(), 1e-15);
  EXPECT_THROW(GraspedObject(model.grasp(), {scene.arms[0]}), std::invalid_argument);
}

}  // namespace
}  // namespace tandem::test
