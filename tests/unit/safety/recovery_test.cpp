// SPDX-License-Identifier: Apache-2.0
/** @file Arms that cannot be enabled: refused with the violation, moved back slowly, withdrawn with the remaining
 * joints. */
#include "safety/recovery.h"

#include <gtest/gtest.h>

#include "safety/arm_supervisor.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::safety {
namespace {

using test::Random;

constexpr double kBusTick = 1e-3;  // s
constexpr double kControl = 0.01;  // of control, s

JointMask randomLost(int joints, Random& random) {
  JointMask lost = 0;
  for (int j = 0; j < joints; ++j)
    lost |= random.chance(0.25) ? jointBit(j) : JointMask{0};
  return lost;
}

/** Least position of every translation with the lost ones fixed: each is raised from the end of its stage until no
 * row forbids it. Rows contain two translations with coefficients 1 and -1. */
ArmVector leastExtension(const ArmLimits& limits, const ArmVector& q, JointMask lost) {
  const int n = limits.jointCount() / 2;
  ArmVector x = q;
  for (int j = 0; j < n; ++j)
    x[j] = (lost & jointBit(j)) != 0 ? q[j] : limits.joints[static_cast<std::size_t>(j)].lower;
  for (int pass = 0; pass < 2 * n; ++pass) {
    for (const LinearRow& row : limits.rows) {
      for (int j = 0; j < n; ++j) {
        if (row.a[j] >= 0.0 || (lost & jointBit(j)) != 0)
          continue;
        const double others = rowValue(row, x) - row.a[j] * x[j];
        x[j] = std::max(x[j], (row.b - others) / row.a[j]);
      }
    }
  }
  return x;
}

TEST(Withdrawal, EndsAtTheLeastExtensionThatTheLostJointsLeave) {
  for (std::uint32_t run = 0; run < test::cases(400); ++run) {
    SCOPED_TRACE(test::trace(test::baseSeed() + run));
    Random random(test::baseSeed() + run);
    const ArmLimits limits = test::randomLimits(random);
    const ArmVector start = test::randomInside(limits, random);
    const JointMask lost = randomLost(limits.jointCount(), random);
    const double step = random.uniform(5e-5, 3e-3);
    ArmVector q = start;
    int steps = 0;
    for (; steps < 20'000; ++steps) {
      const Withdrawal next = nextWithdrawal(limits, q, lost, step);
      if (next.joints == 0)
        break;
      ASSERT_GT(next.distance, 0.0);
      ASSERT_LE(next.distance, step);
      ASSERT_EQ(next.joints & lost, 0);
      for (int j = 0; j < limits.jointCount(); ++j) {
        if ((next.joints & jointBit(j)) == 0)
          continue;
        ASSERT_TRUE(limits.isTranslation(j)) << "a rotation";
        q[j] -= next.distance;
      }
      ASSERT_LE(largestViolation(limits, q), 1e-12);
    }
    const ArmVector least = leastExtension(limits, start, lost);
    ASSERT_LE((q - least).cwiseAbs().maxCoeff(), limits.jointCount() * kPositionTolerance) << steps << " steps";
  }
}

TEST(Withdrawal, TheInnermostTubeGoesFirstAndAlone) {
  TubeLimitSpec spec;
  spec.tube_length = {0.4, 0.3, 0.2};
  spec.carriage_spacing = {0.005, 0.005};
  spec.minimum_extension = {0.005, 0.005};
  spec.stage_minimum = {-0.4, -0.3, -0.2};
  spec.stage_maximum = {0.0, 0.0, 0.0};
  const ArmLimits limits = makeTubeLimits(spec);
  ArmVector q(6);
  q << -0.15, -0.1, -0.05, 0.0, 0.0, 0.0;
  EXPECT_EQ(nextWithdrawal(limits, q, 0, 1e-3).joints, jointBit(0));
  q[0] = -0.4 + 0.2 + 0.005;  // its end is that of tube 2, so both move
  EXPECT_EQ(nextWithdrawal(limits, q, 0, 1e-3).joints, jointBit(0) | jointBit(1));
  EXPECT_EQ(nextWithdrawal(limits, q, jointBit(1), 1e-3).joints, jointBit(2)) << "tube 2 holds tube 1";
}

/** A supervisor with a command source. */
struct Commanded {
  Commanded(const ArmLimits& limits, const ArmVector& start)
      : supervisor(limits, start, SupervisorOptions{kControl, {}, false}), speed(ArmVector::Zero(start.size())) {}

  void send(DriveRequest what, JointMask lost = 0) {
    ArmRequest request;
    request.request = what;
    request.lost = lost;
    request.moving = !speed.isZero();
    request.motion.velocity = speed;
    request.motion.position = supervisor.setpoint();
    supervisor.noteRecoverRequest(what == DriveRequest::kRecover);
    supervisor.command(request, supervisor.reference(), {}, now);
  }
  /// One control period; `each` after every tick.
  template <class Each>
  void period(Each&& each) {
    send(DriveRequest::kKeep);
    for (int i = 0; i < 10; ++i) {
      now += 1'000'000;
      supervisor.step(kBusTick, now);
      each();
    }
  }

  ArmSupervisor supervisor;
  ArmVector speed;
  std::int64_t now = 1'000'000'000;
};

TEST(Recovery, OutsideItsLimitsAnArmIsRefusedAndComesBackSlowlyAndInwardsAlone) {
  for (std::uint32_t run = 0; run < test::cases(200); ++run) {
    SCOPED_TRACE(test::trace(test::baseSeed() + run));
    Random random(test::baseSeed() + run);
    const ArmLimits limits = test::randomLimits(random);
    const int n = limits.jointCount();
    ArmVector q = test::randomInside(limits, random);
    const int outside = random.integer(0, n / 2 - 1);
    q[outside] = limits.joints[static_cast<std::size_t>(outside)].lower - random.uniform(2e-4, 5e-3);
    Commanded arm(limits, q);
    arm.send(DriveRequest::kEnable);
    ASSERT_EQ(arm.supervisor.state(), OperatingState::kFault);
    const LimitViolation worst = worstLimitViolation(limits, q);
    EXPECT_EQ(arm.supervisor.faultRecord().cause, FaultCause::kOutsideLimits);
    EXPECT_EQ(arm.supervisor.faultRecord().joint, worst.joint);
    EXPECT_NEAR(arm.supervisor.faultRecord().amount, worst.amount, 1e-12);

    const JointMask lost = randomLost(n, random);
    arm.send(DriveRequest::kRecover, lost);
    ASSERT_TRUE(arm.supervisor.recovering());
    EXPECT_EQ(arm.supervisor.lost(), lost);
    EXPECT_EQ(arm.supervisor.faults(), 0u);
    ArmVector before = arm.supervisor.reference();
    double violation = largestViolation(limits, before);
    for (int i = 0; i < 60; ++i) {
      for (int j = 0; j < n; ++j)
        arm.speed[j] = random.uniform(-1.0, 1.0) * limits.joints[static_cast<std::size_t>(j)].velocity;
      arm.period([&] {
        const ArmVector now = arm.supervisor.reference();
        for (int j = 0; j < n; ++j)
          ASSERT_LE(std::abs(now[j] - before[j]), kBusTick * recoveryVelocity(limits, lost, j) * (1.0 + 1e-6) + 1e-15)
              << j;
        ASSERT_LE(largestViolation(limits, now), std::max(violation, 0.0) + 1e-12) << "farther out";
        violation = largestViolation(limits, now);
        before = now;
      });
    }
    // Straight inwards at full speed, with all joints.
    arm.send(DriveRequest::kDisable);
    arm.speed.setZero();
    for (int i = 0; i < 10; ++i)
      arm.period([] {});
    arm.send(DriveRequest::kRecover);
    arm.speed[outside] = limits.joints[static_cast<std::size_t>(outside)].velocity;
    for (int i = 0; i < 2000 && largestViolation(limits, arm.supervisor.reference()) > 0.0; ++i)
      arm.period([] {});
    EXPECT_LE(arm.supervisor.reference()[outside] * -1.0,
              -limits.joints[static_cast<std::size_t>(outside)].lower + 1e-9);
    if (largestViolation(limits, arm.supervisor.reference()) > kPositionTolerance)
      continue;  // blocked by a neighbour
    arm.speed.setZero();
    arm.send(DriveRequest::kDisable);
    for (int i = 0; i < 10; ++i)
      arm.period([] {});
    arm.send(DriveRequest::kEnable);
    EXPECT_EQ(arm.supervisor.state(), OperatingState::kEnabled);
    EXPECT_FALSE(arm.supervisor.recovering());
  }
}

TEST(Recovery, IsForStandingArmsWithoutPowerAlone) {
  Random random(test::baseSeed());
  const ArmLimits limits = test::randomLimits(random);
  Commanded arm(limits, test::randomInside(limits, random));
  arm.send(DriveRequest::kEnable);
  arm.send(DriveRequest::kRecover, jointBit(0));
  EXPECT_EQ(arm.supervisor.state(), OperatingState::kEnabled);
  EXPECT_FALSE(arm.supervisor.recovering());
  arm.supervisor.latch({bit(Fault::kDrive)});
  arm.send(DriveRequest::kKeep);
  arm.send(DriveRequest::kRecover, jointBit(0));
  EXPECT_TRUE(arm.supervisor.recovering());
  // Causes that stop other arms stop this one, too, and no repetition of the granted request clears it.
  arm.supervisor.latch({bit(Fault::kStopRequested)});
  for (int i = 0; i < 3; ++i) {
    arm.send(DriveRequest::kRecover, jointBit(0));
    EXPECT_EQ(arm.supervisor.state(), OperatingState::kFault);
  }
  EXPECT_FALSE(arm.supervisor.recovering());
  EXPECT_EQ(arm.supervisor.lost(), 0);
}

}  // namespace
}  // namespace tandem::safety
