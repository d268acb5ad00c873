// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kinematics/tube_model.h"
#include "sim/tip_tracker.h"
#include "tests/unit/safety/allocation_counter.h"
#include "tests/unit/support/random_tubes.h"

namespace tandem::sim {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000;

PlantOptions compliant() {
  PlantOptions options;
  options.model = "compliant";
  return options;
}

std::vector<kinematics::ConcentricTubeArm> arms() { return {test::arkArm(0.005), test::arkArm(-0.005)}; }

PlantTips make(const std::vector<kinematics::ConcentricTubeArm>& of, const PlantOptions& options) {
  ArmModels models;
  for (std::size_t k = 0; k < of.size(); ++k)
    models.push_back(kinematics::makeArmModel(options.model, withErrors(of[k], static_cast<int>(k), options)));
  return {std::move(models), options};
}

void place(PlantTips& tips, int configuration) {
  tips.restart();
  for (int k = 0; k < tips.armCount(); ++k)
    tips.update(k, test::arkStart(configuration, k));
}

TEST(PlantTips, FollowTheConfiguredModel) {
  for (const char* name : {"rigid", "compliant"}) {
    PlantOptions options;
    options.model = name;
    PlantTips tips = make(arms(), options);
    EXPECT_FALSE(tips.valid(0)) << "nothing is known before the first update";
    for (int configuration = 0; configuration < 3; ++configuration) {
      place(tips, configuration);
      for (int k = 0; k < 2; ++k) {
        kinematics::Tip tip;
        const auto model = kinematics::makeArmModel(name, arms()[static_cast<std::size_t>(k)]);
        ASSERT_EQ(model->tip(test::arkStart(configuration, k), tip), kinematics::ModelStatus::kOk);
        EXPECT_TRUE(tips.valid(k));
        EXPECT_EQ(tips.pose(k).matrix(), tip.pose.matrix());
      }
    }
  }
}

TEST(PlantTips, ErrorsOfTubesAreSeededAndOnesGivenTakeTheirPlace) {
  PlantOptions options = compliant();
  options.tube_deviation = {0.05, 0.1, 0.08, 0.01};
  options.seed = 3;
  constexpr int kArms = 400;
  const kinematics::ConcentricTubeArm ideal = test::arkArm(0.0);
  double squares = 0.0;
  for (int k = 0; k < kArms; ++k) {
    const auto first = withErrors(ideal, k, options), again = withErrors(ideal, k, options);
    const auto other = withErrors(ideal, k + 1, options);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& a = first.tubes[i].sections.back();
      EXPECT_EQ(a.curvature, again.tubes[i].sections.back().curvature);
      EXPECT_NE(a.curvature, other.tubes[i].sections.back().curvature);
      EXPECT_NEAR(first.tubes[i].sections[0].length / ideal.tubes[i].sections[0].length,
                  a.length / ideal.tubes[i].sections.back().length, 1e-12)
          << "a longer tube is longer everywhere";
      squares += std::pow(a.torsional_stiffness / ideal.tubes[i].sections.back().torsional_stiffness - 1.0, 2);
    }
  }
  EXPECT_NEAR(std::sqrt(squares / (3 * kArms)), 0.1, 0.01);

  options.tube_errors = {{1, 2, {0.1, 0.2, -0.3, 0.02}}};
  const auto given = withErrors(ideal, 1, options).tubes[2].sections.back();
  const auto& of = ideal.tubes[2].sections.back();
  EXPECT_DOUBLE_EQ(given.bending_stiffness, 1.1 * of.bending_stiffness);
  EXPECT_DOUBLE_EQ(given.torsional_stiffness, 1.2 * of.torsional_stiffness);
  EXPECT_DOUBLE_EQ(given.curvature, 0.7 * of.curvature);
  EXPECT_DOUBLE_EQ(given.length, 1.02 * of.length);
}

TEST(PlantTips, AForceMovesTheTipItsWay) {
  PlantOptions options = compliant();
  PlantTips free = make(arms(), options);
  options.tip_forces = {{0, {0.05, 0.0, 0.0}}};
  PlantTips loaded = make(arms(), options);
  place(free, 0);
  place(loaded, 0);
  ASSERT_TRUE(loaded.valid(0));
  EXPECT_GT((loaded.pose(0).translation() - free.pose(0).translation()).x(), 1e-4);
  EXPECT_EQ(loaded.pose(1).matrix(), free.pose(1).matrix()) << "only where the force is";
}

TEST(PlantTips, RefuseInvalidOptions) {
  const auto refused = [](auto change) {
    PlantOptions options = compliant();
    change(options);
    EXPECT_THROW(make(arms(), options), std::invalid_argument);
  };
  refused([](auto& o) { o.model = "elastic"; });
  refused([](auto& o) { o.tip_forces = {{2, {1, 0, 0}}}; });
  refused([](auto& o) { o.tube_errors = {{0, 0, {0, 0, 0, -1.0}}}; });
  refused([](auto& o) {
    o.model = "rigid";
    o.tip_forces = {{0, {1, 0, 0}}};
  });
}

/// Two tubes whose curved ends overlap completely, twisted against each other until they snap.
TEST(PlantTips, SnapsAreCounted) {
  kinematics::ConcentricTubeArm arm;
  arm.tubes = {{1.5e-3, 1.3e-3, 58e9, 0.3, {}}, {1.8e-3, 1.6e-3, 58e9, 0.3, {}}};
  for (std::size_t i = 0; i < 2; ++i) {
    arm.tubes[i].addSection(i == 0 ? 0.4 : 0.3, 0.0);
    arm.tubes[i].addSection(0.1, 8.0);
  }
  PlantTips tips = make({arm}, compliant());
  safety::ArmVector q(4);
  q << -0.30, -0.20, 0.0, 0.0;
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  std::vector<int> jumps;  // degrees
  constexpr int kTurns = 3;
  for (int i = 0; i <= 360 * kTurns; ++i) {
    q[2] = i * std::numbers::pi / 180.0;
    tips.update(0, q);
    ASSERT_TRUE(tips.valid(0)) << i << " deg: " << describe(tips.status(0));
    if (i > 0 && (tips.pose(0).translation() - last).norm() > 5e-3)
      jumps.push_back(i);
    last = tips.pose(0).translation();
  }
  ASSERT_FALSE(jumps.empty());
  EXPECT_GT(jumps.front(), 180) << "wound up past the opposite side first";
  EXPECT_EQ(tips.snaps(0), jumps.size()) << "once for each jump of the tip";
  EXPECT_GT(tips.snapsOf(0).energy, 0.0);
  EXPECT_GT(tips.snapsOf(0).distance, 5e-3) << "the longest of these jumps";
  EXPECT_EQ(tips.allSnaps().energy, tips.snapsOf(0).energy);
  for (std::size_t i = 1; i < jumps.size(); ++i)
    EXPECT_NEAR(jumps[i] - jumps[i - 1], 360, 1) << "once a turn";
  const std::uint32_t snaps = tips.snaps(0);
  tips.restart();
  tips.update(0, q);
  EXPECT_EQ(tips.snaps(0), snaps) << "a cold start is no snap";
}

TEST(PlantTips, UpdatesAllocateNothing) {
  if (!test::canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  PlantOptions options;
  options.tracker = {true, 40.0, 1e-4, 1e-2, 0.1, 0.1};
  PlantTips tips = make(arms(), options);
  TipTracker tracker(2, options.tracker, 1);
  place(tips, 1);  // its joint vectors are on the heap
  const std::size_t before = test::allocationCount();
  tracker.restart(tips, 0, 0);
  for (int i = 0; i < 100; ++i) {
    for (int k = 0; k < 2; ++k) {
      Eigen::Matrix<double, 6, 1> q = Eigen::Matrix<double, 6, 1>::Zero();
      q << -0.15 + 1e-4 * i, -0.1, -0.05, 3.0 + 0.01 * i, 1.5, 0.8;
      tips.update(k, q);
    }
    tracker.step(tips, i * 10 * kMillisecond, 0);
  }
  EXPECT_EQ(test::allocationCount(), before);
}

struct Tracker : ::testing::Test {
  PlantTips tips = make(arms(), compliant());
  TipTrackerOptions options{true, 100.0, 0.0, 0.0, 0.0, 0.0};
  Tracker() { place(tips, 1); }
};

TEST_F(Tracker, MeasuresAtItsRateAndReportsAfterItsDelay) {
  options.rate = 40.0;
  options.delay = 0.060;
  TipTracker tracker(2, options, 1);
  tracker.restart(tips, 5 * kMillisecond, 77);
  EXPECT_EQ(tracker.latest().stamp, 5 * kMillisecond);
  EXPECT_EQ(tracker.latest().mark, 77u);
  std::int64_t reported = 0;
  std::uint64_t last = tracker.latest().sequence;
  for (std::int64_t t = 6; t <= 1005; ++t) {
    const bool is_new = tracker.step(tips, t * kMillisecond, static_cast<std::uint64_t>(t));
    ASSERT_EQ(is_new, tracker.latest().sequence != last);
    last = tracker.latest().sequence;
    if (!is_new)
      continue;
    ++reported;
    EXPECT_EQ(tracker.latest().stamp, (5 + 25 * reported) * kMillisecond);
    EXPECT_EQ(t * kMillisecond - tracker.latest().stamp, 60 * kMillisecond) << "not earlier, not later";
    EXPECT_EQ(tracker.latest().mark, static_cast<std::uint64_t>(5 + 25 * reported)) << "of when it was measured";
  }
  EXPECT_EQ(reported, 37);  // of 40 measured within the second, those taken at least 60 ms before its end
}

TEST_F(Tracker, NoiseAndDropOutsAreAsConfigured) {
  options.position_noise = 0.3e-3;
  options.rotation_noise = 0.01;
  options.drop_out = 0.2;
  TipTracker tracker(2, options, 11), again(2, options, 11), other(2, options, 12);
  for (TipTracker* t : {&tracker, &again, &other})
    t->restart(tips, 0, 0);
  EXPECT_TRUE(tracker.latest().valid[0] && tracker.latest().valid[1]) << "a robot that stands has been seen";
  constexpr int kCount = 20000;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), squares = sum, turns = sum;
  int dropped = 0, both = 0;
  for (int i = 1; i <= kCount; ++i) {
    for (TipTracker* t : {&tracker, &again, &other})
      t->step(tips, i * 10 * kMillisecond, 0);
    const TipMeasurement& m = tracker.latest();
    ASSERT_EQ(m.sequence, static_cast<std::uint64_t>(i + 1));
    ASSERT_EQ(m.position[1], again.latest().position[1]);
    ASSERT_NE(m.position[1], other.latest().position[1]);
    const Eigen::Vector3d error = m.position[1] - tips.pose(1).translation();
    const Eigen::AngleAxisd turn(m.orientation[1] * Eigen::Quaterniond(tips.pose(1).linear()).conjugate());
    sum += error;
    squares += error.cwiseAbs2();
    turns += (turn.angle() * turn.axis()).cwiseAbs2();
    dropped += m.valid[0] ? 0 : 1;
    both += m.valid[0] || m.valid[1] ? 0 : 1;
  }
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::sqrt(squares[i] / kCount), 0.3e-3, 0.01e-3);
    EXPECT_NEAR(std::sqrt(turns[i] / kCount), 0.01, 0.0003);
    EXPECT_NEAR(sum[i] / kCount, 0.0, 5.0 * 0.3e-3 / std::sqrt(kCount));
  }
  EXPECT_NEAR(dropped / double{kCount}, 0.2, 0.015);
  EXPECT_NEAR(both / double{kCount}, 0.04, 0.008) << "arms drop out independently";
  // Repeats from the first number, whatever the time.
  const Eigen::Vector3d first = again.latest().position[0];
  tracker.restart(tips, 1, 0);
  for (int i = 1; i <= kCount; ++i)
    tracker.step(tips, 1 + i * 10 * kMillisecond, 0);
  EXPECT_EQ(tracker.latest().position[0], first);
}

TEST_F(Tracker, BiasAndDistortionAreConstantInTimeAndSmoothInSpace) {
  options.bias = Eigen::Vector3d(1e-3, -2e-3, 0.5e-3);
  options.distortion = 0.8e-3;
  options.distortion_period = 0.15;
  TipTracker tracker(2, options, 7), again(2, options, 7), other(2, options, 8);
  tracker.restart(tips, 0, 0);
  const Eigen::Vector3d tip = tips.pose(0).translation();
  EXPECT_EQ(tracker.latest().position[0], tip + options.bias + tracker.distortion(tip));
  tracker.step(tips, 10 * kMillisecond, 0);
  EXPECT_EQ(tracker.latest().position[0], tip + options.bias + tracker.distortion(tip)) << "no noise";
  double largest = 0.0, steepest = 0.0;
  RandomStream random(5, Noise::kTubes, 0);
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d p = 0.1 * random.normal3(), step = 1e-4 * random.normal3();
    const Eigen::Vector3d error = tracker.distortion(p);
    EXPECT_EQ(error, again.distortion(p));
    EXPECT_NE(error, other.distortion(p)) << "phases are those of the seed";
    largest = std::max(largest, error.cwiseAbs().maxCoeff());
    steepest = std::max(steepest, (tracker.distortion(p + step) - error).cwiseAbs().maxCoeff() / step.norm());
  }
  EXPECT_LE(largest, 0.8e-3);
  EXPECT_GT(largest, 0.75e-3) << "the bound is reached";
  EXPECT_LE(steepest, 0.8e-3 * 2.0 * std::numbers::pi / 0.15 * 1.001);
}

TEST_F(Tracker, OrientationsHaveAConstantErrorOrAreNotMeasured) {
  options.rotation_bias = {0.02, 0.0, -0.01};
  TipTracker tracker(2, options, 7);
  tracker.restart(tips, 0, 0);
  for (std::size_t k = 0; k < 2; ++k) {
    const Eigen::Quaterniond truth(tips.pose(static_cast<int>(k)).linear());
    const Eigen::AngleAxisd error(tracker.latest().orientation[k] * truth.conjugate());
    EXPECT_LT((error.angle() * error.axis() - options.rotation_bias).norm(), 1e-9) << "in the robot base frame";
  }
  options.orientations = false;
  TipTracker positions(2, options, 7);
  positions.restart(tips, 0, 0);
  EXPECT_TRUE(positions.latest().valid[0]);
  EXPECT_EQ(positions.latest().position[0], tracker.latest().position[0]);
  EXPECT_EQ(positions.latest().orientation[0].norm(), 0.0);
}

TEST_F(Tracker, DelayVariesInItsRangeAndMeasurementsArriveInOrder) {
  options.position_noise = 1e-4;
  options.delay = 0.010;
  options.delay_variation = 0.040;
  TipTracker tracker(2, options, 3), again(2, options, 3);
  options.delay_variation = 0.0;
  TipTracker constant(2, options, 3);
  for (TipTracker* t : {&tracker, &again, &constant})
    t->restart(tips, 0, 0);
  std::uint64_t last = 1;
  std::int64_t shortest = 1'000 * kMillisecond, longest = 0;
  std::vector<Eigen::Vector3d> noise(4000);
  for (std::int64_t t = 1; t <= 20'000; ++t) {
    const bool is_new = tracker.step(tips, t * kMillisecond, 0);
    again.step(tips, t * kMillisecond, 0);
    constant.step(tips, t * kMillisecond, 0);
    noise[constant.latest().sequence] = constant.latest().position[0];
    ASSERT_EQ(tracker.latest().sequence, again.latest().sequence);
    if (!is_new)
      continue;
    ASSERT_GT(tracker.latest().sequence, last);
    last = tracker.latest().sequence;
    ASSERT_EQ(tracker.latest().position[0], noise[last]) << "the delay has its own random numbers";
    const std::int64_t delay = t * kMillisecond - tracker.latest().stamp;
    shortest = std::min(shortest, delay);
    longest = std::max(longest, delay);
  }
  EXPECT_GE(shortest, 10 * kMillisecond);
  EXPECT_LT(shortest, 13 * kMillisecond);
  EXPECT_LE(longest, 51 * kMillisecond);
  EXPECT_GT(longest, 47 * kMillisecond);
}

}  // namespace
}  // namespace tandem::sim
