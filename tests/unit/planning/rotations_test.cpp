// SPDX-License-Identifier: Apache-2.0
/** @file Properties of the teleoperation of orientations for random operators. */
#include <gtest/gtest.h>

#include "planning/teleoperation/pipeline.h"
#include "tests/unit/planning/dice.h"
#include "tests/unit/safety/allocation_counter.h"

namespace tandem::test::rotation {
namespace {

using namespace planning::teleoperation;
using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kDt = 0.01;  // s

double angleBetween(const Quaterniond& a, const Quaterniond& b) { return Orientations{}.difference(a, b).norm(); }
double axisAngle(const Quaterniond& a, const Quaterniond& b) { return Orientations{true}.difference(a, b).norm(); }

Options optionsWith(TipOrientation followed) {
  Options options;
  options.rotation.followed = followed;
  return options;
}
/// Without dead band and limits that act.
Options freeOptions(TipOrientation followed) {
  Options options = optionsWith(followed);
  options.rotation.deadband_speed = 0.0;
  options.rotation.max_speed = 100.0;
  options.rotation.leash = 3.0;
  return options;
}

/** Tips whose orientation follows the task like control: first order, within the response time; what the task leaves
 * free turns at random. */
struct Rig {
  Rig(const Options& options, Dice& random)
      : pipeline(options, kDt), lag(responseTime(options.guard, kDt)), space(options.rotation.space()), dice(random) {
    for (auto& tip : tips)
      tip = {dice.ball(0.1), dice.turn()};
    sample.number = 1;
    sample.present = true;
    sample.mode = Mode::kPair;
    sample.other_arm = 1;
  }
  State step() {
    const State state = pipeline.step(sample, tips);
    if (state == State::kReleased)
      return state;
    pipeline.tasks(0.0, 0.0, reference);
    const planning::TaskReference& task = reference.tasks[static_cast<std::size_t>(reference.task_count - 1)];
    Quaterniond& tip = tips[static_cast<std::size_t>(sample.arm)].orientation;
    if (space.axis_only)
      tip = tip * AngleAxisd(dice.uniform(-0.1, 0.1), Vector3d::UnitZ());
    tip = space.moved(tip, kDt / lag * space.difference(task.orientation, tip));
    return state;
  }
  void run(double seconds) {
    for (int i = 0; i < std::lround(seconds / kDt); ++i)
      step();
  }
  /// Turns the handle from one sample to the next.
  void turn(const Vector3d& by) {
    sample.orientation = Orientations{}.moved(sample.orientation, by);
    ++sample.number;
    step();
  }
  const Quaterniond& tip() const { return tips[static_cast<std::size_t>(sample.arm)].orientation; }
  double ahead() const { return space.difference(pipeline.targetOrientation(), tip()).norm(); }

  Pipeline pipeline;
  double lag;
  Orientations space;
  Dice& dice;
  TipPlaces tips;
  Sample sample;
  planning::Reference reference;
};

TEST(Rotation, TheTipTurnsAsTheHandleInTheAxesOfTheView) {
  overSeeds([](Dice& dice) {
    const Options options = freeOptions(TipOrientation::kFull);
    Rig rig(options, dice);
    rig.sample.pose = true;
    rig.sample.orientation = dice.turn();
    rig.sample.frame = dice.turn();
    rig.step();
    const Quaterniond handle = rig.sample.orientation, start = rig.tip();
    for (int i = 0; i < 100; ++i)
      rig.turn(dice.ball(0.05));
    rig.run(4.0);
    const Quaterniond turned = rig.sample.orientation * handle.conjugate();
    EXPECT_LT(angleBetween(rig.tip(), rig.sample.frame * turned * rig.sample.frame.conjugate() * start), 1e-6);
    EXPECT_EQ(rig.reference.task_count, 3);
    EXPECT_EQ(rig.reference.tasks[2].kind, planning::TaskKind::kTipOrientation);
    EXPECT_EQ(rig.reference.tasks[2].arm, 0);
  });
}

TEST(Rotation, AVelocityDeviceTurnsTheTipWithItsScale) {
  overSeeds([](Dice& dice) {
    Options options = freeOptions(TipOrientation::kFull);
    options.rotation.scale = dice.uniform(kMinScale, kMaxScale);
    Rig rig(options, dice);
    rig.sample.frame = dice.turn();
    rig.sample.scale = 0.1;  // of positions only
    const Quaterniond start = rig.tip();
    const Vector3d speed = dice.ball(0.5);
    rig.sample.angular = speed;
    rig.run(1.0);
    rig.sample.angular.setZero();
    rig.run(4.0);
    const Vector3d asked = options.rotation.scale * (rig.sample.frame * speed);
    EXPECT_LT(angleBetween(rig.tip(), kinematics::rotationBy(asked) * start), 1e-6);
  });
}

TEST(Rotation, OfAnAxisTheRotationAboutItIsFree) {
  overSeeds([](Dice& dice) {
    const Options options = freeOptions(TipOrientation::kAxis);
    Rig rig(options, dice);
    rig.sample.pose = true;
    rig.sample.orientation = dice.turn();
    rig.step();
    const Quaterniond handle = rig.sample.orientation, start = rig.tip();
    for (int i = 0; i < 100; ++i)
      rig.turn(dice.ball(0.05));
    rig.run(4.0);
    EXPECT_LT(axisAngle(rig.tip(), rig.sample.orientation * handle.conjugate() * start), 1e-6);
    EXPECT_EQ(rig.reference.tasks[2].kind, planning::TaskKind::kTipAxis);
    // The tip turns about its axis all the time: that is not a distance from the target.
    EXPECT_EQ(rig.pipeline.rotationStages()[static_cast<std::size_t>(Stage::kReach)].limiter, Limiter::kNone);
  });
}

TEST(Rotation, EngagingNeverJumps) {
  overSeeds([](Dice& dice) {
    const Options options = optionsWith(dice.chance(0.5) ? TipOrientation::kAxis : TipOrientation::kFull);
    Rig rig(options, dice);
    for (int i = 0; i < 20; ++i) {
      rig.sample.present = true;
      rig.sample.pose = dice.chance(0.5);
      rig.sample.orientation = dice.turn();
      rig.sample.angular = dice.ball(5.0);
      rig.tips[0].orientation = dice.turn();  // meanwhile the robot was moved
      ++rig.sample.number;
      rig.pipeline.step(rig.sample, rig.tips);
      EXPECT_LE(rig.ahead(), options.rotation.max_speed * kDt + 1e-9);
      rig.sample.present = false;
      EXPECT_EQ(rig.step(), State::kReleased);
    }
  });
}

TEST(Rotation, TheClutchReIndexes) {
  overSeeds([](Dice& dice) {
    const Options options = optionsWith(TipOrientation::kFull);
    Rig rig(options, dice);
    rig.sample.pose = true;
    rig.sample.orientation = dice.turn();
    for (int i = 0; i < 50; ++i)
      rig.turn(dice.ball(5e-3));
    rig.sample.clutch = true;
    const Quaterniond last = rig.pipeline.targetOrientation();
    EXPECT_EQ(rig.step(), State::kClutched);
    rig.run(2.0);  // the tip reaches the last target
    EXPECT_LT(angleBetween(rig.tip(), last), 1e-6) << "motion still in the filter is discarded";
    const Quaterniond there = rig.tip();
    for (int i = 0; i < 100; ++i)
      rig.turn(dice.ball(0.5));
    EXPECT_LT(angleBetween(rig.tip(), there), 1e-6) << "the hand goes back, the tip stays";
    rig.sample.clutch = false;
    rig.run(1.0);
    EXPECT_LT(angleBetween(rig.tip(), there), 1e-6) << "and does not catch up";
    const Quaterniond handle = rig.sample.orientation;
    for (int i = 0; i < 50; ++i)
      rig.turn(dice.ball(3e-3));
    rig.run(2.0);
    EXPECT_LT(angleBetween(rig.tip(), rig.sample.orientation * handle.conjugate() * there), 1e-6)
        << "from there it follows again";
  });
}

TEST(Rotation, TargetsKeepTheirSpeedAndTheirLeash) {
  overSeeds([](Dice& dice) {
    Options options = optionsWith(dice.chance(0.5) ? TipOrientation::kAxis : TipOrientation::kFull);
    options.rotation.max_speed = dice.uniform(0.1, 2.0);
    options.rotation.leash = dice.uniform(0.02, 0.3);
    Rig rig(options, dice);
    const double leash = angleLeashOf(options, kDt);
    rig.sample.pose = dice.chance(0.5);
    for (int i = 0; i < 500; ++i) {
      if (dice.chance(0.1))
        rig.sample.angular = dice.ball(5.0);
      if (dice.chance(0.02))
        rig.tips[0].orientation = rig.space.moved(rig.tip(), dice.ball(0.1));  // pushed
      const bool engaged = rig.pipeline.engaged();
      const Quaterniond before = rig.pipeline.targetOrientation(), tip = rig.tip();
      rig.sample.orientation = Orientations{}.moved(rig.sample.orientation, dice.ball(dice.chance(0.1) ? 1.0 : 0.02));
      ++rig.sample.number;
      rig.pipeline.step(rig.sample, rig.tips);
      const Quaterniond& target = rig.pipeline.targetOrientation();
      ASSERT_LE(rig.ahead(), leash + 1e-9);
      const bool retreat = rig.space.difference(before, tip).norm() > leash - options.rotation.max_speed * kDt;
      if (engaged && !retreat) {
        ASSERT_LE(rig.space.difference(target, before).norm(), options.rotation.max_speed * kDt + 1e-9);
      }
      rig.step();
    }
  });
}

TEST(Rotation, TheDeadBandsKeepAHandThatTremblesStill) {
  overSeeds([](Dice& dice) {
    Options options = freeOptions(TipOrientation::kFull);
    options.rotation.deadband_speed = 0.05;
    options.rotation.deadband_angle = 0.02;
    Rig rig(options, dice);
    const Quaterniond start = rig.tip();
    for (int i = 0; i < 100; ++i) {
      rig.sample.angular = 0.05 * dice.ball(0.5);
      rig.step();
    }
    EXPECT_LT(angleBetween(rig.tip(), start), 1e-12);
    rig.sample.angular = Vector3d(0.0, 0.0, 0.15);
    rig.run(1.0);
    rig.sample.angular.setZero();
    rig.run(4.0);
    EXPECT_NEAR(angleBetween(rig.tip(), start), 0.1, 1e-6) << "what is beyond the dead band";
    rig.sample.pose = true;
    const Quaterniond centre = rig.sample.orientation = dice.turn(), there = rig.tip();
    ++rig.sample.number;
    rig.step();
    for (int i = 0; i < 100; ++i) {
      rig.sample.orientation = Orientations{}.moved(centre, dice.ball(0.01));
      ++rig.sample.number;
      rig.step();
    }
    EXPECT_LT(angleBetween(rig.tip(), there), 1e-12);
  });
}

/// Where the tip cannot follow, a handle that turns on and on does not turn it the other way.
TEST(Rotation, AHandleMoreThanHalfATurnAheadDoesNotTurnTheTipBack) {
  overSeeds([](Dice& dice) {
    Options options = optionsWith(TipOrientation::kFull);
    Rig rig(options, dice);
    rig.sample.pose = true;
    const Vector3d about = dice.ball(1.0).normalized();
    const Quaterniond start = rig.tip();
    for (int i = 0; i < 400; ++i) {
      rig.sample.orientation = Orientations{}.moved(rig.sample.orientation, 0.03 * about);
      ++rig.sample.number;
      rig.pipeline.step(rig.sample, rig.tips);  // the tip stays, e.g. at a joint limit
      ASSERT_GE(rig.space.difference(rig.pipeline.targetOrientation(), start).dot(about), -1e-9) << i;
    }
    EXPECT_NEAR(rig.ahead(), angleLeashOf(options, kDt), 1e-9);
  });
}

TEST(Rotation, AVelocityDeviceReversesAtOnce) {
  overSeeds([](Dice& dice) {
    const Options options = optionsWith(TipOrientation::kFull);
    Rig rig(options, dice);
    rig.sample.angular = dice.ball(1.0).normalized();
    const auto ahead = [&](double seconds) {  // along the device's motion, while the tip stays
      for (int i = 0; i < std::lround(seconds / kDt); ++i)
        rig.pipeline.step(rig.sample, rig.tips);
      return rig.space.difference(rig.pipeline.targetOrientation(), rig.tip()).dot(rig.sample.angular);
    };
    EXPECT_NEAR(ahead(3.0), angleLeashOf(options, kDt), 1e-6);
    rig.sample.angular *= -1.0;
    EXPECT_GT(ahead(0.6), 0.0) << "it is on the other side of the tip";
  });
}

TEST(Rotation, IgnoredItIsNoTask) {
  overSeeds([](Dice& dice) {
    const Options options;
    Rig rig(options, dice);
    rig.sample.mode = static_cast<Mode>(1 + dice.engine() % 3);
    rig.sample.pose = true;
    for (int i = 0; i < 50; ++i) {
      rig.sample.orientation = dice.turn();
      rig.sample.angular = dice.ball(1.0);
      ++rig.sample.number;
      rig.pipeline.step(rig.sample, rig.tips);
      rig.pipeline.tasks(5.0, 3.0, rig.reference);
      ASSERT_EQ(rig.reference.task_count, 2);
    }
  });
}

TEST(Rotation, AllocatesNothing) {
  Dice dice(7);
  const Options options = optionsWith(TipOrientation::kFull);
  Rig rig(options, dice);
  const std::size_t before = allocationCount();
  for (int i = 0; i < 200; ++i) {
    rig.sample.pose = i % 50 > 20;
    rig.sample.angular = dice.ball(1.0);
    rig.turn(dice.ball(0.1));
  }
  if (canCountAllocations()) {
    EXPECT_EQ(allocationCount(), before);
  }
}

}  // namespace
}  // namespace tandem::test::rotation
