// SPDX-License-Identifier: Apache-2.0
/** @file Properties of the teleoperation pipeline for random operators. */
#include <gtest/gtest.h>

#include "planning/teleoperation/pipeline.h"
#include "tests/unit/planning/dice.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::test {
namespace {

using namespace planning::teleoperation;
using Eigen::Quaterniond;
using Eigen::Vector3d;

/** Two tips that follow their targets like control: first order, within the response time. */
struct Rig {
  Rig(const Options& options, double period)
      : pipeline(options, period), dt(period), lag(responseTime(options.guard, period)) {
    tips[0].position = {0.0, 0.005, 0.2};
    tips[1].position = {0.0, -0.005, 0.2};
  }
  State step(const Sample& sample) {
    const State state = pipeline.step(sample, tips);
    if (state == State::kReleased)
      return state;
    planning::Reference reference;
    pipeline.tasks(0.0, 0.0, reference);
    // Tip motion for two levels of tasks.
    std::array<Vector3d, 2> wanted{tips[0].position, tips[1].position};
    const auto at = [](int k) { return static_cast<std::size_t>(k); };
    int named = 0;
    for (const planning::TaskReference& task : {reference.tasks[0], reference.tasks[1]}) {
      if (task.kind == planning::TaskKind::kTipPosition)
        wanted[at(named = task.arm)] = task.position;
    }
    for (const planning::TaskReference& task : {reference.tasks[0], reference.tasks[1]}) {
      if (task.kind == planning::TaskKind::kRelativePosition)
        wanted[at(1 - named)] = wanted[at(named)] + (named == task.arm ? -1.0 : 1.0) * task.position;
    }
    tips[0].position += dt / lag * (wanted[0] - tips[0].position);
    tips[1].position += dt / lag * (wanted[1] - tips[1].position);
    return state;
  }
  void run(const Sample& sample, double seconds) {
    for (int i = 0; i < static_cast<int>(seconds / dt); ++i)
      step(sample);
  }
  Pipeline pipeline;
  double dt, lag;
  TipPlaces tips;
};

Sample moving(Mode mode, const Vector3d& velocity) {
  Sample sample;
  sample.number = 1;
  sample.present = true;
  sample.mode = mode;
  sample.arm = 0;
  sample.other_arm = 1;
  sample.value = velocity;
  return sample;
}

/// An operator without restrictions: every input may change at any time.
void mutate(Sample& sample, Dice& dice) {
  ++sample.number;
  if (dice.chance(0.02))
    sample.present = !sample.present;
  if (dice.chance(0.02))
    sample.clutch = !sample.clutch;
  if (dice.chance(0.01))
    sample.mode = static_cast<Mode>(1 + dice.engine() % 3);
  if (dice.chance(0.01))
    std::swap(sample.arm, sample.other_arm);
  if (dice.chance(0.01))
    sample.pose = !sample.pose;
  if (dice.chance(0.02))
    sample.frame = dice.turn();
  if (dice.chance(0.02))
    sample.scale = dice.uniform(kMinScale, kMaxScale);
  if (sample.pose)
    sample.value += dice.ball(dice.chance(0.05) ? 0.05 : 1e-3);
  else if (dice.chance(0.2))
    sample.value = dice.ball(dice.chance(0.1) ? 1.0 : 0.04);
}

Options anyOptions(Dice& dice) {
  Options options;
  options.guard.margin = dice.uniform(0.5e-3, 2e-3);
  options.guard.max_speed = dice.uniform(5e-3, 40e-3);
  const int regions = static_cast<int>(dice.engine() % 4);
  for (int i = 0; i < regions; ++i) {
    ForbiddenRegion region{"r" + std::to_string(i), Sphere{}};
    // Around the start of the tips, but not containing them.
    const Vector3d away = 0.02 * dice.ball(1.0).normalized();
    const Vector3d place = Vector3d(0.0, 0.0, 0.2) + away;
    switch (dice.engine() % 3) {
      case 0:
        region.shape = Sphere{place, dice.uniform(1e-3, 8e-3)};
        break;
      case 1:
        region.shape = HalfSpace{place, -away.normalized()};
        break;
      default:
        region.shape = Box{place - Vector3d::Constant(dice.uniform(1e-4, 4e-3)),
                           place + Vector3d::Constant(dice.uniform(1e-4, 4e-3))};
    }
    options.guard.forbidden.push_back(region);
  }
  if (dice.chance(0.5))
    options.guard.workspace = Box{{-0.02, -0.02, 0.18}, {0.02, 0.02, 0.22}};
  return options;
}

TEST(Teleoperation, NoTipEverEntersAForbiddenRegion) {
  overSeeds([](Dice& dice) {
    const Options options = anyOptions(dice);
    Rig rig(options, dice.chance(0.5) ? 1e-3 : 0.02);
    std::vector<std::array<bool, 2>> outside(options.guard.forbidden.size());
    for (std::size_t r = 0; r < outside.size(); ++r) {
      for (std::size_t k = 0; k < 2; ++k)
        outside[r][k] = distance(options.guard.forbidden[r], rig.tips[k].position) >= 0.0;
    }
    Sample sample = moving(Mode::kPair, dice.ball(0.04));
    for (int i = 0; i < 1500; ++i) {
      mutate(sample, dice);
      rig.step(sample);
      for (std::size_t r = 0; r < outside.size(); ++r) {
        for (std::size_t k = 0; k < 2; ++k) {
          if (outside[r][k]) {
            ASSERT_GE(distance(options.guard.forbidden[r], rig.tips[k].position), 0.0)
                << "region " << r << " tip " << k << " step " << i << " mode " << name(sample.mode);
          }
        }
      }
    }
  });
}

TEST(Teleoperation, TargetsStayInTheWorkspaceAndKeepTheirSpeedAndLeash) {
  overSeeds([](Dice& dice) {
    Options options = anyOptions(dice);
    options.guard.forbidden.clear();
    options.guard.workspace = Box{{-0.01, -0.015, 0.19}, {0.01, 0.015, 0.21}};
    const double dt = dice.chance(0.5) ? 1e-3 : 0.1;
    Rig rig(options, dt);
    const double leash = leashOf(options.guard, dt);
    Sample sample = moving(Mode::kTip, dice.ball(0.04));
    bool engaged = false;
    Vector3d before = Vector3d::Zero();
    for (int i = 0; i < 1500; ++i) {
      mutate(sample, dice);
      sample.mode = sample.mode == Mode::kRelative ? Mode::kTip : sample.mode;
      const int arm = sample.arm;
      rig.step(sample);
      if (rig.pipeline.engaged()) {
        const Vector3d target = rig.pipeline.target();
        const Box& box = *options.guard.workspace;
        ASSERT_TRUE(((target - box.minimum).array() >= -1e-12).all() &&
                    ((box.maximum - target).array() >= -1e-12).all());
        ASSERT_LE((target - rig.pipeline.position()).norm(), leash + 1e-12);
        if (engaged && arm == sample.arm) {
          // Toward the tip it may move at any speed.
          const bool retreat = (target - rig.pipeline.position()).norm() < (before - rig.pipeline.position()).norm();
          if (!retreat && sample.arm == arm && i > 0) {
            const bool same = (target - before).norm() <= options.guard.max_speed * dt + 1e-12;
            const bool new_engagement =
                (target - rig.pipeline.position()).norm() <= options.guard.max_speed * dt + 1e-12;
            ASSERT_TRUE(same || new_engagement);
          }
        }
        before = target;
      }
      engaged = rig.pipeline.engaged();
    }
  });
}

TEST(Teleoperation, EngagingNeverJumps) {
  overSeeds([](Dice& dice) {
    const Options options;
    Rig rig(options, 0.01);
    for (int i = 0; i < 20; ++i) {
      Sample sample = moving(static_cast<Mode>(1 + dice.engine() % 3), dice.ball(0.05));
      sample.pose = dice.chance(0.5);
      sample.value += dice.ball(10.0);          // any position of the device
      rig.tips[0].position += dice.ball(0.01);  // meanwhile the robot was moved
      rig.step(sample);
      ASSERT_TRUE(rig.pipeline.engaged());
      EXPECT_LE((rig.pipeline.target() - rig.pipeline.position()).norm(), options.guard.max_speed * 0.01 + 1e-12);
      planning::Reference reference;
      rig.pipeline.tasks(5.0, 3.0, reference);
      ASSERT_EQ(reference.task_count, 2);
      sample.present = false;
      EXPECT_EQ(rig.step(sample), State::kReleased);
      EXPECT_FALSE(rig.pipeline.engaged());
    }
  });
}

TEST(Teleoperation, MotionIsTheDevicesTimesScaleInTheAxesOfTheView) {
  overSeeds([](Dice& dice) {
    Options options;
    options.deadband_speed = 0.0;
    options.guard.max_speed = 1.0;
    options.guard.leash = 1.0;
    options.scale = dice.uniform(kMinScale, kMaxScale);
    const double dt = 0.005;
    const Vector3d velocity = dice.ball(0.01);
    const Quaterniond view = dice.turn();
    for (const bool pose : {false, true}) {
      Rig rig(options, dt);
      const Vector3d start = rig.tips[0].position;
      const Vector3d relative = rig.tips[0].position - rig.tips[1].position;
      Sample sample = moving(Mode::kPair, velocity);
      sample.frame = view;
      sample.pose = pose;
      Vector3d place = dice.ball(1.0);
      for (int i = 0; i < 200; ++i) {
        sample.value = pose ? place : velocity;
        rig.step(sample);
        place += dt * velocity;
        ++sample.number;
      }
      sample.value = pose ? sample.value : Vector3d(Vector3d::Zero());
      rig.run(sample, 4.0);
      const double moved = (pose ? 199 : 200) * dt;
      EXPECT_LT((rig.tips[0].position - start - options.scale * (view * (moved * velocity))).norm(), 2e-6) << pose;
      EXPECT_LT((rig.tips[0].position - rig.tips[1].position - relative).norm(), 1e-6);
    }
  });
}

TEST(Teleoperation, TheClutchReIndexes) {
  overSeeds([](Dice& dice) {
    const Options options;
    Rig rig(options, 0.01);
    Sample sample = moving(Mode::kTip, Vector3d::Zero());
    sample.pose = true;
    for (int i = 0; i < 50; ++i) {
      sample.value += dice.ball(2e-4);
      ++sample.number;
      rig.step(sample);
    }
    sample.clutch = true;
    EXPECT_EQ(rig.step(sample), State::kClutched);
    rig.run(sample, 2.0);  // the tip reaches the last target
    const Vector3d there = rig.tips[0].position;
    for (int i = 0; i < 100; ++i) {
      sample.value += dice.ball(0.02);
      ++sample.number;
      rig.step(sample);
    }
    EXPECT_LT((rig.tips[0].position - there).norm(), 1e-6) << "the hand goes back, the robot stays";
    sample.clutch = false;
    rig.run(sample, 1.0);
    EXPECT_LT((rig.tips[0].position - there).norm(), 1e-6) << "and does not catch up";
  });
}

TEST(Teleoperation, TheScaleIsRamped) {
  Options options;
  options.scale = 1.0;
  options.scale_rate = 0.5;
  Rig rig(options, 0.01);
  Sample sample = moving(Mode::kTip, {0.01, 0.0, 0.0});
  sample.scale = 0.05;
  double last = rig.pipeline.scale();
  for (int i = 0; i < 300; ++i) {
    rig.step(sample);
    ASSERT_LE(std::abs(rig.pipeline.scale() - last), 0.5 * 0.01 + 1e-12);
    last = rig.pipeline.scale();
  }
  EXPECT_NEAR(last, 0.05, 1e-12);
}

TEST(Teleoperation, EveryStageSaysWhatItDid) {
  Options options;
  options.guard.forbidden = {{"wall", HalfSpace{{0.002, 0.0, 0.0}, {-1.0, 0.0, 0.0}}}};
  options.guard.workspace = Box{{-1.0, -1.0, -1.0}, {1.0, 0.0055, 1.0}};
  Rig rig(options, 0.01);
  Sample sample = moving(Mode::kTip, {0.02, 0.02, 0.0});
  rig.run(sample, 4.0);
  const auto& stages = rig.pipeline.stages();
  const auto of = [&](Stage s) { return stages[static_cast<std::size_t>(s)]; };
  EXPECT_EQ(of(Stage::kFixture).limiter, Limiter::kForbiddenRegion);
  EXPECT_EQ(of(Stage::kWorkspace).limiter, Limiter::kWorkspace);
  EXPECT_EQ(of(Stage::kWorkspace).index, 3);  // y_max
  EXPECT_NEAR(rig.tips[0].position.x(), 0.001, 1e-4);
  EXPECT_NEAR(rig.tips[0].position.y(), 0.0055, 1e-4);
  for (std::size_t s = 1; s < kStages; ++s) {
    if (s != static_cast<std::size_t>(Stage::kFilter)) {
      EXPECT_EQ(stages[s].input, stages[s - 1].output) << name(static_cast<Stage>(s));
    }
  }
  // The reversal takes effect at once: a velocity device has no position beyond the wall.
  sample.value = {-0.02, 0.0, 0.0};
  rig.run(sample, 0.5);
  EXPECT_LT(rig.tips[0].position.x(), 0.0);
}

TEST(Teleoperation, AllocatesNothing) {
  Dice dice(7);
  Options options = anyOptions(dice);
  options.guard.forbidden.push_back({"ball", Sphere{{0.02, 0.0, 0.2}, 0.01}});
  Rig rig(options, 0.01);
  Sample sample = moving(Mode::kPair, dice.ball(0.04));
  planning::Reference reference;
  const std::size_t before = allocationCount();
  for (int i = 0; i < 500; ++i) {
    mutate(sample, dice);
    rig.pipeline.step(sample, rig.tips);
    rig.pipeline.tasks(5.0, 3.0, reference);
  }
  if (canCountAllocations()) {
    EXPECT_EQ(allocationCount(), before);
  }
}

}  // namespace
}  // namespace tandem::test
