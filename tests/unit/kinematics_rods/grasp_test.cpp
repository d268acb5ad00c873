// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <set>

#include "kinematics/grasp/grasp.h"
#include "tests/unit/kinematics_rods/random_rods.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using kinematics::ModelStatus;
using kinematics::Tip;
using kinematics::catheter::Arm;
using kinematics::catheter::ConstantCurvature;
using kinematics::grasp::Contact;
using kinematics::grasp::ContactType;
using kinematics::grasp::ContactVector;
using kinematics::grasp::Grasp;
using kinematics::grasp::GraspState;
using kinematics::grasp::Matrix6;
using kinematics::grasp::Twist;

constexpr double kHalfTurn = std::numbers::pi;

/** Catheters around an object, each with its tip in contact. */
struct Scene {
  /// @param parallel  whether the arms' axes are parallel
  Scene(Random& random, int arms, ContactType type, bool parallel = true) {
    const Isometry3d robot = anyPose(random);
    for (int k = 0; k < arms; ++k) {
      Arm arm = anyCatheter(random);
      const double around = 2.0 * kHalfTurn * k / arms;
      arm.base = robot * Eigen::Translation3d(0.03 * std::cos(around), 0.03 * std::sin(around), 0.0) *
                 Eigen::AngleAxisd(random.uniform(-3.0, 3.0), Vector3d::UnitZ());
      if (!parallel)
        arm.base = arm.base * Eigen::AngleAxisd(random.uniform(0.2, 1.0), anyVector(random, 1.0).normalized());
      models.emplace_back(arm);
      q.emplace_back(random.uniform(0.03, 0.1), random.uniform(-3.0, 3.0),
                     random.uniform(0.3, 1.5) * (random.chance(0.5) ? 1.0 : -1.0));
    }
    update();
    object.setIdentity();
    for (const Tip& tip : tips)
      object.translation() += tip.pose.translation() / arms;
    object.linear() = anyPose(random).linear();
    for (const Tip& tip : tips) {
      Contact contact;
      contact.type = type;
      Isometry3d frame = Isometry3d::Identity();
      frame.translation() = tip.pose.translation();
      const Vector3d inward = (object.translation() - frame.translation()).normalized();
      frame.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), inward).toRotationMatrix();
      contact.frame = object.inverse() * frame;
      contact.hand = tip.pose.inverse() * frame;
      contact.friction = random.uniform(0.1, 1.0);
      contacts.push_back(contact);
    }
  }
  void update() {
    tips.resize(models.size());
    for (std::size_t k = 0; k < models.size(); ++k)
      EXPECT_EQ(models[k].tip(q[k], tips[k]), ModelStatus::kOk);
  }
  GraspState state(const Grasp& grasp) const {
    std::vector<const Tip*> pointers;
    for (const Tip& tip : tips)
      pointers.push_back(&tip);
    GraspState result;
    EXPECT_TRUE(grasp.evaluate(object, pointers, result));
    return result;
  }
  GraspState state() const { return state(Grasp(contacts, kLength)); }

  static constexpr double kLength = 0.02;
  std::vector<ConstantCurvature> models;
  std::vector<Vector3d> q;
  std::vector<Tip> tips;
  std::vector<Contact> contacts;
  Isometry3d object;
};

constexpr ContactType kContactTypes[] = {ContactType::kFrictionless, ContactType::kPoint, ContactType::kSoftFinger,
                                         ContactType::kRigid};

/// The paper's robot: two arms of three joints on parallel axes.
TEST(Grasp, MobilityOfTwoCathetersIsThatOfThePaper) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(60); ++seed) {
    SCOPED_TRACE(trace(seed));
    const auto mobility = [seed](ContactType type) {
      Random random(seed);
      return Scene(random, 2, type).state().mobility;
    };
    EXPECT_EQ(mobility(ContactType::kRigid), 1);
    EXPECT_EQ(mobility(ContactType::kSoftFinger), 4);
    EXPECT_EQ(mobility(ContactType::kPoint), 6);
    Random random(seed);
    EXPECT_EQ(Scene(random, 2, ContactType::kRigid, false).state().mobility, 0);
  }
}

TEST(Grasp, NamesWhatCanBeMovedAndWhatIsMissing) {
  Random random(baseSeed());
  Scene scene(random, 2, ContactType::kRigid);
  // In the robot base frame, in which both arms are inserted along z.
  const Isometry3d robot = scene.models[0].arm().base;
  for (Tip& tip : scene.tips) {
    tip.pose = robot.inverse() * tip.pose;
    tip.jacobian.topRows<3>() = robot.linear().transpose() * tip.jacobian.topRows<3>();
    tip.jacobian.bottomRows<3>() = robot.linear().transpose() * tip.jacobian.bottomRows<3>();
  }
  scene.object = robot.inverse() * scene.object;
  const GraspState state = scene.state();
  ASSERT_EQ(state.object_mobility, 1);
  ASSERT_EQ(state.movable.cols(), 1);
  ASSERT_EQ(state.missing.cols(), 5);
  EXPECT_EQ(kinematics::grasp::describe(state.movable.col(0), Scene::kLength), "translation along z");
  std::set<std::string> missing;
  for (Eigen::Index k = 0; k < 5; ++k)
    missing.insert(kinematics::grasp::describe(state.missing.col(k), Scene::kLength));
  EXPECT_EQ(missing, (std::set<std::string>{"translation along x", "translation along y", "rotation about x",
                                            "rotation about y", "rotation about z"}));
  Twist wanted = Twist::Unit(2);
  const Grasp grasp(scene.contacts, Scene::kLength);
  EXPECT_LT(grasp.outside(state, wanted).norm(), 1e-9);
  wanted[0] = 0.5;
  EXPECT_LT((grasp.outside(state, wanted) - 0.5 * Twist::Unit(0)).norm(), 1e-9);
  EXPECT_EQ(kinematics::grasp::describe(Twist::Zero(), 1.0), "no motion");
}

TEST(Grasp, RanksAgreeWithAnIndependentDecomposition) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(200); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const Scene scene(random, random.integer(1, 4), kContactTypes[random.integer(0, 3)], random.chance(0.5));
    const GraspState state = scene.state();
    const Eigen::Index joints = state.by_joints.cols();
    Eigen::MatrixXd all(state.by_object.rows(), joints + 6);
    all << state.by_joints, -state.by_object;
    for (Eigen::Index k = 0; k < all.cols(); ++k)
      all.col(k) /= std::max(1e-12, all.col(k).norm());
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors(all);
    factors.setThreshold(1e-8);
    EXPECT_EQ(state.rank, factors.rank());
    EXPECT_EQ(state.mobility, joints + 6 - factors.rank());
    EXPECT_EQ(state.movable.cols() + state.missing.cols(), 6);
    EXPECT_EQ(state.movable.cols(), state.object_mobility);
    EXPECT_LE(state.object_mobility, state.mobility);
    // Every motion moves the object, is a self-motion of the arms, or violates the constraints.
    EXPECT_LE(state.mobility - state.object_mobility, state.self_motions);
  }
}

TEST(Grasp, VirtualWorkOfForcesAndVelocitiesAgrees) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(200); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const Scene scene(random, random.integer(2, 4), kContactTypes[random.integer(0, 3)]);
    const GraspState state = scene.state();
    const Eigen::Index joints = state.by_joints.cols();
    // An admissible joint velocity: a random one without its squeezing part.
    Eigen::VectorXd velocity(joints);
    for (Eigen::Index k = 0; k < joints; ++k)
      velocity[k] = random.uniform(-1.0, 1.0);
    const Eigen::MatrixXd consistency = state.consistency;
    velocity -= consistency.completeOrthogonalDecomposition().solve(consistency * velocity);
    const Twist twist = state.jacobian * velocity;
    const Eigen::VectorXd slip = state.by_joints * velocity - state.by_object * twist;
    EXPECT_LT(slip.norm(), 1e-10) << "H does not answer an admissible velocity";
    Eigen::VectorXd force(state.by_object.rows());
    for (Eigen::Index k = 0; k < force.size(); ++k)
      force[k] = random.uniform(-1.0, 1.0);
    const Eigen::VectorXd torque = state.by_joints.transpose() * force;
    const Twist wrench = state.by_object.transpose() * force;
    EXPECT_NEAR(torque.dot(velocity), wrench.dot(twist), 1e-10 * (1.0 + std::abs(wrench.dot(twist))));
  }
}

/// The constraint describes the real contacts: an admissible step opens them only by a second-order distance.
TEST(Grasp, AdmissibleStepsDriftByTheirSquare) {
  int compared = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(60); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Scene scene(random, 2, random.chance(0.5) ? ContactType::kPoint : ContactType::kRigid);
    const Grasp grasp(scene.contacts, Scene::kLength);
    const GraspState state = scene.state(grasp);
    EXPECT_LT(state.residual.norm(), 1e-13);
    Twist wanted = Twist::Zero();
    for (Eigen::Index k = 0; k < state.movable.cols(); ++k)
      wanted += random.uniform(-1.0, 1.0) * state.movable.col(k);
    wanted *= 0.02 / std::max(1e-9, wanted.head<3>().norm() + 0.02 * wanted.tail<3>().norm());
    const Eigen::VectorXd velocity = grasp.jointsFor(state, wanted);
    ASSERT_LT((state.by_joints * velocity - state.by_object * wanted).norm(), 1e-10);
    if (velocity.cwiseAbs().maxCoeff() > 20.0)
      continue;  // near a singular pose second-order terms are large
    const auto drift_after = [&](double h) {
      Scene moved = scene;
      for (std::size_t k = 0; k < moved.q.size(); ++k)
        moved.q[k] += h * velocity.segment<3>(3 * static_cast<Eigen::Index>(k));
      moved.update();
      moved.object.translation() += h * wanted.head<3>();
      const Vector3d turn = h * wanted.tail<3>();
      moved.object.linear() = Eigen::AngleAxisd(turn.norm(), turn.norm() > 0 ? turn.normalized() : Vector3d::UnitX()) *
                              scene.object.linear();
      return moved.state(grasp).residual.norm();
    };
    const double h = 1e-3 / (1.0 + velocity.cwiseAbs().maxCoeff());
    EXPECT_LT(drift_after(h), 1e-5 * 0.5);
    EXPECT_LT(drift_after(0.5 * h), 0.3 * drift_after(h) + 1e-13);
    ++compared;
  }
  EXPECT_GT(compared, 30);
}

TEST(Grasp, ContactForcesAnswerAWrenchAndPressTheObject) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(200); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const ContactType type = kContactTypes[random.integer(0, 3)];
    const Scene scene(random, random.integer(2, 4), type);
    const Grasp grasp(scene.contacts, Scene::kLength);
    const GraspState state = scene.state(grasp);
    const Eigen::MatrixXd unbalanced = state.by_object.transpose() * state.internal_forces;
    EXPECT_LT(unbalanced.norm(), 1e-12);
    Twist wrench, left;
    wrench << anyVector(random, 1.0), anyVector(random, 0.02);
    const ContactVector force = grasp.contactForces(state, wrench, 0.0, left);
    EXPECT_LT((state.by_object.transpose() * force + wrench - left).norm(), 1e-12);
    if ((state.degeneracies & kinematics::grasp::kNotRestrained) == 0)
      EXPECT_LT(left.norm(), 1e-9);
    else
      EXPECT_LT((state.by_object * state.unrestrained).norm(), 1e-7);
    if (scene.contacts.size() == 2) {  // the normals are opposed: squeeze presses on both
      const ContactVector pressed = grasp.contactForces(state, Twist::Zero(), 2.0, left);
      for (int k = 0; k < 2; ++k) {
        const int rows = (k == 0 ? grasp.firstRow(1) : grasp.rows()) - grasp.firstRow(k);
        const auto load = loadOf(scene.contacts[static_cast<std::size_t>(k)], pressed.segment(grasp.firstRow(k), rows));
        EXPECT_NEAR(load.normal, 2.0, 1e-9);
        EXPECT_FALSE(load.slips || load.separates);
      }
    }
  }
}

TEST(Grasp, SlipFollowsCoulombsCone) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(200); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Contact contact;
    contact.type = ContactType::kSoftFinger;
    contact.friction = random.uniform(0.1, 1.0);
    contact.spin_radius = random.uniform(1e-3, 1e-2);
    const double normal = random.uniform(0.1, 2.0), angle = random.uniform(-3.0, 3.0);
    const double used = random.uniform(0.1, 1.9), share = random.uniform(0.0, kHalfTurn / 2);
    const double tangential = used * contact.friction * normal * std::cos(share);
    const double spin = used * contact.friction * normal * std::sin(share) * contact.spin_radius;
    const Eigen::Vector4d force(tangential * std::cos(angle), tangential * std::sin(angle), normal, spin);
    const auto load = loadOf(contact, force);
    EXPECT_NEAR(load.used, used, 1e-9);
    EXPECT_EQ(load.slips, used > 1.0);
    EXPECT_FALSE(load.separates);
    EXPECT_TRUE(loadOf(contact, Eigen::Vector4d(-force)).separates);
    EXPECT_TRUE(loadOf(contact, Eigen::Vector4d(-force)).slips);
  }
}

TEST(Grasp, NamesDegenerateGrasps) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(40); ++seed) {
    SCOPED_TRACE(trace(seed));
    namespace grasp = kinematics::grasp;
    Random random(seed);
    // Two point contacts do not restrain rotation about the line between them.
    Scene points(random, 2, ContactType::kPoint);
    const GraspState state = points.state();
    EXPECT_TRUE(state.degeneracies & grasp::kNotRestrained);
    ASSERT_EQ(state.unrestrained.cols(), 1);
    const Vector3d line = points.tips[0].pose.translation() - points.tips[1].pose.translation();
    const Twist turn = state.unrestrained.col(0);
    EXPECT_LT(turn.tail<3>().normalized().cross(line.normalized()).norm(), 1e-6);
    EXPECT_NE(grasp::describeDegeneracies(state.degeneracies).find("every arm stands still"), std::string::npos);

    Scene rigid(random, 2, ContactType::kRigid, false);
    EXPECT_EQ(rigid.state().degeneracies, 0u) << grasp::describeDegeneracies(rigid.state().degeneracies);
    EXPECT_EQ(grasp::describeDegeneracies(0), "");

    // A straight catheter with its tip on its axis: roll has no effect at a point contact.
    Scene straight(random, 2, ContactType::kPoint);
    Arm arm = straight.models[0].arm();
    arm.tool.translation().head<2>().setZero();
    straight.models[0] = ConstantCurvature(arm);
    straight.q[0][2] = 0.0;
    straight.update();
    straight.contacts[0].frame.translation() = straight.object.inverse() * straight.tips[0].pose.translation();
    EXPECT_TRUE(straight.state().degeneracies & grasp::kArmSingular);

    Scene one(random, 1, ContactType::kRigid);
    EXPECT_EQ(one.state().degeneracies, unsigned(grasp::kNoSqueeze));

    Scene same(random, 2, ContactType::kRigid);
    same.contacts[1].frame = same.contacts[0].frame;
    EXPECT_TRUE(same.state().degeneracies & grasp::kContactsCoincide);
  }
}

TEST(Grasp, StiffnessesOfGripsAdd) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(60); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const Scene scene(random, 2, ContactType::kRigid);
    std::vector<Matrix6> compliances;
    std::vector<const Tip*> tips;
    Matrix6 sum = Matrix6::Zero();
    for (const Tip& tip : scene.tips) {
      Matrix6 any;
      for (int k = 0; k < 6; ++k)
        any.col(k) << anyVector(random, 1.0), anyVector(random, 1.0);
      compliances.push_back(any * any.transpose() + 0.1 * Matrix6::Identity());
      tips.push_back(&tip);
      Matrix6 shift = Matrix6::Identity();  // twist of the tip due to that of the object
      const Vector3d arm = tip.pose.translation() - scene.object.translation();
      shift.topRightCorner<3, 3>() << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
      sum += shift.transpose() * compliances.back().inverse() * shift;
    }
    const Matrix6 stiffness = Grasp(scene.contacts, Scene::kLength).objectStiffness(scene.object, tips, compliances);
    EXPECT_LT((stiffness - sum).norm(), 1e-8 * sum.norm());
  }
}

TEST(Grasp, AllocatesNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "the sanitizer's allocator is not counted";
  Random random(baseSeed());
  const Scene scene(random, 4, ContactType::kRigid);
  const Grasp grasp(scene.contacts, Scene::kLength);
  std::vector<const Tip*> tips;
  for (const Tip& tip : scene.tips)
    tips.push_back(&tip);
  GraspState state;
  Twist left;
  const std::size_t before = allocationCount();
  ASSERT_TRUE(grasp.evaluate(scene.object, tips, state));
  grasp.contactForces(state, Twist::Ones(), 1.0, left);
  grasp.jointsFor(state, grasp.outside(state, Twist::Ones()));
  EXPECT_EQ(allocationCount(), before);
}

TEST(Grasp, RefusesInvalidGrasps) {
  namespace grasp = kinematics::grasp;
  const auto refused = [](auto call, const std::string& what) {
    try {
      call();
      ADD_FAILURE() << "accepted: " << what;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
  };
  Random random(baseSeed());
  Scene scene(random, 2, ContactType::kPoint);
  refused([&] { Grasp({}, 0.01); }, "contacts: found 0");
  refused([&] { Grasp(scene.contacts, 0.0); }, "size of the object");
  refused([] { grasp::contactType("glue"); }, "found 'glue', expected one of: frictionless, point, soft_finger, rigid");
  for (const ContactType type : kContactTypes)
    EXPECT_EQ(grasp::contactType(grasp::nameOf(type)), type);
  std::vector<Contact> contacts = scene.contacts;
  contacts[1].friction = 0.0;
  refused([&] { Grasp(contacts, 0.01); }, "contact 2, friction");
  GraspState state;
  std::vector<const Tip*> one = {&scene.tips[0]};
  EXPECT_FALSE(Grasp(scene.contacts, 0.01).evaluate(scene.object, one, state));
}

}  // namespace
}  // namespace tandem::test
