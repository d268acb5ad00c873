// SPDX-License-Identifier: Apache-2.0
/** @file Two masters on one bus: the second refuses to start, or stops the arms if it starts anyway. */
#include <random>

#include "hal/canopen/cob.h"
#include "robot_fixture.h"
#include "tests/unit/safety/allocation_counter.h"
#include "tests/unit/safety/random_arm.h"

namespace tandem::hal::test::foreign_master {
namespace {

using canopen::MasterFrame;

/// SYNC period of the hardware and its drives, and the silence after which this fixture's HAL considers another master
/// gone.
constexpr std::int64_t kPeriod = 4 * kMillisecond;
constexpr double kListening = 0.5;
/// Periods after the frame: the cycle that reads it latches.
constexpr int kBudgetPeriods = 1;

RobotOptions robotOptions() {
  RobotOptions options;
  options.control_period = System::kControlPeriod;
  return options;
}

/** A foreign master on each bus of a system. */
struct Others {
  explicit Others(System& system) {
    for (auto& wire : system.wires)
      ports.push_back(&wire->bus.join("other"));
  }
  void send(int bus, const can::CanFrame& frame) { ports[static_cast<std::size_t>(bus)]->send({&frame, 1}); }
  /// Discards their received frames.
  void drain() {
    std::array<can::CanFrame, 64> frames;
    for (can::VirtualBus::Port* port : ports) {
      while (port->receive(frames) == frames.size()) {
      }
    }
  }
  std::vector<std::unique_ptr<Fieldbus>> buses(const HardwareConfig& hardware) const {
    return canopenBuses(hardware, {ports.begin(), ports.end()}, robotOptions().budgets);
  }
  std::uint64_t sent() const {
    std::uint64_t all = 0;
    for (const can::VirtualBus::Port* port : ports)
      all += port->counters().sent;
    return all;
  }
  std::vector<can::VirtualBus::Port*> ports;
};

bool received(const RobotHardware& robot) {
  for (int b = 0; b < robot.busCount(); ++b) {
    if (networkOf(robot, b).masters().receivedAny())
      return true;
  }
  return false;
}

/// The system continues while another HAL listens for its listening time.
void listen(System& system, RobotHardware& second) {
  const std::int64_t end = system.now + static_cast<std::int64_t>(1e9 * second.listeningTime());
  while (system.now < end) {
    system.period();
    second.listen(system.now);
  }
}

TEST(ForeignMaster, ListeningTimeIsThreeHeartbeatBudgetsWithinBounds) {
  EXPECT_DOUBLE_EQ(canopen::listeningTime(0.1), kListening);
  EXPECT_DOUBLE_EQ(canopen::listeningTime(0.02), 0.5);
  EXPECT_DOUBLE_EQ(canopen::listeningTime(0.6), 1.8);
  EXPECT_DOUBLE_EQ(canopen::listeningTime(3.0), 2.0);
}

TEST(ForeignMaster, SecondHalDetectsTheFirstAndSendsNothing) {
  System system;
  ASSERT_TRUE(system.boot());
  ASSERT_TRUE(system.enable());
  system.move(0, speeds(4e-3, 0.3));
  system.move(1, speeds(1e-3, 0.1));
  system.run(0.3);
  Others others(system);
  RobotHardware second(system.config, others.buses(system.config), robotOptions());
  listen(system, second);
  for (int b = 0; b < 2; ++b) {
    const canopen::MasterWatch& masters = networkOf(second, b).masters();
    EXPECT_GE(masters.received(MasterFrame::kSync).count, 120u);
    EXPECT_GE(masters.received(MasterFrame::kHeartbeat).count, 15u);
    EXPECT_GE(masters.received(MasterFrame::kCommandPdo).count, 6 * 120u);
    EXPECT_NE(masters.describe().find("SYNC (12"), std::string::npos) << masters.describe();
  }
  EXPECT_EQ(others.sent(), 0u);
  EXPECT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
  EXPECT_FALSE(received(*system.robot));
}

TEST(ForeignMaster, FramesOfOtherDevicesDoNotEndTheListening) {
  // Heartbeats, emergencies and PDOs of drives without a master do not indicate one; nor does an unknown node.
  System system;
  ASSERT_TRUE(system.boot());
  system.hal_alive = false;
  system.run(0.5);
  Others others(system);
  RobotHardware second(system.config, others.buses(system.config), robotOptions());
  std::vector<can::VirtualBus::Port*> strangers;
  for (auto& wire : system.wires)
    strangers.push_back(&wire->bus.join("stranger"));
  ASSERT_TRUE(system.inject(0, FaultKind::kOverCurrent, 2));
  const auto talk = [&](const can::CanFrame& frame) { strangers[0]->send({&frame, 1}); };
  talk(canopen::heartbeatFrame(99, canopen::NmtState::kOperational));
  talk(can::makeFrame(canopen::cob::kSdoRequest + 99, std::array<std::uint8_t, 8>{0x40}));
  talk(can::makeFrame(canopen::cob::kTime, std::array<std::uint8_t, 6>{}));
  listen(system, second);
  EXPECT_FALSE(received(second)) << networkOf(second, 0).masters().describe();
  EXPECT_GT(networkOf(second, 0).counters().received, 0u);
  // Every frame that only a master sends is detected, with a single one.
  talk(can::makeFrame(canopen::cob::kSdoRequest + 3, std::array<std::uint8_t, 8>{0x40}));
  second.listen(system.now);
  EXPECT_EQ(networkOf(second, 0).masters().describe(), "SDO request (once)");
  EXPECT_FALSE(networkOf(second, 0).masters().commands(system.now));
}

/** Frame of a foreign master on the first arm's bus. */
struct Case {
  const char* name;
  MasterFrame kind;
  can::CanFrame frame;
  bool takes_drives = false;  ///< it stops or resets drives
};

// NOLINTNEXTLINE(readability-identifier-naming): a name of GoogleTest
void PrintTo(const Case& foreign, std::ostream* out) { *out << foreign.name; }

const Case kCases[] = {
    {"Sync", MasterFrame::kSync, canopen::syncFrame(0)},
    {"Heartbeat", MasterFrame::kHeartbeat, canopen::heartbeatFrame(127, canopen::NmtState::kOperational)},
    {"NmtReset", MasterFrame::kNmt, canopen::nmtFrame(canopen::NmtCommand::kResetNode, 0), true},
    {"NmtStop", MasterFrame::kNmt, canopen::nmtFrame(canopen::NmtCommand::kStop, 2), true},
    {"NmtForNobody", MasterFrame::kNmt, canopen::nmtFrame(canopen::NmtCommand::kStart, 99)},
    {"CommandPdo", MasterFrame::kCommandPdo, can::makeFrame(canopen::cob::rpdo(1, 2), std::array<std::uint8_t, 6>{})},
};

class Foreign : public testing::TestWithParam<Case> {};

TEST_P(Foreign, OneFrameOnABusStopsItsArmsAndClearsAfterTheSilence) {
  const std::uint32_t seed = tandem::test::baseSeed();
  SCOPED_TRACE(tandem::test::trace(seed));
  std::mt19937 random(seed);
  for (int run = 0; run < 3; ++run) {
    System system;
    Others others(system);
    ASSERT_TRUE(system.boot()) << system.story();
    ASSERT_TRUE(system.enable()) << system.story();
    system.move(0, speeds(4e-3, 0.3));
    system.move(1, speeds(1e-3, 0.1));
    system.run(std::uniform_real_distribution<double>(0.3, 0.6)(random));
    ASSERT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
    system.events.clear();
    others.drain();
    const ArmVector before = system.truth(0);
    const std::int64_t begin = system.now;
    int quick_stops = 0;
    system.after_period = [&] {
      for (int j = 0; j < 6; ++j)
        quick_stops += system.drive(0, j).state() == sim::drives::DriveState::kQuickStop;
    };
    others.send(0, GetParam().frame);

    ASSERT_TRUE(system.until(1.0, [&] { return system.robot->state(0) == OperatingState::kFault; }));
    EXPECT_LE(system.now - begin, kBudgetPeriods * kPeriod);
    const safety::FaultRecord record = system.robot->faultRecord(0);
    EXPECT_EQ(record.faults, safety::bit(Fault::kDrive));
    EXPECT_EQ(record.cause, safety::FaultCause::kForeignMaster) << safety::describe(record);
    EXPECT_EQ(system.guardCount(HardwareGuard::kForeignMaster), 6u) << "once for each axis of the bus";
    int reported = 0;
    for (const HardwareEvent& event : system.events)
      reported += event.kind == HardwareEvent::Kind::kMaster && event.bus == 0 &&
                  event.master == static_cast<std::uint8_t>(GetParam().kind);
    EXPECT_EQ(reported, 1) << system.story();

    // The whole arm stops within the ramp and the drives' own lag, and loses its torque; the other one continues.
    ASSERT_TRUE(system.until(1.0, [&] { return system.robot->arm(0).power() == ArmPower::kOff; })) << system.story();
    const ArmVector stopped = system.truth(0);
    const ArmVector displacement = (stopped - before).cwiseAbs();
    EXPECT_LE(displacement.head(3).maxCoeff(), 4e-3 * 0.012 + 4e-3 * 4e-3 / (2 * 0.1) + 0.15e-3)
        << displacement.transpose();
    EXPECT_LE(displacement.tail(3).maxCoeff(), 0.3 * 0.012 + 0.3 * 0.3 / (2 * 20) + 0.02) << displacement.transpose();
    for (int j = 0; j < 6; ++j)
      EXPECT_NE(system.drive(0, j).state(), sim::drives::DriveState::kEnabled) << j;
    EXPECT_EQ(system.robot->state(1), OperatingState::kEnabled) << system.story();
    // The axes are intact: they stop together, on the line of the ramp, unless the frame stops or resets drives.
    EXPECT_TRUE(quick_stops == 0 || GetParam().takes_drives) << quick_stops;
    EXPECT_TRUE(GetParam().takes_drives || std::abs(displacement[0] - displacement[1]) < 2e-5)
        << displacement.transpose();

    // Only after the listening time without its frames, and only by `disable`.
    system.hold();
    system.request(DriveRequest::kDisable);
    const double left = kListening - 1e-9 * static_cast<double>(system.now - begin);
    if (left > 0.1) {
      system.run(left - 0.05);
      EXPECT_EQ(system.robot->state(0), OperatingState::kFault);
      EXPECT_FALSE(system.robot->arm(0).rebooting()) << "resets nodes that somebody else commands";
    }
    ASSERT_TRUE(system.until(8.0, [&] { return system.all(OperatingState::kDisabled) && system.allHomed(); }))
        << system.story();
    ASSERT_TRUE(system.enable()) << system.story();
    EXPECT_LE((system.truth(0) - stopped).head(3).cwiseAbs().maxCoeff(), 5e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(Frames, Foreign, testing::ValuesIn(kCases), [](const auto& instance) {
  return instance.param.name;
});

TEST(ForeignMaster, TwoHalsThatStartTogetherStopEachOther) {
  System system;
  Others others(system);
  RobotHardware second(system.config, others.buses(system.config), robotOptions());
  const std::int64_t end = system.now + static_cast<std::int64_t>(1e9 * second.listeningTime());
  while (system.now < end) {
    const bool alive = std::exchange(system.hal_alive, false);
    system.period();
    system.hal_alive = alive;
    system.robot->listen(system.now);
    second.listen(system.now);
  }
  ASSERT_FALSE(received(*system.robot));
  ASSERT_FALSE(received(second));
  system.robot->start(system.now);
  second.start(system.now);
  system.after_period = [&] { second.step(system.now); };
  system.request(DriveRequest::kEnable);
  system.run(3.0);
  for (int a = 0; a < 2; ++a) {
    EXPECT_EQ(system.robot->faultRecord(a).cause, safety::FaultCause::kForeignMaster) << a;
    EXPECT_EQ(second.faultRecord(a).cause, safety::FaultCause::kForeignMaster) << a;
    for (int j = 0; j < 6; ++j)
      EXPECT_NE(system.drive(a, j).state(), sim::drives::DriveState::kEnabled);
  }
  // While the other master sends, nothing clears the fault and nothing is reset; after it is gone, `disable` does.
  system.request(DriveRequest::kDisable);
  system.run(3.0);
  EXPECT_TRUE(system.all(OperatingState::kFault));
  system.after_period = nullptr;
  ASSERT_TRUE(system.until(8.0, [&] { return system.all(OperatingState::kDisabled) && system.allHomed(); }))
      << system.story();
  ASSERT_TRUE(system.enable()) << system.story();
}

TEST(ForeignMaster, ASecondHalThatDoesNotListenStopsBothArms) {
  // Like an older version: it resets all nodes at once. The torque is lost, but all arms end in FAULT.
  System system;
  Others others(system);
  ASSERT_TRUE(system.boot());
  ASSERT_TRUE(system.enable());
  system.move(0, speeds(4e-3, 0.3));
  system.move(1, speeds(4e-3, 0.3));
  system.run(0.5);
  others.drain();
  const ArmVector before[] = {system.truth(0), system.truth(1)};
  RobotHardware second(system.config, others.buses(system.config), robotOptions());
  second.start(system.now);
  second.step(system.now);
  system.after_period = [&] { second.step(system.now); };
  const std::int64_t begin = system.now;
  ASSERT_TRUE(system.until(1.0, [&] { return system.all(OperatingState::kFault); }));
  EXPECT_LE(system.now - begin, kBudgetPeriods * kPeriod);
  system.run(1.0);
  const ArmVector stopped[] = {system.truth(0), system.truth(1)};
  system.run(2.0);
  for (int a = 0; a < 2; ++a) {
    EXPECT_LE((stopped[a] - before[a]).head(3).cwiseAbs().maxCoeff(), 4e-3 * 0.1);
    EXPECT_LE((system.truth(a) - stopped[a]).head(3).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_EQ(system.robot->arm(a).power(), ArmPower::kOff);
    EXPECT_EQ(system.robot->faultRecord(a).cause, safety::FaultCause::kForeignMaster);
  }
}

TEST(ForeignMaster, AnArmWithoutTorqueIsNotEnabledBesideIt) {
  System system;
  Others others(system);
  ASSERT_TRUE(system.boot());
  others.send(1, canopen::syncFrame(0));
  system.run(0.1);
  EXPECT_EQ(system.robot->state(0), OperatingState::kDisabled);
  EXPECT_EQ(system.robot->state(1), OperatingState::kFault);
  EXPECT_FALSE(system.enable());
  for (int j = 0; j < 6; ++j)
    EXPECT_NE(system.drive(1, j).state(), sim::drives::DriveState::kEnabled);
}

TEST(ForeignMaster, DuringARebootEndsTheReboot) {
  System system;
  Others others(system);
  ASSERT_TRUE(system.boot());
  ASSERT_TRUE(system.enable());
  ASSERT_TRUE(system.inject(0, FaultKind::kOverCurrent, 2));
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->state(0) == OperatingState::kFault; }));
  system.wires[0]->drives->clear(0, std::nullopt);
  system.request(DriveRequest::kDisable);
  ASSERT_TRUE(system.until(1.0, [&] { return system.robot->arm(0).rebooting(); }));
  system.request(DriveRequest::kKeep);
  others.send(0, canopen::syncFrame(0));
  system.period();
  EXPECT_FALSE(system.robot->arm(0).rebooting());
  system.run(4.0);
  EXPECT_EQ(system.robot->state(0), OperatingState::kFault) << "an operator has to say so, once more";
  system.request(DriveRequest::kDisable);
  ASSERT_TRUE(system.until(8.0, [&] { return system.all(OperatingState::kDisabled) && system.allHomed(); }))
      << system.story();
}

TEST(ForeignMaster, NothingIsAllocatedForIt) {
  if (!tandem::test::canCountAllocations())
    GTEST_SKIP() << "sanitizers bring their own allocator";
  System system;
  Others others(system);
  std::size_t allocations = 0;
  const auto counted = [&](double seconds, auto&& step) {
    for (const std::int64_t end = system.now + static_cast<std::int64_t>(1e9 * seconds); system.now < end;) {
      const bool alive = std::exchange(system.hal_alive, false);
      system.period();  // the drives alone
      system.hal_alive = alive;
      others.send(0, canopen::syncFrame(0));
      const std::size_t before = tandem::test::allocationCount();
      step();
      HardwareEvent event;
      while (system.robot->nextEvent(event)) {
      }
      allocations += tandem::test::allocationCount() - before;
    }
  };
  counted(0.2, [&] { system.robot->listen(system.now); });
  EXPECT_TRUE(received(*system.robot));
  system.robot->start(system.now);
  counted(1.0, [&] { system.robot->step(system.now); });
  EXPECT_EQ(system.robot->state(0), OperatingState::kFault);
  EXPECT_EQ(allocations, 0u);
}

TEST(ForeignMaster, ToolsThatReadObjectsAreReportedAndStopNothing) {
  System system;
  Others others(system);
  ASSERT_TRUE(system.boot());
  ASSERT_TRUE(system.enable());
  system.move(0, speeds(4e-3, 0.3));
  system.run(0.3);
  system.events.clear();
  for (int k = 0; k < 50; ++k) {
    others.send(0, can::makeFrame(canopen::cob::kSdoRequest + 3, std::array<std::uint8_t, 8>{0x40, 0x41, 0x60}));
    system.run(0.01);
  }
  EXPECT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
  EXPECT_EQ(networkOf(*system.robot, 0).masters().received(MasterFrame::kSdoRequest).count, 50u);
  int reported = 0;
  for (const HardwareEvent& event : system.events)
    reported += event.kind == HardwareEvent::Kind::kMaster &&
                event.master == static_cast<std::uint8_t>(MasterFrame::kSdoRequest);
  EXPECT_EQ(reported, 1) << "once, not with every request";
}

}  // namespace
}  // namespace tandem::hal::test::foreign_master
