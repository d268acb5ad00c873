// SPDX-License-Identifier: Apache-2.0
/** @file Descriptions of joints and their limits, of tubes and of catheters. */
#include <gtest/gtest.h>

#include "config/arm_names.h"
#include "config/robot_files.h"
#include "robots/limit_description.h"

namespace tandem::runtime {
namespace {

using control::LimitKind;
using Names = std::vector<std::string>;

TEST(LimitDescription, NameTheJointsOfTubesAndOfCatheters) {
  const config::Robot tubes = config::loadAnyRobot(config::findFile("ark2024", "robot"));
  const config::Robot catheters = config::loadAnyRobot(config::findFile("ablation-pair", "cooperative"));
  EXPECT_EQ(tubes.arms[1].joint_names, (Names{"beta_1", "beta_2", "beta_3", "alpha_1", "alpha_2", "alpha_3"}));
  EXPECT_EQ(catheters.arms[1].joint_names, (Names{"insertion", "roll", "bend"}));
  EXPECT_EQ(robots::describeLimit(tubes, {LimitKind::kRotation, 0, 2}), "rotation limit of tube 2 of arm a");
  EXPECT_EQ(robots::describeLimit(tubes, {LimitKind::kNeighbour, 1, 2}), "tube 2 of arm b against tube 1");
  EXPECT_EQ(robots::describeLimit(catheters, {LimitKind::kRotation, 0, 2}), "rotation limit of bend of arm a");
  EXPECT_EQ(robots::describeLimit(catheters, {LimitKind::kRotationVelocity, 1, 1}),
            "rotation velocity limit of roll of arm b");
  EXPECT_EQ(robots::describeLimit(catheters, {LimitKind::kFrontTravel, 1, 1}),
            "front travel limit of insertion of arm b");
}

}  // namespace
}  // namespace tandem::runtime
