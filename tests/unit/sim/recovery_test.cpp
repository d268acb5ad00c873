// SPDX-License-Identifier: Apache-2.0
/** @file Runaway joints and random sequences of requests: no jump, also after recovery. */
#include "safety/recovery.h"

#include "drives_fixture.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::test {
namespace {

using sim::AxisFault;

class Overspeed : public DrivesFixture {};

TEST_F(Overspeed, ARunawayStopsWithinATickOfBeingMeasured) {
  for (const int joint : {1, 2}) {
    bringToSpeed();
    const double before = drives.plant(0).position()[joint];
    ASSERT_TRUE(drives.inject(0, joint, AxisFault::kRunaway));
    run(3 * kTick);
    EXPECT_EQ(drives.faults(0), bit(Fault::kDrive));
    EXPECT_EQ(drives.faultRecord(0).cause, safety::FaultCause::kOverspeed);
    EXPECT_EQ(drives.faultRecord(0).joint, joint);
    run(kStopTime);
    const double fastest = 2.0 * fixtureLimits().joints[static_cast<std::size_t>(joint)].velocity;
    EXPECT_LE(std::abs(drives.plant(0).position()[joint] - before), 3 * kTick * fastest);
    EXPECT_TRUE(drives.standing(0));
    EXPECT_FALSE(drives.standing(1)) << "the other arm goes on";
    drives.inject(0, joint, AxisFault::kNone);
    request(DriveRequest::kDisable);
    timeToStand(kStopTime);
  }
}

/** Random sequences of enable or recover, jog, fault, stop and disable for two arms. */
class RandomRequestSequences : public DrivesFixture {
 public:
  void sequence(Random& random) {
    // Excludes a joint that comes loose: it moves to its reference, within the window of the following error.
    constexpr AxisFault kFaults[] = {AxisFault::kOff, AxisFault::kGarbage, AxisFault::kInvalid};
    give(random.chance(0.4) ? DriveRequest::kRecover : DriveRequest::kEnable,
         random.chance(0.3) ? safety::jointBit(random.integer(0, 3)) : safety::JointMask{0});
    jog(random, random.integer(0, 3));
    const int joint = random.integer(0, 3);
    if (random.chance(0.6))
      drives.inject(0, joint, kFaults[random.integer(0, 2)]);
    jog(random, random.integer(0, 2));
    if (random.chance(0.2))
      drives.stop();
    if (random.chance(0.2))
      live(0.45);  // control stops sending
    if (random.chance(0.7))
      drives.inject(0, joint, AxisFault::kNone);
    give(random.chance(0.2) ? DriveRequest::kRecover : DriveRequest::kDisable, 0);
    live(random.uniform(0.0, 0.2));
    drives.inject(0, joint, AxisFault::kNone);
    if (random.chance(0.7))
      give(DriveRequest::kDisable, 0);
    live(random.uniform(0.0, 0.2));
  }
  void give(DriveRequest what, safety::JointMask without) {
    sim::Command command = nextCommand();
    command.request[0] = command.request[1] = what;
    command.without[0] = without;
    drives.command(command, now);
    live(0.01);
  }
  void jog(Random& random, int periods) {
    for (int i = 0; i < periods; ++i) {
      ArmVector v(4);
      for (int j = 0; j < 4; ++j)
        v[j] = random.uniform(-1.0, 1.0) * fixtureLimits().joints[static_cast<std::size_t>(j)].velocity;
      move(v);
      live(random.uniform(0.02, 0.12));
    }
  }
  /// Ticks, with measurements at each.
  void live(double seconds) {
    for (double t = 0.0; t < seconds; t += kTick) {
      tick();
      const ArmVector now_at = drives.plant(0).position();
      for (int j = 0; j < 4; ++j) {
        const double allowed = fixture_limits.joints[static_cast<std::size_t>(j)].velocity * kTick;
        worst = std::max(worst, std::abs(now_at[j] - before[j]) / allowed);
        if (drives.recovering(0) && drives.plant(0).fault(j) == AxisFault::kNone) {
          const double slow = safety::recoveryVelocity(fixture_limits, drives.lost(0), j) * kTick;
          slowest = std::max(slowest, std::abs(now_at[j] - before[j]) - slow);
        }
      }
      violation = std::max(violation, safety::largestViolation(fixture_limits, now_at));
      before = now_at;
    }
  }

  ArmLimits fixture_limits = fixtureLimits();
  ArmVector before = fixtureStart();
  double worst = 0.0;       ///< largest step of a tick, as a fraction of the permitted one
  double slowest = -1.0;    ///< excess of the step of an arm in recovery over the permitted one in a tick, m or rad
  double violation = -1.0;  ///< of the limits, m or rad
};

TEST_F(RandomRequestSequences, NeverJump) {
  Random random(baseSeed());
  SCOPED_TRACE(trace(baseSeed()));
  for (std::uint32_t i = 0; i < cases(10'000); ++i)
    sequence(random);
  EXPECT_LE(worst, 1.0 + 1e-5) << "of one period's travel";
  EXPECT_LE(slowest, 1e-6) << "while it was recovered";
  EXPECT_LE(violation, 0.5e-3) << "beyond the following error";
}

}  // namespace
}  // namespace tandem::test
