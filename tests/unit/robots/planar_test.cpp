// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <numbers>

#include "config/robot_files.h"
#include "kinematics/clearance.h"
#include "planning/reference_tracker.h"
#include "robots/limit_description.h"
#include "robots/plant/plant.h"
#include "robots/robot_model.h"
#include "robots/robot_type.h"
#include "tests/unit/kinematics/differences.h"
#include "tests/unit/safety/allocation_counter.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::robots {
namespace {

using kinematics::ModelStatus;

struct Planar : ::testing::Test {
  config::Robot robot = config::loadAnyRobot(std::filesystem::path(TANDEM_PRESETS) / "planar/planar-pair.yaml");
  RobotModel model{robot};
  std::uint32_t seed = test::baseSeed();
  ::testing::ScopedTrace scope{__FILE__, __LINE__, test::trace(seed)};
  test::Random random{seed};

  Eigen::Vector2d anywhere() { return {random.uniform(-2.6, 2.6), random.uniform(-2.6, 2.6)}; }
  kinematics::Tip tip(const Eigen::Vector2d& q, std::size_t arm = 0) const {
    kinematics::Tip tip;
    EXPECT_EQ(model.models()[arm]->tip(q, tip), ModelStatus::kOk);
    return tip;
  }
};

TEST_F(Planar, TipMeetsTheLawOfCosines) {
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector2d q = anywhere();
    const Eigen::Vector3d p = tip(q).pose.translation() - Eigen::Vector3d(0.0, 0.1, 0.0);
    const double square = 0.15 * 0.15 + 0.12 * 0.12 + 2.0 * 0.15 * 0.12 * std::cos(q[1]);
    EXPECT_NEAR(p.squaredNorm(), square, 1e-15);
    EXPECT_EQ(p.z(), 0.0);
    const Eigen::Vector3d along(std::cos(q.sum()), std::sin(q.sum()), 0.0);
    EXPECT_NEAR((tip(q).pose.linear().col(2) - along).norm(), 0.0, 1e-15);
    EXPECT_NEAR(tip(q).pose.linear().determinant(), 1.0, 1e-14);
  }
}

TEST_F(Planar, JacobianIsTheDerivativeOfThePose) {
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector2d q = anywhere();
    const kinematics::Tip here = tip(q);
    for (int j = 0; j < 2; ++j) {
      const test::Difference slope = test::differentiate(
          [&](double step) {
            return Eigen::VectorXd(test::poseDifference(here.pose, tip(q + step * Eigen::Vector2d::Unit(j)).pose));
          },
          0.05);
      EXPECT_LT((slope.value - here.jacobian.col(j)).norm(), 1e-9);
    }
  }
}

TEST_F(Planar, BackboneEndsAtTheTipAndBodiesKeepTheirDistance) {
  std::vector<kinematics::ShapePoint> shape;
  const Eigen::Vector2d q = anywhere();
  ASSERT_EQ(model.models()[0]->shape(q, 28, shape), ModelStatus::kOk);
  EXPECT_TRUE(shape.back().pose.isApprox(tip(q).pose, 1e-12));
  EXPECT_NEAR(shape.back().s, 0.27, 1e-15);
  // Straight parallel arms: the distance of their axes less both radii of the first links.
  kinematics::Body a, b;
  kinematics::Branch branch;
  const Eigen::Vector2d straight = Eigen::Vector2d::Zero();
  ASSERT_EQ(kinematics::makeBody(*model.models()[0], straight, branch, true, a), ModelStatus::kOk);
  ASSERT_EQ(kinematics::makeBody(*model.models()[1], straight, branch, true, b), ModelStatus::kOk);
  EXPECT_NEAR(kinematics::clearance(a, b).distance, 0.2 - 0.012, 1e-12);
}

/// Against the general implementation: shape() and central differences.
TEST_F(Planar, BackboneIsItsShapeWithItsDerivatives) {
  const kinematics::ArmModel& arm = *model.models()[0];
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector2d q = anywhere();
    const std::vector<double> s{0.0, random.uniform(0.01, 0.14), random.uniform(0.16, 0.26), 0.3};
    kinematics::Branch branch;
    std::vector<kinematics::BackbonePoint> ours;
    ASSERT_EQ(arm.backbone(q, branch, s, true, ours), ModelStatus::kOk);
    for (std::size_t k = 0; k < s.size(); ++k) {
      const auto place = [&](const Eigen::Vector2d& joints) {
        std::vector<kinematics::BackbonePoint> points;
        EXPECT_EQ(arm.backbone(joints, branch, {s[k]}, false, points), ModelStatus::kOk);
        return points[0].position;
      };
      for (int j = 0; j < 2; ++j) {
        const test::Difference slope = test::differentiate(
            [&](double step) { return Eigen::VectorXd(place(q + step * Eigen::Vector2d::Unit(j))); }, 0.05);
        EXPECT_LT((slope.value - ours[k].jacobian.col(j)).norm(), 1e-9) << "s " << s[k];
      }
    }
    std::vector<kinematics::ShapePoint> shape;
    ASSERT_EQ(arm.shape(q, 28, shape), ModelStatus::kOk);  // every 10 mm
    std::vector<double> places;
    for (const kinematics::ShapePoint& point : shape)
      places.push_back(point.s);
    ASSERT_EQ(arm.backbone(q, branch, places, false, ours), ModelStatus::kOk);
    for (std::size_t k = 0; k < shape.size(); ++k) {
      EXPECT_LT((ours[k].position - shape[k].pose.translation()).norm(), 1e-12);
      EXPECT_LT((ours[k].tangent - shape[k].pose.linear().col(2)).norm(), 1e-12);
    }
  }
}

TEST_F(Planar, EveryMethodMovesTheTipAsAsked) {
  for (int m = 0; m < control::kMethodCount; ++m) {
    const auto method = static_cast<control::Method>(m);
    const auto tracker = model.makeTracker(method, robot.parameters, {5.0, 3.0});
    safety::RobotVector q = model.stack({robot.arms[0].home, robot.arms[1].home});
    planning::TrackResult result;
    ASSERT_TRUE(tracker->computeTips(q, result));
    const Eigen::Vector3d from = result.tip[0].pose.translation();
    planning::Reference reference;
    reference.task_count = 1;
    reference.tasks[0] = {planning::TaskKind::kTipPosition, 0, 0, from + Eigen::Vector3d(-0.005, 0.003, 0.0),
                          Eigen::Vector3d::Zero()};
    double error = 1.0;
    for (int i = 0; i < 100; ++i) {
      tracker->step(q, q, reference, result);
      ASSERT_EQ(result.status, planning::TrackStatus::kOk) << control::name(method);
      error = result.error[0];
      q += robot.parameters.period * result.solution.velocity;
    }
    EXPECT_LT(error, 1e-4) << control::name(method);
  }
}

TEST_F(Planar, HasTipsAndNothingElse) {
  EXPECT_EQ(refusal(robot, Capability::kTips), "");
  EXPECT_NE(refusal(robot, Capability::kCommonPath).find("found the planar arms of"), std::string::npos);
  EXPECT_NE(refusal(robot, Capability::kComputation).find("expected concentric tubes: "), std::string::npos);
  EXPECT_THROW(RobotModel(robot, "compliant"), std::invalid_argument);
  sim::PlantOptions errors;
  errors.tube_deviation.curvature = 0.1;
  EXPECT_THROW(makePlantTips(robot, errors), std::invalid_argument);
  sim::PlantOptions fourth;
  fourth.tube_errors = {{0, 3, {}}};
  const std::filesystem::path tubes = std::filesystem::path(TANDEM_PRESETS) / "robots/ark2024.yaml";
  EXPECT_THROW(makePlantTips(config::loadAnyRobot(tubes), fourth), std::invalid_argument);
  EXPECT_EQ(describeLimit(robot, {control::LimitKind::kRotation, 1, 2}), "rotation limit of link 2 of arm b");
  EXPECT_EQ(robot.arms[1].joint_names, (std::vector<std::string>{"turn_1", "turn_2"}));
}

TEST_F(Planar, TipAllocatesNothing) {
  if (!test::canCountAllocations())
    GTEST_SKIP() << "a sanitizer has its own allocator";
  kinematics::Tip result;
  const Eigen::Vector2d q = anywhere();
  const std::size_t before = test::allocationCount();
  for (int i = 0; i < 10; ++i)
    model.models()[0]->tip(q, result);
  EXPECT_EQ(test::allocationCount(), before);
}

TEST_F(Planar, FileErrorsNameTheKey) {
  const std::filesystem::path preset = std::filesystem::path(TANDEM_PRESETS) / "planar/planar-pair.yaml";
  std::ifstream stream(preset);
  const std::string good{std::istreambuf_iterator<char>(stream), {}};
  std::string name = (std::filesystem::temp_directory_path() / "tandem-planar-XXXXXX").string();
  const std::filesystem::path folder = ::mkdtemp(name.data());
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& key) {
    std::string text = good;
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos);
    text.replace(at, from.size(), to);
    std::ofstream(folder / "robot.yaml") << text;
    try {
      config::loadAnyRobot(folder / "robot.yaml");
      ADD_FAILURE() << "accepted: " << to;
    } catch (const config::Error& error) {
      EXPECT_NE(std::string(error.what()).find(key), std::string::npos) << error.what();
    }
  };
  refused("home_deg: [-20, 60]", "home_deg: [-160, 60]", "home_deg");
  refused("home_deg: [-20, 60]", "home_deg: [-20]", "home_deg");
  refused("length_mm: 150", "length_mm: -150", "length_mm");
  refused("lower_deg: -150", "lower_deg: 160", "lower_deg");
  refused("planar/1", "plane/1", "tandem");
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace tandem::robots
