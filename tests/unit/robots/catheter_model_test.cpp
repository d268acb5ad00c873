// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "config/cooperative.h"
#include "config/robot_files.h"
#include "robots/robot_type.h"
#include "tests/unit/kinematics/differences.h"
#include "tests/unit/safety/allocation_counter.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::robots {
namespace {

namespace catheter = kinematics::catheter;
using kinematics::ModelStatus;

struct CatheterModels : ::testing::Test {
  config::Robot robot = config::loadAnyRobot(std::filesystem::path(TANDEM_PRESETS) / "cooperative/ablation-pair.yaml");
  const RobotType& type = typeOf(robot);
  const config::CatheterArm& file = static_cast<const config::CooperativeRobot&>(*robot.data).arms[1];
  std::unique_ptr<kinematics::ArmModel> arc = type.makeModel(robot, 1, "rigid");
  std::unique_ptr<kinematics::ArmModel> rods = type.makeModel(robot, 1, type.elasticModel());
  std::uint32_t seed = test::baseSeed();
  ::testing::ScopedTrace scope{__FILE__, __LINE__, test::trace(seed)};
  test::Random random{seed};

  Eigen::Vector3d anywhere() {
    return {random.uniform(0.02, 0.11), random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0)};
  }
};

TEST_F(CatheterModels, TipsAreThoseOfTheModelsBehindThem) {
  const catheter::ElasticCatheter direct(file.model);
  kinematics::Branch branch;
  kinematics::cosserat::RodBranch direct_branch;
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d q = anywhere();
    kinematics::Wrench wrench = kinematics::Wrench::Zero();
    wrench[1] = random.uniform(-5e-3, 5e-3);
    kinematics::LoadedTip tip, expected;
    ASSERT_EQ(rods->loadedTip(q, wrench, branch, tip), ModelStatus::kOk);
    ASSERT_EQ(direct.tip(q, wrench, direct_branch, expected), ModelStatus::kOk);
    EXPECT_EQ(tip.pose.matrix(), expected.pose.matrix());
    EXPECT_EQ(branch.known, direct_branch.known);
    kinematics::Tip unloaded, on_arc;
    ASSERT_EQ(rods->tip(q, unloaded), ModelStatus::kOk);
    ASSERT_EQ(arc->tip(q, on_arc), ModelStatus::kOk);
    EXPECT_LT((unloaded.pose.matrix() - on_arc.pose.matrix()).norm(), 1e-6);
    EXPECT_EQ(arc->loadedTip(q, wrench, branch, tip), ModelStatus::kCarriesNoLoad);
    EXPECT_DOUBLE_EQ(type.tipValue(robot, 1, q, on_arc), file.tendon_offset * q[catheter::kBend]);
  }
}

TEST_F(CatheterModels, ShapeAndSectionEndAtTheSameLength) {
  const Eigen::Vector3d q = anywhere();
  for (const auto* model : {arc.get(), rods.get()}) {
    std::vector<kinematics::ShapePoint> shape;
    ASSERT_EQ(model->shape(q, 20, shape), ModelStatus::kOk);
    kinematics::BodySections sections;
    ASSERT_EQ(model->sections(q, sections), 1);
    EXPECT_NEAR(shape.back().s, sections[0].end, 1e-12);
    EXPECT_DOUBLE_EQ(2.0 * sections[0].radius, file.outer_diameter);
    const test::Difference slope = test::differentiate(
        [&](double step) {
          model->sections(q + step * Eigen::Vector3d::UnitX(), sections);
          return Eigen::VectorXd::Constant(1, sections[0].end);
        },
        0.01);
    EXPECT_NEAR(slope.value[0], sections[0].by_joints[catheter::kInsertion], 1e-9);
  }
}

TEST_F(CatheterModels, TipsAllocateNothing) {
  if (!test::canCountAllocations())
    GTEST_SKIP() << "the sanitizer replaces the heap";
  kinematics::Branch branch;
  kinematics::Tip tip;
  const Eigen::Vector3d q = anywhere();
  const std::size_t before = test::allocationCount();
  ASSERT_EQ(rods->tip(q, branch, tip), ModelStatus::kOk);
  ASSERT_EQ(arc->tip(q, branch, tip), ModelStatus::kOk);
  EXPECT_EQ(test::allocationCount(), before);
}

TEST_F(CatheterModels, OtherModelsAreRefused) {
  try {
    type.makeModel(robot, 0, "stiff");
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(std::string(error.what()), "model: found 'stiff', expected constant-curvature or cosserat for catheters");
  }
}

}  // namespace
}  // namespace tandem::robots
