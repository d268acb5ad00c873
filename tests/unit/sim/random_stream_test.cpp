// SPDX-License-Identifier: Apache-2.0
/** @file Random streams of valid and invalid commands with random faults: invariants. */
#include <gtest/gtest.h>

#include <cmath>

#include "sim/simulated_drives.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::test {
namespace {

using safety::ArmVector;
using safety::DriveRequest;
using safety::OperatingState;

constexpr double kStreamPeriod = 0.05;
constexpr double kStreamTick = 5e-3;
constexpr double kWindow = 0.5e-3;  ///< following error of a translation, m

/** Two random arms with a command source that is often faulty. */
class Stream {
 public:
  /// @param acceleration of the translations of the plant, m/s^2
  explicit Stream(std::uint32_t seed, double acceleration = safety::kUnlimited)
      : random_(seed),
        acceleration_(acceleration),
        limits_{randomLimits(random_), randomLimits(random_)},
        drives_(limits_, starts(), options()) {
    for (std::size_t a = 0; a < 2; ++a) {
      for (const safety::JointLimit& joint : limits_[a].joints) {
        stop_time_[a] = std::max(stop_time_[a], joint.velocity / joint.stop_deceleration);
      }
    }
  }

  void run() {
    for (int cycle = 0; cycle < 60 && !::testing::Test::HasFatalFailure(); ++cycle) {
      disturb();
      if (!random_.chance(0.1))
        command();
      for (int i = 0; i < 10 && !::testing::Test::HasFatalFailure(); ++i)
        tick();
    }
  }
  int moves() const { return moves_; }

 private:
  sim::SimulatedDrivesOptions options() const {
    sim::SimulatedDrivesOptions made;
    made.control_period = kStreamPeriod;
    made.following_error_translation = kWindow + largestLag();
    made.translation_acceleration = acceleration_;
    return made;
  }
  /// Greatest lag of a translation when its reference reverses at full speed, m.
  double largestLag() const {
    double speed = 0.0;
    for (const safety::ArmLimits& limits : limits_)
      speed = std::max(speed, limits.joints[0].velocity);
    return 2.0 * speed * speed / acceleration_ + (std::isfinite(acceleration_) ? speed * kStreamTick : 0.0);
  }
  std::vector<ArmVector> starts() { return {randomInside(limits_[0], random_), randomInside(limits_[1], random_)}; }

  void disturb() {
    if (random_.chance(0.02))
      drives_.stop();
    if (random_.chance(0.05)) {
      const int arm = random_.integer(0, 1);
      const int joint = random_.integer(0, drives_.jointCount(arm) - 1);
      const auto fault = static_cast<sim::AxisFault>(random_.integer(0, 4));
      drives_.inject(arm, joint, fault);
      jammed_[arm] = jammed_[arm] || fault == sim::AxisFault::kStuck;
    }
    if (random_.chance(0.2)) {
      for (int arm = 0; arm < 2; ++arm) {
        for (int joint = 0; joint < drives_.jointCount(arm); ++joint)
          drives_.inject(arm, joint, sim::AxisFault::kNone);
      }
    }
    if (random_.chance(0.03))
      session_ = static_cast<std::uint64_t>(random_.integer(1, 3));
  }

  void command() {
    sim::Command command;
    command.header = {session_, ++sequence_, random_.chance(0.02) ? 1.0 : 0.01, random_.chance(0.01) ? 1 : 2};
    if (random_.chance(0.02))
      command.header.sequence -= 5;
    for (int arm = 0; arm < 2; ++arm) {
      const ArmVector wanted = randomWild(limits_[static_cast<std::size_t>(arm)], drives_.setpoint(arm), random_);
      command.moving[arm] = !random_.chance(0.15);
      for (int j = 0; j < drives_.jointCount(arm); ++j) {
        const auto i = static_cast<std::size_t>(arm) * safety::kMaxJointsPerArm + static_cast<std::size_t>(j);
        command.velocity[i] =
            random_.chance(0.001) ? std::nan("") : (wanted[j] - drives_.setpoint(arm)[j]) / kStreamPeriod;
        // The position assumed by the command source has no effect, provided that it is a number.
        command.position[i] = random_.chance(0.001) ? std::nan("") : wanted[j] + random_.uniform(-0.01, 0.01);
      }
      if (drives_.state(arm) == OperatingState::kFault && random_.chance(0.5)) {
        command.request[arm] = DriveRequest::kDisable;
      } else if (drives_.state(arm) == OperatingState::kDisabled && random_.chance(0.7)) {
        command.request[arm] = DriveRequest::kEnable;
      } else if (random_.chance(0.1)) {
        command.request[arm] = static_cast<DriveRequest>(random_.integer(0, 4));
      }
    }
    drives_.command(command, now_);
  }

  void tick() {
    const ArmVector before[2] = {drives_.plant(0).position(), drives_.plant(1).position()};
    now_ += static_cast<std::int64_t>(kStreamTick * 1e9);
    drives_.step(kStreamTick, now_);
    for (int arm = 0; arm < 2; ++arm)
      check(arm, before[arm]);
  }

  void check(int arm, const ArmVector& before) {
    const auto a = static_cast<std::size_t>(arm);
    const ArmVector& q = drives_.plant(arm).position();
    // The drives know the position of a stuck axis only within the following error, and two of them close one gap.
    const double allowed = jammed_[arm] ? 2.0 * (kWindow + largestLag() + limits_[a].joints[0].velocity * kStreamTick)
                                        : 1e-9 + 2.0 * largestLag();
    ASSERT_LE(safety::largestViolation(limits_[a], q), allowed) << "arm " << arm;
    moves_ += q != before ? 1 : 0;
    const bool may_move = drives_.state(arm) == OperatingState::kEnabled;
    still_for_[arm] = may_move ? 0.0 : still_for_[arm] + kStreamTick;
    if (still_for_[arm] > stop_time_[a] + 2.0 * limits_[a].joints[0].velocity / acceleration_ + 2.5 * kStreamTick) {
      // An axis that comes loose moves to its reference, which is within the window.
      ASSERT_LE((q - before).head(drives_.jointCount(arm) / 2).cwiseAbs().maxCoeff(), jammed_[arm] ? kWindow : 0.0);
      if (!jammed_[arm]) {
        ASSERT_EQ(q, before) << "arm " << arm;
      }
    }
    for (int j = 0; j < drives_.jointCount(arm); ++j) {
      ASSERT_LE(std::abs(q[j] - before[j]), limits_[a].joints[j].velocity * kStreamTick * (1 + 1e-5));
    }
  }

  Random random_;
  double acceleration_;
  std::vector<safety::ArmLimits> limits_;
  sim::SimulatedDrives drives_;
  std::array<double, 2> stop_time_{};
  std::array<double, 2> still_for_{};
  std::array<bool, 2> jammed_{};
  std::uint64_t session_ = 1;
  std::uint64_t sequence_ = 10;
  std::int64_t now_ = 1'000'000'000;
  int moves_ = 0;
};

TEST(RandomStreams, StayInsideTheLimitsAndStandWhereTheyMayNotMove) {
  int moves = 0;
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 1000; ++seed) {
    SCOPED_TRACE(trace(seed));
    Stream stream(seed);
    stream.run();
    moves += stream.moves();
    if (HasFatalFailure())
      return;
  }
  EXPECT_GT(moves, 50000) << "arms that never move prove nothing";
}

TEST(RandomStreams, LagOfTheJointsIsAllThatAccelerationsAdd) {
  for (std::uint32_t seed = baseSeed(); seed < baseSeed() + 300; ++seed) {
    SCOPED_TRACE(trace(seed));
    Stream stream(seed, 0.5);
    stream.run();
    if (HasFatalFailure())
      return;
    ASSERT_GT(stream.moves(), 0);
  }
}

}  // namespace
}  // namespace tandem::test
