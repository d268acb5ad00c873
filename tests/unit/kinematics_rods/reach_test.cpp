// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "kinematics/assist/reach.h"
#include "tests/unit/kinematics_rods/random_rods.h"

namespace tandem::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using kinematics::Tip;
using kinematics::assist::distanceBeyondReach;
using kinematics::assist::Joints;
using kinematics::assist::Pair;
using kinematics::assist::Range;
using kinematics::assist::TargetAssist;
using kinematics::catheter::ConstantCurvature;

Range anyRange(Random& random) {
  Range range;
  range.lower << random.uniform(0.0, 0.1), -4.0, random.uniform(-3.0, -0.5), 0.0, 0.0, 0.0;
  range.upper << range.lower[0] + random.uniform(0.0, 0.1), 4.0, random.uniform(-0.5, 3.0), 0.1, 0.0, 0.0;
  return range;
}

TEST(Reach, TipsAloneAreWithin) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(300); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const ConstantCurvature model(anyCatheter(random));
    const Range range = anyRange(random);
    const Joints q = kinematics::assist::jointsOf(range, static_cast<std::uint64_t>(random.integer(0, 1000)), seed);
    for (int k = 0; k < 3; ++k) {
      EXPECT_GE(q[k], range.lower[k]);
      EXPECT_LE(q[k], range.upper[k]);
    }
    Tip tip;
    ASSERT_EQ(model.tip(q.head<3>(), tip), kinematics::ModelStatus::kOk);
    EXPECT_EQ(distanceBeyondReach(model.arm(), range, tip.pose.translation()), 0.0);
  }
}

/// The distance equals that to the nearest of many sampled tips.
TEST(Reach, DistanceIsThatToTheNearestTip) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(30); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const ConstantCurvature model(anyCatheter(random));
    const Range range = anyRange(random);
    const Vector3d place = model.arm().base * anyVector(random, 0.2);
    const double found = distanceBeyondReach(model.arm(), range, place);
    double nearest = 1.0;
    const Vector3d local = model.arm().base.inverse() * place;
    constexpr int kBends = 300, kInsertions = 60;
    for (int i = 0; i <= kBends; ++i) {
      for (int j = 0; j <= kInsertions; ++j) {
        const Vector3d q(range.lower[0] + (range.upper[0] - range.lower[0]) * j / kInsertions, 0.0,
                         range.lower[2] + (range.upper[2] - range.lower[2]) * i / kBends);
        Tip tip;
        ASSERT_EQ(model.tip(q, tip), kinematics::ModelStatus::kOk);
        const Vector3d at = model.arm().base.inverse() * tip.pose.translation();
        nearest = std::min(nearest, std::hypot(at.head<2>().norm() - local.head<2>().norm(), at.z() - local.z()));
      }
    }
    EXPECT_LE(found, nearest + 1e-9);
    EXPECT_GE(found, nearest - 2e-3) << "cells of the grid are that wide";
  }
}

/// The paper's claim: with assistance the tip leaves the target's own workspace.
TEST(Reach, AssistanceReachesBeyond) {
  Pair pair;
  pair.target.arm.bending_length = pair.assist.arm.bending_length = 0.06;
  pair.target.proximal = pair.assist.proximal = kinematics::cosserat::tubeSection(0.1, 2.67e-3, 1.6e-3, 1.5e9, 0.4);
  pair.target.distal = pair.assist.distal = kinematics::cosserat::tubeSection(0.1, 2.67e-3, 1.6e-3, 0.3e9, 0.4);
  Joints home;
  home << 0.12, 0.0, 0.5, 0.05, 0.0, 0.3;
  const Isometry3d place =
      Eigen::Translation3d(0.0, 0.0, home[0]) * Isometry3d(Eigen::AngleAxisd(1.2, Vector3d::UnitY()));
  pair.assist.arm.base =
      place * (Eigen::Translation3d(0.0, 0.0, home[0]) * TargetAssist::touching(pair, home)).inverse();
  pair.contact = TargetAssist::touching(pair, home);
  const TargetAssist model(pair);
  Range range;
  range.lower << 0.10, -3.2, -2.0, 0.05, 0.0, 0.3;
  range.upper << 0.12, 3.2, 2.0, 0.08, 0.0, 0.3;
  const auto volume = kinematics::assist::reachVolume(model, range, 300, 5e-3, baseSeed());
  std::printf(
      "alone %.1f cm^3, gained %.1f of %.1f cm^3, beyond by up to %.1f "
      "mm, %d of %d samples in contact\n",
      1e6 * volume.alone, 1e6 * volume.gained, 1e6 * volume.assisted, 1e3 * volume.farthest, volume.answered,
      volume.samples);
  EXPECT_EQ(volume.samples, 300);
  EXPECT_GT(volume.answered, 100);
  EXPECT_GT(volume.farthest, 2e-3);
  EXPECT_GT(volume.gained, 0.0);
  EXPECT_LE(volume.gained, volume.assisted);
  EXPECT_GT(volume.alone, 0.0);
  // A finer grid of the meridian gives about the same volume.
  const auto finer = kinematics::assist::reachVolume(model, range, 0, 2e-3, baseSeed());
  EXPECT_NEAR(finer.alone, volume.alone, 0.25 * finer.alone);
}

}  // namespace
}  // namespace tandem::test
