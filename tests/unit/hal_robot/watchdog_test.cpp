// SPDX-License-Identifier: Apache-2.0
/** @file Stops that no command of control causes: the end of the HAL, and the stop topic in each state. */
#include "tests/unit/hal_robot/robot_fixture.h"

namespace tandem::hal::test {
namespace {

/// What a drive still receives from the HAL.
enum class Received { kNothing, kHeartbeats, kCommands };

struct End {
  const char* name;
  Received received;
  DriveMode mode;
  double budget;  ///< until the drive begins its stop, s
};

std::ostream& operator<<(std::ostream& out, const End& end) { return out << end.name; }

class EndOfTheHal : public testing::TestWithParam<End> {};

/// By the setup that the HAL writes: an RPDO deadline of half the heartbeat budget, and a watch on its heartbeat.
TEST_P(EndOfTheHal, DrivesThatMoveStopWithinTheirBudget) {
  const End& end = GetParam();
  System system(presetHardware(end.mode));
  ASSERT_TRUE(system.boot()) << system.story();
  ASSERT_TRUE(system.enable()) << system.story();
  system.move(0, speeds(4e-3, 0.3));
  system.run(0.5);
  const auto enabled = [&] {
    int count = 0;
    for (int j = 0; j < 6; ++j)
      count += system.drive(0, j).state() == sim::drives::DriveState::kEnabled ? 1 : 0;
    return count;
  };
  ASSERT_EQ(enabled(), 6);
  system.hal_alive = end.received != Received::kNothing;
  for (std::size_t b = 0; b < system.wires.size(); ++b) {
    const auto own = static_cast<std::uint32_t>(0x700 + system.config.buses[b].node_id);
    system.wires[b]->bus.disturbance = [received = end.received, own](const can::CanFrame& frame) {
      const bool command = frame.id > 0x200 && frame.id < 0x280;
      return !(received == Received::kHeartbeats && command) && !(received == Received::kCommands && frame.id == own);
    };
  }
  const ArmVector before = system.truth(0);
  // One period of commands and one heartbeat may have come just before, and one millisecond is that of the drives.
  EXPECT_TRUE(system.until(end.budget + 2.0 * system.config.period + 1e-3, [&] { return enabled() == 0; }))
      << enabled() << " drives still have torque";
  system.run(0.1);
  const ArmVector stopped = system.truth(0);
  EXPECT_LE((stopped - before).head(3).cwiseAbs().maxCoeff(), 4e-3 * (end.budget + 0.1));
  system.run(0.5);
  EXPECT_LE((system.truth(0) - stopped).cwiseAbs().maxCoeff(), 1e-6);
}

INSTANTIATE_TEST_SUITE_P(
    Losses,
    EndOfTheHal,
    testing::Values(End{"OfAllInPositionMode", Received::kNothing, DriveMode::kCyclicPosition, 0.05},
                    End{"OfAllInVelocityMode", Received::kNothing, DriveMode::kCyclicVelocity, 0.05},
                    End{"OfAllInProfileVelocityMode", Received::kNothing, DriveMode::kProfileVelocity, 0.05},
                    End{"OfCommandsInPositionMode", Received::kHeartbeats, DriveMode::kCyclicPosition, 0.05},
                    End{"OfCommandsInVelocityMode", Received::kHeartbeats, DriveMode::kCyclicVelocity, 0.05},
                    End{"OfCommandsInProfileVelocityMode", Received::kHeartbeats, DriveMode::kProfileVelocity, 0.05},
                    End{"OfHeartbeatsInPositionMode", Received::kCommands, DriveMode::kCyclicPosition, 0.1},
                    End{"OfHeartbeatsInVelocityMode", Received::kCommands, DriveMode::kCyclicVelocity, 0.1},
                    End{"OfHeartbeatsInProfileVelocityMode", Received::kCommands, DriveMode::kProfileVelocity, 0.1}),
    [](const auto& instance) { return instance.param.name; });

/// Frames of a node other than its heartbeats go on.
TEST(HardwareWatchdogs, ANodeWithoutHeartbeatsIsNoticedWithinItsBudget) {
  System system;
  ASSERT_TRUE(system.boot());
  ASSERT_TRUE(system.enable());
  constexpr std::uint32_t kHeartbeat = 0x702;
  system.wires[0]->bus.disturbance = [](const can::CanFrame& frame) { return frame.id != kHeartbeat; };
  const double budget = std::max(2.5 * system.config.node_heartbeat, safety::Budgets{}.drive_heartbeat);
  EXPECT_TRUE(system.until(budget + system.config.node_heartbeat, [&] {
    return system.robot->state(0) == OperatingState::kFault;
  })) << system.story();
}

TEST(HardwareWatchdogs, LostCommandsStopArmsThatHavePower) {
  System system;
  ASSERT_TRUE(system.boot());
  ASSERT_TRUE(system.enable());
  const auto send = [&](int lost_of_ten) {
    for (int k = 0; k < 400 && system.all(OperatingState::kEnabled); ++k) {
      system.command.header.stamp = system.now;
      system.sequence += k % 10 < lost_of_ten ? 1 : 0;  // a number is left out
      ++system.command.header.arrivals;
      system.send();
      system.run(0.02);
    }
  };
  system.commanding = false;
  send(0);
  EXPECT_TRUE(system.all(OperatingState::kEnabled));
  send(5);
  EXPECT_TRUE(system.all(OperatingState::kFault));
  EXPECT_EQ(system.robot->faultRecord(0).cause, safety::FaultCause::kLost);
}

TEST(HardwareWatchdogs, ANewSessionFindsNoPower) {
  System system;
  ASSERT_TRUE(system.boot());
  ASSERT_TRUE(system.enable());
  system.run(0.5);
  system.commanding = false;
  system.send();
  system.command.header.session = 8;
  system.command.header.sequence = 1;
  EXPECT_TRUE(system.robot->command(system.command, system.now));
  EXPECT_TRUE(system.all(OperatingState::kDisabled));
  EXPECT_TRUE(system.until(1.0, [&] { return system.robot->off(); }));
}

/// It receives no command to switch on: the others have torque, and lose it again.
TEST(HardwareWatchdogs, ADriveThatDoesNotSwitchOnEndsTheAttempt) {
  System system;
  ASSERT_TRUE(system.boot());
  system.wires[0]->bus.disturbance = [](can::CanFrame& frame) {
    constexpr std::uint8_t kShutdown = 0x06;
    if (frame.id == 0x202)
      frame.data[0] = kShutdown;
    return true;
  };
  system.request(DriveRequest::kEnable);
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->arm(0).power() == ArmPower::kSwitchingOn; }));
  EXPECT_TRUE(system.until(3.0 * system.config.transition_budget, [&] {
    return system.robot->state(0) == OperatingState::kFault;
  })) << system.story();
  system.request(DriveRequest::kKeep);
  EXPECT_TRUE(system.until(1.5, [&] { return system.robot->arm(0).power() == ArmPower::kOff; }));
  EXPECT_EQ(system.robot->faultRecord(0).joint, 1);
}

struct Situation {
  const char* name;
  /// Leads there from booted drives. @return whether it did
  bool (*enter)(System& system);
  bool homing = false;
  bool dead_drive = false;  ///< of arm 1, which cannot be DISABLED then
};

std::ostream& operator<<(std::ostream& out, const Situation& situation) { return out << situation.name; }

class StopTopic : public testing::TestWithParam<Situation> {};

TEST_P(StopTopic, StopsLatchesAndIsClearedByDisable) {
  const Situation& situation = GetParam();
  System system(situation.homing ? homingHardware() : presetHardware());
  system.robot->start(system.now);
  const auto booted = [&] {
    for (int a = 0; a < 2; ++a) {
      for (int j = 0; j < 6; ++j) {
        const AxisPhase phase = system.robot->arm(a).axis(j).phase();
        if (phase != AxisPhase::kReady && phase != AxisPhase::kUnhomed)
          return false;
      }
    }
    return true;
  };
  ASSERT_TRUE(system.until(5.0, booted)) << system.story();
  ASSERT_TRUE(situation.enter(system)) << system.story();
  system.robot->stop();
  const auto motors = [&] {
    ArmVector q(6);
    for (int j = 0; j < 6; ++j)
      q[j] = AxisUnits(system.robot->arm(0).axis(j).config().gearing).scale() * system.drive(0, j).motor().position();
    return q;
  };
  const ArmVector at_stop = motors();
  EXPECT_TRUE(system.all(OperatingState::kFault));
  EXPECT_TRUE(system.until(1.0, [&] { return system.robot->off(); }));
  EXPECT_LE((motors() - at_stop).head(3).cwiseAbs().maxCoeff(), 1e-3);
  const ArmVector stopped = motors();
  system.run(0.5);
  EXPECT_LE((motors() - stopped).cwiseAbs().maxCoeff(), 1e-4) << "the request that led there goes on";
  EXPECT_TRUE(system.all(OperatingState::kFault));
  EXPECT_NE(system.robot->faults(0) & safety::bit(Fault::kStopRequested), 0u);
  system.hold();
  system.request(DriveRequest::kDisable);
  EXPECT_TRUE(system.until(8.0, [&] {
    return situation.dead_drive ? system.robot->state(1) == OperatingState::kDisabled
                                : system.all(OperatingState::kDisabled);
  }));
}

bool enableAndMove(System& system) {
  const bool enabled = system.enable();
  system.move(0, speeds(4e-3, 0.3));
  system.run(0.3);
  return enabled;
}

bool keepHoming(System& system, double seconds) {
  return !system.until(seconds, [&] {
    system.robot->home(0, system.now);
    return !system.robot->arm(0).homing();
  });
}

INSTANTIATE_TEST_SUITE_P(
    In,
    StopTopic,
    testing::Values(Situation{"Disabled", [](System&) { return true; }},
                    Situation{"Motion", enableAndMove},
                    Situation{"Rest", [](System& system) { return system.enable(); }},
                    Situation{"Pause",
                              [](System& system) {
                                const bool moves = enableAndMove(system);
                                system.request(DriveRequest::kPause);
                                return moves && system.until(0.5, [&] {
                                  return system.robot->state(0) == OperatingState::kPaused;
                                });
                              }},
                    Situation{"TheRampOfAPause",
                              [](System& system) {
                                const bool moves = enableAndMove(system);
                                system.request(DriveRequest::kPause);
                                return moves && system.until(0.5, [&] {
                                  return system.robot->state(0) == OperatingState::kPaused &&
                                         !system.robot->arm(0).standing();
                                });
                              }},
                    Situation{"SwitchingOn",
                              [](System& system) {
                                system.request(DriveRequest::kEnable);
                                return system.until(
                                    1.0, [&] { return system.robot->arm(0).power() == ArmPower::kSwitchingOn; });
                              }},
                    Situation{"Homing", [](System& system) { return keepHoming(system, 1.0); }, true},
                    Situation{"Recovery",
                              [](System& system) {
                                const bool moves = enableAndMove(system);
                                system.hold();
                                const bool failed = system.inject(0, FaultKind::kOff, 2) && system.until(1.0, [&] {
                                  return system.robot->state(0) == OperatingState::kFault &&
                                         system.robot->arm(0).power() == ArmPower::kOff;
                                });
                                system.request(DriveRequest::kRecover);
                                const bool recovers = system.until(3.0, [&] { return system.robot->recovering(0); });
                                system.request(DriveRequest::kKeep);
                                return moves && failed && recovers;
                              },
                              false, true}),
    [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace tandem::hal::test
