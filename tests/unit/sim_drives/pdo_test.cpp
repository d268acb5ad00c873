// SPDX-License-Identifier: Apache-2.0
/** @file PDOs of a simulated device, as seen on the bus. */
#include <gtest/gtest.h>

#include <map>

#include "tests/unit/support/drive_rig.h"

namespace tandem::sim::drives {
namespace {

using hal::canopen::SdoAbort;
using test::DriveRig;
using test::kMillisecond;

TEST(DevicePdo, ParametersAreGuarded) {
  DriveRig rig(1);
  ASSERT_TRUE(rig.bringUp());
  EXPECT_EQ(rig.write(0, {0x1A00, 0}, 0, 1), SdoAbort::kAccess) << "the PDO is valid";
  EXPECT_EQ(rig.write(0, {0x1800, 1}, 0x182, 4), SdoAbort::kValueRange) << "another id needs bit 31 first";
  EXPECT_EQ(rig.write(0, {0x1800, 1}, 0x80000182, 4), SdoAbort::kNone);
  EXPECT_EQ(rig.write(0, {0x1800, 1}, 0x581, 4), SdoAbort::kValueRange) << "an SDO's id";
  EXPECT_EQ(rig.write(0, {0x1800, 1}, 0x20000182, 4), SdoAbort::kValueRange) << "29 bits";
  EXPECT_EQ(rig.write(0, {0x1800, 2}, 250, 1), SdoAbort::kValueRange);
  EXPECT_EQ(rig.write(0, {0x1A00, 1}, 0x60410010, 4), SdoAbort::kAccess) << "its count is not 0";
  EXPECT_EQ(rig.write(0, {0x1A00, 0}, 0, 1), SdoAbort::kNone);
  EXPECT_EQ(rig.write(0, {0x1A00, 1}, 0x2FFF0010, 4), SdoAbort::kNoObject);
  EXPECT_EQ(rig.write(0, {0x1A00, 1}, 0x10180420, 4), SdoAbort::kNotMappable);
  EXPECT_EQ(rig.write(0, {0x1A00, 1}, 0x60410020, 4), SdoAbort::kNotMappable) << "it has 16 bits";
  for (std::uint8_t k = 1; k <= 3; ++k)
    EXPECT_EQ(rig.write(0, {0x1A00, k}, 0x60640020, 4), SdoAbort::kNone);
  EXPECT_EQ(rig.write(0, {0x1A00, 0}, 3, 1), SdoAbort::kPdoLength);
  EXPECT_EQ(rig.write(0, {0x1A00, 0}, 2, 1), SdoAbort::kNone);
  EXPECT_EQ(rig.write(0, {0x1600, 0}, 0, 1), SdoAbort::kAccess);
  EXPECT_EQ(rig.write(0, {0x1400, 1}, 0x80000201, 4), SdoAbort::kNone);
  EXPECT_EQ(rig.write(0, {0x1600, 0}, 0, 1), SdoAbort::kNone);
  EXPECT_EQ(rig.write(0, {0x1600, 1}, 0x60410010, 4), SdoAbort::kNotMappable) << "read-only";
}

/// Number of frames with this id within `cycles` SYNCs.
int countOf(DriveRig& rig, std::uint32_t id, int cycles) {
  int count = 0;
  rig.wire.tap = [&](const hal::can::CanFrame& frame) { count += frame.id == id; };
  for (int k = 0; k < cycles; ++k)
    rig.cycle();
  rig.wire.tap = nullptr;
  return count;
}

TEST(DevicePdo, TransmissionTypes) {
  const std::pair<int, int> cases[] = {{1, 60}, {3, 20}, {60, 1}, {0, 1}};
  for (const auto& [type, expected] : cases) {
    SCOPED_TRACE(type);
    DriveRig rig(test::rigSpec(1, false));
    auto setup = test::driveSetup(1);
    setup.tpdos[0].transmission_type = static_cast<std::uint8_t>(type);
    rig.network.addNode(setup);
    rig.network.setHeartbeat(true);
    rig.network.bootAll(rig.now);
    ASSERT_TRUE(rig.until([&] { return rig.network.all(hal::canopen::NodePhase::kConfigured); }));
    rig.network.startAll(rig.now);
    EXPECT_NEAR(countOf(rig, 0x181, 60), expected, 1);
  }
}

TEST(DevicePdo, EventTimerAndInhibitTime) {
  DriveRig rig(test::rigSpec(1, false));
  auto setup = test::driveSetup(1);
  setup.tpdos[0].transmission_type = 255;
  setup.tpdos[0].event_timer = 20;
  rig.network.addNode(setup);
  ASSERT_TRUE(rig.bringUp());
  EXPECT_NEAR(countOf(rig, 0x181, 100), 20, 2) << "400 ms";
  DriveRig noisy(test::rigSpec(1, false));
  setup.tpdos[0].event_timer = 0;
  setup.tpdos[0].inhibit_time = 100;  // 10 ms
  noisy.network.addNode(setup);
  ASSERT_TRUE(noisy.bringUp());
  noisy.drives.inject({FaultKind::kGarbage, 1});  // another value each time
  EXPECT_NEAR(countOf(noisy, 0x181, 100), 40, 3) << "400 ms";
}

TEST(DevicePdo, SynchronousCommandsWaitForSync) {
  DriveRig rig(1);
  ASSERT_TRUE(rig.bringUp());
  rig.run(0.1);
  auto& other = rig.wire.join("other");
  const auto frame = hal::can::makeFrame(0x201, std::array<std::uint8_t, 6>{0x06});
  rig.setpoints = false;
  other.send({&frame, 1});
  rig.drives.poll(rig.now);
  EXPECT_EQ(rig.drive().state(), DriveState::kSwitchOnDisabled);
  const auto sync = hal::canopen::syncFrame(0);
  other.send({&sync, 1});
  rig.drives.poll(rig.now);
  EXPECT_EQ(rig.drive().state(), DriveState::kReady);
}

TEST(DevicePdo, WrongLengthsAreReported) {
  DriveRig rig(1);
  ASSERT_TRUE(rig.bringUp());
  auto& other = rig.wire.join("other");
  const auto send = [&](std::uint32_t id, std::size_t length) {
    std::array<std::uint8_t, 8> bytes{};
    const auto frame = hal::can::makeFrame(id, std::span(bytes).first(length));
    other.send({&frame, 1});
    rig.cycle();
    return rig.network.node(0).lastEmcy().code;
  };
  EXPECT_EQ(send(0x201, 5), hal::canopen::error_code::kPdoLength);
  EXPECT_EQ(send(0x201, 8), hal::canopen::error_code::kPdoLengthExceeded);
  EXPECT_EQ(send(0x080, 2), hal::canopen::error_code::kSyncLength);
  EXPECT_EQ(rig.drive().counters().bad_rpdos, 2u);
  EXPECT_EQ(rig.read(0, {0x1003, 0}), 3u);
  EXPECT_EQ(rig.read(0, {0x1003, 1}), hal::canopen::error_code::kSyncLength) << "the newest first";
  EXPECT_EQ(rig.read(0, {0x1003, 3}), hal::canopen::error_code::kPdoLength);
}

TEST(Device, StopsAndStarts) {
  DriveRig rig(1);
  ASSERT_TRUE(rig.bringUp());
  EXPECT_GT(countOf(rig, 0x181, 10), 8);
  rig.network.command(hal::canopen::NmtCommand::kStop, 1);
  rig.run(0.05);
  EXPECT_EQ(rig.drive().nmt(), NmtState::kStopped);
  EXPECT_EQ(countOf(rig, 0x181, 10), 0);
  auto& sdo = rig.network.node(0).sdo();
  sdo.upload({0x1000, 0}, rig.now);
  rig.run(0.4);
  EXPECT_EQ(sdo.abort(), SdoAbort::kTimeout) << "no SDO while stopped";
  rig.network.command(hal::canopen::NmtCommand::kStart, 0);
  rig.run(0.05);
  EXPECT_EQ(rig.drive().nmt(), NmtState::kOperational);
}

TEST(Device, NmtResetsRestoreTheirParameters) {
  DriveRig rig(1);
  ASSERT_TRUE(rig.bringUp());
  EXPECT_EQ(rig.write(0, {0x6081, 0}, 777, 4), SdoAbort::kNone);
  rig.network.command(hal::canopen::NmtCommand::kResetCommunication, 1);
  rig.run(0.1);
  EXPECT_EQ(rig.drive().dictionary().require(0x6081).value, 777);
  EXPECT_EQ(rig.drive().dictionary().require(0x1017).value, 0);
  EXPECT_EQ(rig.drive().counters().boots, 2u) << "power on, reset";
  rig.network.command(hal::canopen::NmtCommand::kResetNode, 1);
  rig.run(0.1);
  EXPECT_EQ(rig.drive().dictionary().require(0x6081).value, 50000);
}

}  // namespace
}  // namespace tandem::sim::drives
