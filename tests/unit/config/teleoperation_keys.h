// SPDX-License-Identifier: Apache-2.0
/** @file What the `teleoperation` of the deployment with every key has to become. */
#pragma once

#include <gtest/gtest.h>

#include <array>

#include "config/config.h"

namespace tandem::config::test {

inline void expectTeleoperation(const Teleoperation& t) {
  const planning::teleoperation::Options& o = t.options;
  EXPECT_EQ((std::array{o.scale, o.scale_rate, o.deadband_speed, o.deadband_distance}),
            (std::array{0.25, 2.0, 0.001, 0.002}));
  EXPECT_EQ((std::array{o.filter.min_cutoff, o.filter.beta, o.filter.derivative_cutoff}), (std::array{3.0, 40.0, 5.0}));
  EXPECT_EQ((std::array{o.guard.max_speed, o.guard.leash, o.guard.response, o.guard.margin}),
            (std::array{0.006, 0.007, 0.08, 0.009}));
  EXPECT_EQ(o.guard.workspace.value().maximum, Eigen::Vector3d(0.001, 0.002, 0.003));
  ASSERT_EQ(o.guard.forbidden.size(), 3u);
  EXPECT_EQ(o.guard.forbidden[2].name, "c");
  EXPECT_NEAR(distance(o.guard.forbidden[2], Eigen::Vector3d::Zero()), -0.001, 1e-15);
  EXPECT_EQ(o.guard.guidance.value().strength, 0.5);
  EXPECT_EQ(o.guard.guidance->radius, 0.008);
  EXPECT_EQ(o.guard.guidance->points.at(1).z(), 0.005);
  EXPECT_TRUE(t.crtk.by_arrival);
  EXPECT_EQ(t.crtk.tip_step, 0.003);
  EXPECT_EQ(t.crtk.translation_step, 0.004);
  EXPECT_NEAR(t.crtk.rotation_step, 3.14159265, 1e-8);
  EXPECT_EQ(t.crtk.acceleration, 0.005);
}

}  // namespace tandem::config::test
