// SPDX-License-Identifier: Apache-2.0
/** @file Arm supervisor with commands at other rates than configured. */
#include "safety/arm_supervisor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/safety/random_arm.h"

namespace tandem::safety {
namespace {

constexpr double kStep = 1e-3;  // of the bus, s

/** An arm with a command source of unknown period. */
class Commanded {
 public:
  Commanded(const ArmLimits& limits, const ArmVector& start, double period)
      : limits_(limits), supervisor_(limits, start, options(period)) {
    request(DriveRequest::kEnable);
  }
  static SupervisorOptions options(double period) {
    SupervisorOptions options;
    options.control_period = period;
    return options;
  }
  /// @param velocity  m/s, rad/s; empty: hold
  void command(const ArmVector& velocity) {
    ArmRequest request;
    request.moving = velocity.size() > 0;
    if (request.moving) {
      request.motion.velocity = velocity;
      request.motion.position = supervisor_.setpoint();
    }
    supervisor_.command(request, supervisor_.reference(), {}, now_);
  }
  void request(DriveRequest what) {
    ArmRequest request;
    request.request = what;
    supervisor_.command(request, supervisor_.reference(), {}, now_);
  }
  void step() {
    now_ += static_cast<std::int64_t>(1e9 * kStep);
    supervisor_.step(kStep, now_);
  }
  const ArmSupervisor& arm() const { return supervisor_; }
  /// Longest stop ramp from any speed, s.
  double stopTime() const {
    double time = 0.0;
    for (int j = 0; j < limits_.jointCount(); ++j)
      time = std::max(time, limits_.joints[static_cast<std::size_t>(j)].velocity /
                                limits_.joints[static_cast<std::size_t>(j)].stop_deceleration);
    return time;
  }

  /// Continues until standstill. @return s that this took, 10 at most
  double stand() {
    double time = 0.0;
    for (; !supervisor_.standing() && time < 10.0; time += kStep)
      step();
    return time;
  }

 private:
  ArmLimits limits_;
  ArmSupervisor supervisor_;
  std::int64_t now_ = 0;
};

ArmVector speeds(const ArmLimits& limits, double share) {
  ArmVector v(limits.jointCount());
  for (Eigen::Index j = 0; j < v.size(); ++j)
    v[j] = share * limits.joints[static_cast<std::size_t>(j)].velocity;
  return v;
}

TEST(ArmSupervisor, IsEnabledOnlyAtStandstill) {
  int moving = 0;
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 200; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    const ArmLimits limits = test::randomLimits(random);
    Commanded arm(limits, test::randomInside(limits, random), 0.01);
    for (int k = 0; k < 20; ++k) {
      arm.command(speeds(limits, k % 2 == 0 ? 0.01 : -0.01));
      arm.step();
    }
    arm.request(DriveRequest::kDisable);
    if (arm.arm().standing())
      continue;
    ++moving;
    arm.request(DriveRequest::kEnable);
    EXPECT_EQ(arm.arm().state(), OperatingState::kDisabled);
    arm.stand();
    arm.request(DriveRequest::kEnable);
    EXPECT_EQ(arm.arm().state(), OperatingState::kEnabled);
  }
  EXPECT_GT(moving, 50);
}

TEST(ArmSupervisor, BeginsWhereTheArmIsMeasured) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 200; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    const ArmLimits limits = test::randomLimits(random);
    const ArmVector before = test::randomInside(limits, random), now = test::randomInside(limits, random);
    ArmSupervisor supervisor(limits, before, Commanded::options(0.01));
    ArmRequest enable;
    enable.request = DriveRequest::kEnable;
    supervisor.command(enable, now, {}, 0);
    ASSERT_EQ(supervisor.state(), OperatingState::kEnabled);
    EXPECT_EQ(supervisor.setpoint(), now);
    supervisor.step(kStep, 1'000'000);
    EXPECT_EQ(supervisor.reference(), now);
  }
}

TEST(ArmSupervisor, FollowsVelocitiesWhateverThePositionsAre) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 100; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    const ArmLimits limits = test::randomLimits(random);
    const ArmVector start = test::randomInside(limits, random);
    ArmSupervisor supervisor(limits, start, Commanded::options(0.01));
    ArmRequest request;
    request.request = DriveRequest::kEnable;
    supervisor.command(request, start, {}, 0);
    request = {};
    request.moving = true;
    request.motion.velocity = speeds(limits, 0.0);
    request.motion.position = test::randomInside(limits, random);  // of a sender that knows another setpoint
    supervisor.command(request, start, {}, 1);
    EXPECT_EQ(supervisor.setpoint(), start);
  }
}

TEST(ArmSupervisor, CommandsTenTimesAsOftenAsAgreedMoveNoFartherThanAskedFor) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 200; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    const ArmLimits limits = test::randomLimits(random);
    const ArmVector start = test::randomInside(limits, random);
    Commanded commanded(limits, start, 0.1);
    const ArmVector v = speeds(limits, random.uniform(-0.1, 0.1));
    const int commands = 30, steps = 10;  // 100 Hz for 0.3 s
    for (int k = 0; k < commands; ++k) {
      commanded.command(v);
      for (int i = 0; i < steps; ++i)
        commanded.step();
    }
    commanded.command({});
    const double to_stand = commanded.stand();
    EXPECT_LE(to_stand, 0.1 + commanded.stopTime() + 2 * kStep);
    const double time = commands * steps * kStep + 0.1 + commanded.stopTime();
    for (Eigen::Index j = 0; j < v.size(); ++j)
      EXPECT_LE(std::abs(commanded.arm().reference()[j] - start[j]), std::abs(v[j]) * time * (1.0 + 1e-9) + 1e-12);
  }
}

TEST(ArmSupervisor, NoJointIsFasterThanAskedForAtAnyRateOfCommands) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 500; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    const ArmLimits limits = test::randomLimits(random);
    const double period = random.uniform(0.002, 0.1);
    Commanded commanded(limits, test::randomInside(limits, random), period);
    ArmVector largest = speeds(limits, 0.0);  // requested so far
    for (int k = 0; k < 60; ++k) {
      ArmVector v = speeds(limits, 0.5);
      for (Eigen::Index j = 0; j < v.size(); ++j)
        v[j] *= random.chance(0.2) ? 0.0 : random.uniform(-1.0, 1.0);
      // A carriage that its neighbour reaches is moved along, with the speed of that one.
      const auto tubes = v.size() / 2;
      const double fastest = v.head(tubes).cwiseAbs().maxCoeff();
      largest.head(tubes) = largest.head(tubes).cwiseMax(fastest);
      largest.tail(tubes) = largest.tail(tubes).cwiseMax(v.tail(tubes).cwiseAbs());
      commanded.command(v);
      const int steps = random.integer(0, static_cast<int>(1.5 * period / kStep) + 1);
      for (int i = 0; i < steps; ++i) {
        const ArmVector before = commanded.arm().reference();
        commanded.step();
        const ArmVector moved = (commanded.arm().reference() - before).cwiseAbs();
        for (Eigen::Index j = 0; j < v.size(); ++j)
          ASSERT_LE(moved[j], kStep * largest[j] * (1.0 + 1e-6) + 1e-12) << "joint " << j;
        ASSERT_LE(largestViolation(limits, commanded.arm().reference()), 1e-12);
      }
    }
    commanded.command({});
    const double to_stand = commanded.stand();
    ASSERT_LE(to_stand, period + commanded.stopTime() + 2 * kStep);
  }
}

TEST(ArmSupervisor, CommandsOncePerPeriodReachTheirTargets) {
  int moved = 0;
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 200; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    const ArmLimits limits = test::randomLimits(random);
    const ArmVector start = test::randomInside(limits, random);
    Commanded commanded(limits, start, 0.1);
    for (int k = 0; k < 10; ++k) {
      commanded.command(speeds(limits, random.uniform(-0.5, 0.5)));
      const ArmVector promised = commanded.arm().setpoint();
      for (int i = 0; i < 100; ++i)
        commanded.step();
      ASSERT_EQ(commanded.arm().reference(), promised);
    }
    moved += (commanded.arm().reference() - start).cwiseAbs().minCoeff() > 0.0 ? 1 : 0;
  }
  EXPECT_GT(moved, 100);
}

}  // namespace
}  // namespace tandem::safety
