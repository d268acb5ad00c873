// SPDX-License-Identifier: Apache-2.0
#include "hal/canopen/network.h"

#include <gtest/gtest.h>

#include <map>
#include <stdexcept>

#include "tests/unit/hal/random_frame.h"
#include "tests/unit/support/drive_rig.h"

namespace tandem::hal::canopen {
namespace {

using test::DriveRig;
using test::kMillisecond;

TEST(Network, TwelveNodesComeUpAtOnce) {
  DriveRig one(1, 8, false), twelve(6);
  const std::int64_t begin_one = one.now, begin_twelve = twelve.now;
  ASSERT_TRUE(one.bringUp()) << one.network.node(0).describeFailure();
  ASSERT_TRUE(twelve.bringUp());
  const std::int64_t alone = one.now - begin_one, together = twelve.now - begin_twelve;
  EXPECT_LT(together, alone + 100 * kMillisecond) << "concurrently, not one after another";
  EXPECT_EQ(twelve.network.counters().received, twelve.network.counters().total());
  twelve.run(1.0);
  for (int k = 0; k < 12; ++k) {
    // One PDO per SYNC from each node.
    const auto before = twelve.network.node(k).tpdos()[0].count;
    twelve.run(0.4);
    EXPECT_EQ(twelve.network.node(k).tpdos()[0].count - before, 100u) << k;
  }
  EXPECT_FALSE(twelve.network.anyFailed());
}

TEST(Network, ConfigurationIsWhatTheNodeHas) {
  DriveRig rig(1);
  ASSERT_TRUE(rig.bringUp());
  auto& dictionary = rig.drive().dictionary();
  EXPECT_EQ(dictionary.require(0x1016, 1).value, 127 << 16 | 100);
  EXPECT_EQ(dictionary.require(0x1017).value, 25);
  EXPECT_EQ(dictionary.require(0x1400, 5).value, 50);
  EXPECT_EQ(dictionary.require(0x1600, 2).value, 0x607A0020);
  EXPECT_EQ(dictionary.require(0x1A00, 2).value, 0x60640020);
  EXPECT_EQ(dictionary.require(0x6007).value, 3);
  const std::uint64_t* serial = rig.network.node(0).readValue({0x1018, 4});
  ASSERT_NE(serial, nullptr);
  EXPECT_EQ(*serial, test::kRigSerial + 1);
  EXPECT_EQ(rig.network.node(0).readValue({0x1234, 0}), nullptr);
}

TEST(Network, TheWrongDeviceIsNamed) {
  auto spec = test::rigSpec(2);
  std::swap(spec.encoders[0].serial, spec.encoders[1].serial);  // two encoders swapped
  DriveRig rig(spec);
  rig.network.addNode(test::encoderSetup(17));
  EXPECT_FALSE(rig.bringUp());
  const Node& node = rig.network.node(0);
  EXPECT_EQ(node.phase(), NodePhase::kFailed);
  EXPECT_EQ(node.failure().reason, NodeFailure::Reason::kMismatch);
  EXPECT_EQ(node.describeFailure(),
            "node 17 (encoder 17): serial number 1018:04: found 1018 (0x3FA), "
            "expected 1017 (0x3F9)");
}

TEST(Network, NegativeNumbersKeepTheirSignInMessages) {
  DriveRig rig(test::rigSpec(1));
  auto setup = test::driveSetup(1);
  setup.steps.push_back(write({0x6098, 0}, -3, 1, "homing method"));
  rig.network.addNode(setup);
  EXPECT_FALSE(rig.bringUp());
  EXPECT_NE(rig.network.node(0).describeFailure().find("homing method 6098:00: sent -3 (0xFD): "), std::string::npos)
      << rig.network.node(0).describeFailure();
}

TEST(Network, RefusalsAreNamed) {
  DriveRig rig(test::rigSpec(1));
  auto setup = test::driveSetup(1);
  setup.steps.push_back(write({0x605A, 0}, 9, 2, "quick stop option"));
  rig.network.addNode(setup);
  EXPECT_FALSE(rig.bringUp());
  EXPECT_EQ(rig.network.node(0).describeFailure(),
            "node 1 (axis 1): quick stop option 605A:00: sent 9 (0x9): 06090031: value too high");
}

TEST(Network, AnAbsentNodeFailsWithoutHoldingUpTheOthers) {
  DriveRig rig(test::rigSpec(1, false));
  rig.network.addNode(test::driveSetup(1));
  rig.network.addNode(test::driveSetup(2));
  rig.network.bootAll(rig.now);
  EXPECT_TRUE(rig.until([&] { return rig.network.node(0).phase() == NodePhase::kConfigured; }, 1.0));
  EXPECT_EQ(rig.network.node(1).phase(), NodePhase::kResetting);
  EXPECT_TRUE(rig.until([&] { return rig.network.node(1).phase() == NodePhase::kFailed; }, 3.0));
  EXPECT_EQ(rig.network.node(1).describeFailure(), "node 2 (axis 2): no boot-up message after the reset");
}

TEST(Network, OptionalStepsAndWaits) {
  DriveRig rig(test::rigSpec(1, false));
  NodeSetup setup;
  setup.id = 1;
  auto absent = write({0x2FFF, 0}, 1, 2, "not there");
  absent.optional = true;
  auto wait = check({0x6061, 0}, 8, 1, "mode display");
  wait.kind = SetupStep::Kind::kAwait;
  setup.steps = {absent, write({0x1017, 0}, 25, 2, "heartbeat period"), writeOnly({0x6060, 0}, 8, 1, "mode"), wait,
                 read({0x6064, 0}, 4, "position")};
  rig.network.addNode(setup);
  ASSERT_TRUE(rig.bringUp()) << rig.network.node(0).describeFailure();
  EXPECT_NE(rig.network.node(0).readValue({0x6064, 0}), nullptr);
  DriveRig never(test::rigSpec(1, false));
  wait.value = 6;
  wait.timeout = 100 * kMillisecond;
  setup.steps = {wait};
  never.network.addNode(setup);
  EXPECT_FALSE(never.bringUp());
  EXPECT_EQ(never.network.node(0).failure().reason, NodeFailure::Reason::kMismatch);
}

TEST(Network, BootsThroughLosses) {
  test::Random random(test::baseSeed());
  SCOPED_TRACE(test::trace(test::baseSeed()));
  DriveRig rig(test::rigSpec(6));
  for (int k = 1; k <= 6; ++k) {
    auto setup = test::driveSetup(k);
    setup.sdo_timeout = 20 * kMillisecond;
    setup.sdo_retries = 8;
    rig.network.addNode(setup);
  }
  rig.wire.disturbance = [&](can::CanFrame& frame) {
    return frame.id < 0x580 || frame.id > 0x67F || !random.chance(0.05);
  };
  EXPECT_TRUE(rig.bringUp());
  for (int k = 0; k < 6; ++k)
    EXPECT_EQ(rig.network.node(k).phase(), NodePhase::kOperational) << rig.network.node(k).describeFailure();
}

TEST(Network, LostHeartbeatsFailTheNode) {
  DriveRig rig(2);
  ASSERT_TRUE(rig.bringUp());
  NetworkEvent event;
  while (rig.network.nextEvent(event)) {
  }
  const std::int64_t begin = rig.now;
  ASSERT_TRUE(rig.drives.inject({sim::drives::FaultKind::kOff, 1}));
  ASSERT_TRUE(rig.until([&] { return rig.network.anyFailed(); }, 1.0));
  EXPECT_EQ(rig.network.node(0).failure().reason, NodeFailure::Reason::kHeartbeatLost);
  EXPECT_LE(rig.now - begin, 105 * kMillisecond) << "budget 100 ms";
  ASSERT_TRUE(rig.network.nextEvent(event));
  EXPECT_EQ(event.kind, NetworkEvent::Kind::kPhase);
  EXPECT_EQ(event.node, 0);
  EXPECT_EQ(event.phase, NodePhase::kFailed);
  EXPECT_EQ(rig.network.node(1).phase(), NodePhase::kOperational);
  // It recovers only by a requested boot, not automatically.
  rig.drives.clear(1, std::nullopt);
  rig.run(0.5);
  EXPECT_EQ(rig.network.node(0).phase(), NodePhase::kFailed);
  rig.network.boot(0, rig.now);
  EXPECT_TRUE(rig.until([&] { return rig.network.node(0).phase() == NodePhase::kConfigured; }, 2.0));
}

TEST(Network, AnUnaskedBootIsAFailure) {
  DriveRig rig(1);
  ASSERT_TRUE(rig.bringUp());
  rig.drives.inject({sim::drives::FaultKind::kOff, 1, 0.0, 0.010});
  ASSERT_TRUE(rig.until([&] { return rig.network.anyFailed(); }, 1.0));
  EXPECT_EQ(rig.network.node(0).failure().reason, NodeFailure::Reason::kRebooted);
}

/// Power is switched on during the master's reset: the node boots twice.
TEST(Network, ANodeThatBootsAgainWhileItIsConfiguredStartsOver) {
  DriveRig rig(test::rigSpec(1));
  rig.network.addNode(test::driveSetup(1));
  rig.network.bootAll(rig.now);
  ASSERT_TRUE(rig.until([&] { return rig.network.node(0).phase() == NodePhase::kConfiguring; }, 1.0));
  rig.run(0.005);
  ASSERT_EQ(rig.network.node(0).phase(), NodePhase::kConfiguring);
  rig.drives.inject({sim::drives::FaultKind::kOff, 1, 0.0, 0.010});
  EXPECT_TRUE(rig.until([&] { return rig.network.node(0).phase() == NodePhase::kConfigured; }, 2.0))
      << rig.network.node(0).describeFailure();
  EXPECT_EQ(rig.drive().dictionary().require(0x6007).value, 3) << "what was written before is lost, and written again";
}

TEST(Network, ANodeThatLeavesOperationalFails) {
  DriveRig rig(1);
  ASSERT_TRUE(rig.bringUp());
  rig.network.command(NmtCommand::kPreOperational, 1);
  ASSERT_TRUE(rig.until([&] { return rig.network.anyFailed(); }, 1.0));
  EXPECT_EQ(rig.network.node(0).failure().reason, NodeFailure::Reason::kLeftOperational);
  EXPECT_EQ(rig.network.node(0).describeFailure(), "node 1 (axis 1): left operational: pre-operational");
}

TEST(Network, EmergenciesBecomeEvents) {
  DriveRig rig(1);
  ASSERT_TRUE(rig.bringUp());
  NetworkEvent event;
  while (rig.network.nextEvent(event)) {
  }
  rig.drives.inject({sim::drives::FaultKind::kEncoderAlarm, 1});
  rig.run(0.05);
  ASSERT_TRUE(rig.network.nextEvent(event));
  EXPECT_EQ(event.kind, NetworkEvent::Kind::kEmcy);
  EXPECT_EQ(event.emcy.code, error_code::kEncoder);
  EXPECT_EQ(rig.network.node(0).lastEmcy().code, error_code::kEncoder);
  EXPECT_EQ(rig.network.node(0).emcyCount(), 1u);
}

TEST(Network, AFullQueueDropsSetpointsAndKeepsTheRest) {
  DriveRig rig(1);
  ASSERT_TRUE(rig.bringUp());
  auto& sdo = rig.network.node(0).sdo();
  sdo.upload({0x1000, 0}, rig.now);
  rig.network.command(NmtCommand::kPreOperational, 1);
  const auto received = rig.drive().counters().rpdos;
  rig.wire.blocked = true;
  rig.now += kMillisecond;
  EXPECT_EQ(rig.network.transmit(rig.now, {true, true}), 0u);
  EXPECT_EQ(rig.master_port.counters().tx_dropped, 4u) << "NMT, RPDO, SYNC, SDO";
  rig.wire.blocked = false;
  std::map<std::uint32_t, int> seen;
  rig.wire.tap = [&](const can::CanFrame& frame) { ++seen[frame.id]; };
  rig.network.transmit(rig.now);
  EXPECT_EQ(seen[0x000], 1) << "an NMT command waits";
  EXPECT_EQ(seen[0x601], 1) << "an SDO request waits";
  EXPECT_EQ(seen[0x201], 0) << "a setpoint is superseded";
  EXPECT_EQ(seen[0x080], 0);
  EXPECT_EQ(rig.drive().counters().rpdos, received);
}

TEST(Network, SyncComesLastOfTheSetpointsAndCounts) {
  can::VirtualBus wire;
  auto& port = wire.join("master");
  NetworkOptions options;
  options.sync_overflow = 3;
  Network network(port, options);
  std::vector<int> counters;
  wire.tap = [&](const can::CanFrame& frame) { counters.push_back(frame.data[0]); };
  for (int k = 0; k < 7; ++k)
    network.transmit(k, {true, true});
  EXPECT_EQ(counters, (std::vector<int>{1, 2, 3, 1, 2, 3, 1}));
  EXPECT_EQ(network.syncCount(), 7u);
}

TEST(Network, HeartbeatKeepsItsPeriod) {
  can::VirtualBus wire;
  auto& port = wire.join("master");
  Network network(port, {});
  int heartbeats = 0;
  wire.tap = [&](const can::CanFrame& frame) { heartbeats += frame.id == 0x77F; };
  for (std::int64_t now = 0; now < 1000 * kMillisecond; now += kMillisecond)
    network.transmit(now);
  EXPECT_EQ(heartbeats, 0) << "off at first";
  network.setHeartbeat(true);
  for (std::int64_t now = 1000 * kMillisecond; now < 2000 * kMillisecond; now += 4 * kMillisecond)
    network.transmit(now);
  EXPECT_NEAR(heartbeats, 36, 5) << "25 ms, seen through a cycle of 4 ms";
}

TEST(Network, ConfigurationErrorsAreRefused) {
  can::VirtualBus wire;
  auto& port = wire.join("master");
  EXPECT_THROW(Network(port, {0}), std::invalid_argument);
  EXPECT_THROW(Network(port, {127, 1, 241}), std::invalid_argument);
  Network network(port, {});
  network.addNode(test::driveSetup(1));
  EXPECT_THROW(network.addNode(test::driveSetup(1)), std::invalid_argument);
  EXPECT_THROW(network.addNode(test::driveSetup(127)), std::invalid_argument) << "our own id";
  EXPECT_THROW(network.addNode(test::driveSetup(128)), std::invalid_argument);
  auto stolen = test::driveSetup(2);
  stolen.tpdos[0].id = 0x181;
  EXPECT_THROW(network.addNode(stolen), std::invalid_argument) << "COB-ID of node 1";
}

TEST(Network, CountersAccountForEveryFrame) {
  for (std::uint32_t seed = test::baseSeed(); seed < test::baseSeed() + 5; ++seed) {
    SCOPED_TRACE(test::trace(seed));
    test::Random random(seed);
    DriveRig rig(2);
    ASSERT_TRUE(rig.bringUp());
    auto& stranger = rig.wire.join("stranger");
    for (int k = 0; k < 5000; ++k) {
      const can::CanFrame frame = test::randomFrame(random);
      stranger.send({&frame, 1});
      if (k % 16 == 0)
        rig.cycle();
    }
    rig.cycle();
    const NetworkCounters& counters = rig.network.counters();
    EXPECT_EQ(counters.total(), counters.received);
    EXPECT_EQ(counters.received, rig.master_port.counters().received);
    EXPECT_GT(counters.foreign, 1000u);
    EXPECT_GT(counters.malformed, 0u);
    EXPECT_GT(counters.errors, 0u);
  }
}

}  // namespace
}  // namespace tandem::hal::canopen
