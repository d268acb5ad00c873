// SPDX-License-Identifier: Apache-2.0
#include "kinematics/catheter/elastic.h"

#include <gtest/gtest.h>

#include "tests/unit/kinematics/differences.h"
#include "tests/unit/kinematics_rods/random_rods.h"

namespace tandem::test {
namespace {

using Eigen::Vector3d;
using kinematics::LoadedTip;
using kinematics::ModelStatus;
using kinematics::Tip;
using kinematics::Wrench;
using kinematics::catheter::ElasticArm;
using kinematics::catheter::ElasticCatheter;
using kinematics::cosserat::RodBranch;

ElasticArm anyElasticArm(Random& random) {
  ElasticArm arm;
  arm.arm = anyCatheter(random);
  arm.proximal = kinematics::cosserat::tubeSection(0.1, 2.6e-3, 1.4e-3, random.uniform(0.5e9, 2e9), 0.4);
  arm.distal = kinematics::cosserat::tubeSection(0.1, 2.6e-3, 1.4e-3, random.uniform(0.1e9, 0.5e9), 0.4);
  return arm;
}

TEST(ElasticCatheter, IsTheArcWithoutALoadAndDifferentiatesUnderOne) {
  int compared = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(60); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const ElasticCatheter model(anyElasticArm(random));
    const Vector3d q = anyCatheterJoints(random) + Vector3d(0.02, 0.0, 0.0);
    RodBranch branch;
    LoadedTip loaded;
    Tip free;
    ASSERT_EQ(model.tip(q, Wrench::Zero(), branch, loaded), ModelStatus::kOk);
    ASSERT_EQ(kinematics::catheter::ConstantCurvature(model.arm().arm).tip(q, free), ModelStatus::kOk);
    EXPECT_LT(poseDifference(free.pose, loaded.pose).norm(), 1e-9);
    EXPECT_LT((free.jacobian - loaded.jacobian).norm(), 1e-7);

    Wrench wrench;
    wrench << anyVector(random, 0.03), anyVector(random, 1e-3);
    if (model.tip(q, wrench, branch, loaded) != ModelStatus::kOk || loaded.conjugate_points > 0)
      continue;
    for (int j = 0; j < 3; ++j) {
      const Difference difference = differentiate(
          [&](double h) -> Eigen::VectorXd {
            RodBranch there = branch;
            LoadedTip moved;
            if (model.tip(q + h * Vector3d::Unit(j), wrench, there, moved) != ModelStatus::kOk)
              return {};
            return poseDifference(loaded.pose, moved.pose);
          },
          j == 0 ? 2e-3 : 0.05);
      if (!(difference.error < 1e-7))
        continue;
      EXPECT_LT((difference.value - loaded.jacobian.col(j)).norm(), 1e-6 * std::max(1.0, difference.value.norm()));
      ++compared;
    }
    std::vector<kinematics::cosserat::RodPoint> shape;
    ASSERT_EQ(model.shape(q, wrench, branch, 21, shape), ModelStatus::kOk);
    EXPECT_LT(poseDifference(shape.back().pose * model.arm().arm.tool, loaded.pose).norm(), 1e-8);
  }
  EXPECT_GT(compared, 100);
}

TEST(ElasticCatheter, RefusesInvalidInput) {
  Random random(baseSeed());
  ElasticArm arm = anyElasticArm(random);
  const ElasticCatheter model(arm);
  RodBranch branch;
  LoadedTip tip;
  EXPECT_EQ(model.tip(Eigen::Vector2d(0.1, 0.0), Wrench::Zero(), branch, tip), ModelStatus::kWrongSize);
  EXPECT_EQ(model.tip(Vector3d(-0.1, 0.0, 0.0), Wrench::Zero(), branch, tip), ModelStatus::kDistalInside);
  EXPECT_EQ(model.tip(Vector3d(0.1, 0.0, 0.0), Wrench::Constant(std::nan("")), branch, tip), ModelStatus::kNotFinite);
  arm.distal.moment_stiffness.x() = 0.0;
  EXPECT_THROW(ElasticCatheter{arm}, std::invalid_argument);
}

}  // namespace
}  // namespace tandem::test
