// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "kinematics/assist/chain_shape.h"
#include "kinematics/assist/reach.h"
#include "tests/unit/kinematics_rods/random_rods.h"

namespace tandem::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
namespace catheter = kinematics::catheter;
using kinematics::Tip;
using kinematics::assist::distanceBeyondReach;
using kinematics::assist::Joints;
using kinematics::assist::Pair;
using kinematics::assist::Range;
using kinematics::assist::Reach;
using kinematics::assist::ReachBounds;
using kinematics::assist::reachVolume;
using kinematics::assist::TargetAssist;
using kinematics::assist::volumeAlone;
using kinematics::catheter::ConstantCurvature;

Range anyRange(Random& random) {
  Range range;
  range.lower << random.uniform(0.0, 0.1), -4.0, random.uniform(-3.0, -0.5), 0.0, 0.0, 0.0;
  range.upper << range.lower[0] + random.uniform(0.0, 0.1), 4.0, random.uniform(-0.5, 3.0), 0.1, 0.0, 0.0;
  return range;
}

/// Two equal catheters that touch without a force; the assist arm comes from the side.
Pair touchingPair() {
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
  return pair;
}

/// Of its joints; the assist arm pushes by up to 30 mm.
Range rangeOfPair() {
  Range range;
  range.lower << 0.10, -3.2, -2.0, 0.05, 0.0, 0.3;
  range.upper << 0.12, 3.2, 2.0, 0.08, 0.0, 0.3;
  return range;
}

std::vector<Reach> samplesOf(const TargetAssist& model, const Range& range, std::uint64_t count) {
  std::vector<Reach> samples;
  for (std::uint64_t k = 0; k < count; ++k)
    samples.push_back(reachAt(model, range, kinematics::assist::jointsOf(range, k, baseSeed())));
  return samples;
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
  const Pair pair = touchingPair();
  const TargetAssist model(pair);
  const Range range = rangeOfPair();
  const std::vector<Reach> samples = samplesOf(model, range, 300);
  const catheter::Arm& target = pair.target.arm;
  const auto volume = reachVolume(target, range, samples, {}, 5e-3);
  const double alone = volumeAlone(target, range, 5e-3);
  std::printf("alone %.1f cm^3, gained %.1f of %.1f cm^3, beyond by up to %.1f mm, %d of 300 samples in contact\n",
              1e6 * alone, 1e6 * volume.gained, 1e6 * volume.assisted, 1e3 * volume.farthest, volume.counted);
  EXPECT_GT(volume.counted, 100);
  EXPECT_GT(volume.farthest, 2e-3);
  EXPECT_GT(volume.gained, 0.0);
  EXPECT_LE(volume.gained, volume.assisted);
  // A finer grid of the meridian gives about the same volume.
  EXPECT_NEAR(volumeAlone(target, range, 2e-3), alone, 0.25 * alone);
}

/// What is out of bounds does not count, whatever it would add; bounds are of force, strain and the entry plane.
TEST(Reach, CountsWithinTheBoundsOnly) {
  const Pair pair = touchingPair();
  const TargetAssist model(pair);
  const Range range = rangeOfPair();
  const catheter::Arm& target = pair.target.arm;
  std::vector<Reach> samples = samplesOf(model, range, 200);
  ReachBounds bounds{0.3, 0.03};
  const auto all = reachVolume(target, range, samples, {}, 5e-3),
             within = reachVolume(target, range, samples, bounds, 5e-3);
  int counted = 0;
  double farthest = 0.0;
  for (const Reach& sample : samples) {
    if (sample.status != kinematics::assist::Status::kOk || sample.force > 0.3 || sample.strain > 0.03)
      continue;
    ++counted;
    farthest = std::max(farthest, sample.beyond);
  }
  EXPECT_EQ(within.counted, counted);
  EXPECT_EQ(within.farthest, farthest);
  EXPECT_GT(within.counted, 10);
  EXPECT_LT(within.counted, all.counted - 10);
  for (Reach& sample : samples)
    sample.advance = -1e-3;
  EXPECT_EQ(reachVolume(target, range, samples, {}, 5e-3).counted, 0) << "behind the entry plane";
}

/// Strain of a free arm: half the diameter over the radius of its arc; nothing of it is behind the entry plane until
/// the arc bends back past it.
TEST(Reach, StrainAndAdvanceOfAFreeArmAreThoseOfItsArc) {
  Pair pair = touchingPair();
  pair.pushes_only = false;  // no force at all
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + cases(30); ++seed) {
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    Joints q;
    q << random.uniform(0.01, 0.1), random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0), random.uniform(0.01, 0.1),
        random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0);
    // Placed so that the arms touch without a force: both are free.
    pair.contact = TargetAssist::touching(pair, q);
    const TargetAssist model(pair);
    kinematics::assist::ChainBranch branch;
    kinematics::assist::Chain chain;
    ASSERT_EQ(model.solve(q, branch, chain), kinematics::assist::Status::kOk);
    const auto shape = kinematics::assist::shapeOf(pair, q, branch, chain, 41);
    ASSERT_TRUE(shape);
    const double radius = pair.target.distal.outer_radius, length = pair.target.arm.bending_length;
    ASSERT_GT(radius, 0.0);
    EXPECT_NEAR(kinematics::assist::largestStrain(pair, q, *shape),
                radius * std::max(std::abs(q[2]), std::abs(q[5])) / length, 1e-9);
    const auto back = [length](double insertion, double bend) {
      double least = 0.0;
      for (int k = 0; k <= 1000; ++k)
        least = std::min(least, insertion + length * std::sin(bend * k / 1000.0) / bend);
      return least;
    };
    EXPECT_NEAR(kinematics::assist::leastAdvance(pair, *shape), std::min(back(q[0], q[2]), back(q[3], q[5])), 2e-4);
  }
}

}  // namespace
}  // namespace tandem::test
