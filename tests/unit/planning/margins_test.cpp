// SPDX-License-Identifier: Apache-2.0
#include "planning/margins.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "planning/reference_tracker.h"
#include "tests/unit/planning/arm_pair.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::test {
namespace {

using control::MethodParameters;

constexpr double kMarginPeriod = 0.1;  // s

/// Closed loop of two arms with ideal joints.
struct Loop {
  const Pair& pair;
  planning::ReferenceTracker tracker;
  safety::RobotVector q;
  planning::TrackResult result{};

  Loop(const Pair& two, const MethodParameters& parameters, const safety::RobotVector& start)
      : pair(two),
        tracker({two.a.get(), two.b.get()}, {&two.limits, &two.limits}, control::Method::kHqp, parameters, {5.0, 3.0}),
        q(start) {}

  /// One period towards the target tips; returns the two margins after it.
  struct Margin {
    double distance = 0.0, stability = 0.0;
  };
  Margin step(const planning::Reference& reference) {
    tracker.step(q, q, reference, result);
    EXPECT_EQ(result.status, planning::TrackStatus::kOk);
    q += kMarginPeriod * result.solution.velocity;
    EXPECT_TRUE(tracker.computeTips(q, result));
    std::array<kinematics::Body, 2> body;
    for (int k = 0; k < 2; ++k) {
      kinematics::Branch branch = tracker.tips().branch(k);
      EXPECT_EQ(kinematics::makeBody(*(k == 0 ? pair.a : pair.b), q.segment(6 * k, 6), branch, false, body[k]),
                kinematics::ModelStatus::kOk);
      EXPECT_LE(safety::largestViolation(pair.limits, q.segment(6 * k, 6)), 1e-9);
    }
    return {kinematics::clearance(body[0], body[1]).distance,
            std::min(result.tip[0].stability, result.tip[1].stability)};
  }
};

planning::Reference towards(const std::vector<kinematics::Tip>& tips) {
  const Eigen::Vector3d a = tips[0].pose.translation(), b = tips[1].pose.translation();
  planning::Reference r;
  r.task_count = 2;
  r.tasks[0] = {planning::TaskKind::kRelativePosition, 0, 1, a - b, Eigen::Vector3d::Zero()};
  r.tasks[1] = {planning::TaskKind::kTipPosition, 0, 0, a, Eigen::Vector3d::Zero()};
  return r;
}

/// Random motions between random joints, with and without the required margins: compares the remaining margins.
void compare(const char* model, const MethodParameters& kept, int trials, double Loop::Margin::*which, double least) {
  SCOPED_TRACE(trace(baseSeed()));
  Random random(baseSeed());
  const Pair pair(model);
  int below = 0, started = 0, arrived = 0;
  double lowest = 1e9;
  for (int trial = 0; trial < trials; ++trial) {
    SCOPED_TRACE("trial " + std::to_string(trial));
    safety::RobotVector from, to;
    std::vector<kinematics::Tip> at_start, at_end;
    if (!pair.known(pair.both, random, from, at_start) || !pair.known(pair.both, random, to, at_end))
      continue;
    const planning::Reference reference = towards(at_end);
    Loop loose(pair, {}, from), tight(pair, kept, from);
    if (Loop start(pair, {}, from); start.step(towards(at_start)).*which < 1.2 * least)
      continue;
    ++started;
    double least_loose = 1e9, least_tight = 1e9;
    for (int i = 0; i < 250; ++i) {
      least_loose = std::min(least_loose, loose.step(reference).*which);
      least_tight = std::min(least_tight, tight.step(reference).*which);
    }
    below += least_loose < least ? 1 : 0;
    arrived += tight.result.error[0] < 1e-3 ? 1 : 0;
    lowest = std::min(lowest, least_tight);
    EXPECT_GE(least_tight, least) << "without: " << least_loose;
  }
  std::printf("  %d ways, %d of them below without the margin; least with it %.4g; %d arrived\n", started, below,
              lowest, arrived);
  EXPECT_GT(below, 2);
  EXPECT_GT(arrived, 2);
}

TEST(Margins, DistanceOfTheArmsIsNeverBelowItsLeastValueOnAnyWay) {
  MethodParameters kept;
  kept.least_distance = 2e-3;
  compare("rigid", kept, 60, &Loop::Margin::distance, kept.least_distance);
}

TEST(Margins, StabilityIsNeverBelowItsLeastValueOnAnyWay) {
  MethodParameters kept;
  kept.least_stability = 0.3;
  compare("compliant", kept, 40, &Loop::Margin::stability, kept.least_stability);
}

TEST(Margins, AllocateNothing) {
  if (!canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  MethodParameters kept;
  kept.least_stability = 0.3;
  kept.least_distance = 2e-3;
  for (const char* model : {"rigid", "compliant"}) {
    const Pair pair(model);
    planning::ReferenceTracker tracker({pair.a.get(), pair.b.get()}, {&pair.limits, &pair.limits},
                                       control::Method::kHqp, kept, {5.0, 3.0});
    Random random(baseSeed());
    safety::RobotVector q;
    std::vector<kinematics::Tip> tips;
    planning::TrackResult result;
    int steps = 0, most = 0;
    for (int i = 0; i < 20; ++i) {
      if (!pair.known(pair.both, random, q, tips))
        continue;
      planning::Reference reference = towards(tips);
      reference.tasks[1].position.x() += 1e-3;
      const std::size_t before = allocationCount();
      tracker.restart();
      tracker.step(q, q, reference, result);
      EXPECT_EQ(allocationCount(), before) << model << " step " << steps;
      ++steps;
      most = std::max(most, tracker.problem().barrier_count);
    }
    EXPECT_GT(steps, 5);
    EXPECT_EQ(most, std::string(model) == "rigid" ? 1 : 3);
  }
}

}  // namespace
}  // namespace tandem::test
