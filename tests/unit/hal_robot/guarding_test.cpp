// SPDX-License-Identifier: Apache-2.0
/** @file Node guarding instead of heartbeats, and SYNC with a counter: each side notices the other's end. */
#include "tests/unit/hal_robot/robot_fixture.h"

namespace tandem::hal::test {
namespace {

using canopen::NodeFailure;

constexpr double kBudget = safety::Budgets{}.drive_heartbeat;

HardwareConfig guarded(DriveMode mode = DriveMode::kCyclicPosition) {
  HardwareConfig config = presetHardware(mode);
  for (AxisConfig& axis : config.axes)
    axis.watch = MutualWatch::kNodeGuarding;
  return config;
}

/// Drives without heartbeat consumer and without a deadline of their commands: node guarding is their only watch.
sim::drives::Eds guardingAlone() {
  sim::drives::Eds eds = sim::drives::driveEds();
  EXPECT_GT(std::erase_if(eds.objects,
                          [](const auto& object) {
                            const canopen::ObjectAddress address = object.address;
                            return address.index == 0x1016 || (address.index / 16 == 0x140 && address.sub == 5);
                          }),
            4u);
  return eds;
}

TEST(NodeGuarding, ReplacesTheHeartbeatOfTheDrives) {
  System system(guarded(), 0.0, guardingAlone());
  ASSERT_TRUE(system.boot() && system.enable()) << system.story();
  const Axis& axis = system.robot->arm(0).axis(0);
  EXPECT_EQ(driveNode(axis).lostProtections(), bit(Protection::kCommandDeadline));
  can::VirtualBus::Port& listener = system.wires[0]->bus.join("listener");
  std::array<can::CanFrame, 256> frames;
  int requests = 0, answers = 0, toggles = 0, last = -1;
  system.after_period = [&] {
    for (std::size_t k = 0, count = listener.receive(frames); k < count; ++k) {
      if (frames[k].id != 0x701)
        continue;
      requests += frames[k].remote ? 1 : 0;
      answers += frames[k].remote ? 0 : 1;
      if (!frames[k].remote) {
        EXPECT_EQ(frames[k].data[0] & 0x7F, 5);
        toggles += frames[k].data[0] / 128 != last ? 1 : 0;
        last = frames[k].data[0] / 128;
      }
    }
  };
  system.move(0, speeds(2e-3, 0.1));
  system.run(2.0);
  EXPECT_NEAR(requests, 2.0 * kGuardsPerBudget / kBudget, 3.0);
  EXPECT_NEAR(answers, requests, 1.0);
  EXPECT_EQ(toggles, answers);
  EXPECT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
  EXPECT_EQ(system.drive(0, 0).counters().heartbeats_lost, 0u);
}

/// Life guarding: without requests the drive stops by itself within its budget.
TEST(NodeGuarding, TheDriveStopsWhenTheMasterDies) {
  for (const DriveMode mode : {DriveMode::kCyclicPosition, DriveMode::kProfileVelocity}) {
    SCOPED_TRACE(static_cast<int>(mode));
    System system(guarded(mode), 0.0, guardingAlone());
    ASSERT_TRUE(system.boot() && system.enable()) << system.story();
    system.move(0, speeds(4e-3, 0.3));
    system.run(0.5);
    const ArmVector before = system.truth(0);
    const std::int64_t end = system.now;
    system.hal_alive = false;
    system.run(kBudget + 0.3);
    const ArmVector after = system.truth(0);
    for (int j = 0; j < 6; ++j) {
      SCOPED_TRACE(j);
      sim::drives::Drive& drive = system.drive(0, j);
      EXPECT_EQ(drive.counters().heartbeats_lost, 1u);
      EXPECT_EQ(drive.lastError(), canopen::error_code::kHeartbeat);
      EXPECT_EQ(drive.record().quick_stops, 1u);
      EXPECT_LE(1e-9 * static_cast<double>(drive.record().stop_begin - end), kBudget + 2e-3);
      const AxisConfig& axis = system.config.axes[static_cast<std::size_t>(j)];
      AxisConfig slow = axis;
      slow.velocity = j < 3 ? 4e-3 : 0.3;
      const ProtectionMask lost = driveNode(system.robot->arm(0).axis(j)).lostProtections();
      EXPECT_LE(std::abs(after[j] - before[j]), slow.travelWithoutHal(lost, kBudget));
    }
    system.run(0.5);
    EXPECT_LE((system.truth(0) - after).cwiseAbs().maxCoeff(), 1e-6);
  }
}

/// The HAL notices a dead node by its missing answers, and the arm recovers with it.
TEST(NodeGuarding, TheMasterNoticesADeadNode) {
  System system(guarded(), 0.0, guardingAlone());
  ASSERT_TRUE(system.boot() && system.enable()) << system.story();
  system.run(0.2);
  const canopen::Node& node = driveNode(system.robot->arm(0).axis(1));
  const std::int64_t death = system.now;
  ASSERT_TRUE(system.inject(0, FaultKind::kOff, node.id(), 0.0, 0.5));
  ASSERT_TRUE(system.until(0.4, [&] { return node.phase() == canopen::NodePhase::kFailed; }));
  EXPECT_EQ(node.failure().reason, NodeFailure::Reason::kHeartbeatLost);
  EXPECT_NE(node.describeFailure().find("no answer to node guarding"), std::string::npos) << node.describeFailure();
  EXPECT_LE(1e-9 * static_cast<double>(system.now - death), kBudget + 2.0 * system.config.period);
  EXPECT_EQ(system.robot->state(0), OperatingState::kFault);
  EXPECT_EQ(system.robot->state(1), OperatingState::kEnabled);
  system.run(1.0);
  system.command.request[0] = DriveRequest::kDisable;
  ASSERT_TRUE(system.until(5.0, [&] { return system.robot->state(0) == OperatingState::kDisabled; })) << system.story();
  system.command.request[0] = DriveRequest::kKeep;
  ASSERT_TRUE(system.until(5.0, [&] { return system.allHomed(); })) << system.story();
  EXPECT_TRUE(system.enable()) << system.story();
}

TEST(SyncCounter, IsThatOfTheBusForEveryNode) {
  HardwareConfig config = presetHardware();
  config.buses[0].sync_counter = 7;
  System system(config);
  ASSERT_TRUE(system.boot() && system.enable()) << system.story();
  for (const auto& drive : system.wires[0]->drives->drives())
    EXPECT_EQ(drive->dictionary().require(0x1019).value, 7);
  for (const auto& encoder : system.wires[0]->drives->encoders())
    EXPECT_EQ(encoder->dictionary().require(0x1019).value, 7);
  EXPECT_EQ(system.wires[1]->drives->drives()[0]->dictionary().require(0x1019).value, 0);
  std::array<std::vector<int>, 2> counters;
  std::array<can::VirtualBus::Port*, 2> listeners{};
  for (std::size_t b = 0; b < 2; ++b)
    listeners[b] = &system.wires[b]->bus.join("listener");
  std::array<can::CanFrame, 256> frames;
  system.after_period = [&] {
    for (std::size_t b = 0; b < 2; ++b) {
      for (std::size_t k = 0, count = listeners[b]->receive(frames); k < count; ++k) {
        if (frames[k].id == 0x80)
          counters[b].push_back(frames[k].length == 1 ? frames[k].data[0] : -frames[k].length);
      }
    }
  };
  system.run(0.2);
  ASSERT_GT(counters[0].size(), 40u);
  for (std::size_t k = 1; k < counters[0].size(); ++k)
    EXPECT_EQ(counters[0][k], counters[0][k - 1] % 7 + 1);
  EXPECT_EQ(std::ranges::count(counters[1], 0), static_cast<std::ptrdiff_t>(counters[1].size()));
  EXPECT_TRUE(system.all(OperatingState::kEnabled)) << system.story();
  EXPECT_EQ(system.drive(0, 0).counters().emergencies, 0u) << "a SYNC of the wrong length is an error of the drive";
}

}  // namespace
}  // namespace tandem::hal::test
