// SPDX-License-Identifier: Apache-2.0
/** @file SocketCAN bus on virtual interfaces: vcan0, and vcan1 with a transmit queue of four frames and 1 s delay.
 *
 * Runs in uml.sh if the kernel has no CAN; see CMakeLists.txt in this folder. */
#include "hal/can/detail/socketcan.h"

#include <gtest/gtest.h>
#include <linux/can/error.h>
#include <poll.h>

#include <stdexcept>
#include <system_error>

#include "hal/can/bus_lock.h"
#include "hal/can/clock.h"
#include "hal/canopen/network.h"
#include "sim/drives/drive_bus.h"
#include "tests/unit/hal/random_frame.h"
#include "tests/unit/support/drive_rig.h"

namespace tandem::hal::can {
namespace {

const std::string kInterface = "vcan0";

/// All frames received within `seconds`, or the first `count`.
std::vector<CanFrame> collect(Bus& bus, std::size_t count, double seconds = 10.0) {
  std::vector<CanFrame> all;
  std::array<CanFrame, 100> batch;
  const std::int64_t end = monotonicNow() + static_cast<std::int64_t>(1e9 * seconds);
  while (all.size() < count && monotonicNow() < end) {
    pollfd source{bus.fd(), POLLIN, 0};
    poll(&source, 1, 100);
    const std::size_t got = bus.receive(batch);
    all.insert(all.end(), batch.begin(), batch.begin() + static_cast<std::ptrdiff_t>(got));
  }
  return all;
}

TEST(SocketCan, EveryKindOfFrameArrivesUnchanged) {
  BusOptions options;
  options.fd = true;
  SocketCanBus a(kInterface, options), b(kInterface, options);
  EXPECT_EQ(a.maxLength(), kFdLength);
  test::Random random(test::baseSeed());
  SCOPED_TRACE(test::trace(test::baseSeed()));
  std::vector<CanFrame> sent;
  while (sent.size() < 300) {
    CanFrame frame = test::randomFrame(random, true);
    if (frame.error) {
      frame.id = CAN_ERR_CRTL;
      frame.length = 8;
    }
    sent.push_back(frame);
  }
  const std::int64_t before = monotonicNow();
  ASSERT_EQ(a.send(sent), sent.size()) << "in batches";
  const auto got = collect(b, sent.size());
  const std::int64_t after = monotonicNow();
  ASSERT_EQ(got.size(), sent.size());
  for (std::size_t k = 0; k < sent.size(); ++k) {
    EXPECT_TRUE(sameOnWire(got[k], sent[k])) << k;
    EXPECT_GE(got[k].time, before - 1'000'000) << "kernel's stamp on the monotonic clock";
    EXPECT_LE(got[k].time, after);
  }
  EXPECT_EQ(b.counters().received, sent.size());
  EXPECT_EQ(a.counters().sent, sent.size());
}

TEST(SocketCan, NobodyHearsItself) {
  // Otherwise a HAL would attribute its own frames to another master.
  SocketCanBus a(kInterface), b(kInterface);
  const std::array<CanFrame, 2> frames{makeFrame(0x080, {}), makeFrame(0x77F, std::array<std::uint8_t, 1>{5})};
  ASSERT_EQ(a.send(frames), frames.size());
  EXPECT_EQ(collect(b, 2).size(), 2u);
  EXPECT_EQ(collect(a, 1, 0.2).size(), 0u);
}

TEST(SocketCan, OneLockPerInterface) {
  const std::string address = std::string("can:") + kInterface;
  const BusLock lock(address);
  EXPECT_THROW(BusLock{address}, BusTaken);
  const BusLock other("can:vcan1");
  SocketCanBus listener(kInterface);  // takes no lock
}

TEST(SocketCan, FiltersWorkInTheKernel) {
  BusOptions options;
  options.filters = {{0x180, 0x780, false}};
  SocketCanBus filtered(kInterface, options);
  SocketCanBus all(kInterface), sender(kInterface);
  CanFrame wide = makeFrame(0x181, {});
  wide.extended = true;
  CanFrame remote = makeFrame(0x182, {});
  remote.remote = true;
  const std::array<CanFrame, 5> frames{makeFrame(0x181, {}), makeFrame(0x201, {}), wide, remote, makeFrame(0x1FF, {})};
  ASSERT_EQ(sender.send(frames), frames.size());
  EXPECT_EQ(collect(all, 5).size(), 5u);
  const auto got = collect(filtered, 3, 0.5);
  ASSERT_EQ(got.size(), 2u);
  EXPECT_EQ(got[0].id, 0x181u);
  EXPECT_EQ(got[1].id, 0x1FFu);
}

TEST(SocketCan, ErrorFramesDriveTheState) {
  SocketCanBus bus(kInterface), injector(kInterface);
  CanFrame frame;
  frame.error = true;
  frame.length = 8;
  frame.id = CAN_ERR_BUSOFF;
  ASSERT_EQ(injector.send({&frame, 1}), 1u);
  ASSERT_EQ(collect(bus, 1).size(), 1u);
  EXPECT_EQ(bus.state(), BusState::kOff);
  EXPECT_TRUE(bus.faulty());
  frame.id = CAN_ERR_RESTARTED;
  ASSERT_EQ(injector.send({&frame, 1}), 1u);
  ASSERT_EQ(collect(bus, 1).size(), 1u);
  EXPECT_EQ(bus.state(), BusState::kActive);
  EXPECT_EQ(bus.counters().bus_off, 1u);
}

TEST(SocketCan, OverflowsAreCounted) {
  BusOptions options;
  options.receive_buffer = 4096;
  SocketCanBus bus(kInterface, options), sender(kInterface);
  constexpr std::size_t kSent = 500;
  const std::vector<CanFrame> frames(kSent, makeFrame(0x181, std::array<std::uint8_t, 8>{}));
  ASSERT_EQ(sender.send(frames), kSent);
  std::size_t got = collect(bus, kSent, 0.5).size();
  EXPECT_LT(got, kSent);
  // The kernel reports losses with the next received frame.
  ASSERT_EQ(sender.send({frames.data(), 1}), 1u);
  got += collect(bus, 1).size();
  EXPECT_EQ(got + bus.counters().rx_overflow, kSent + 1);
}

TEST(SocketCan, AFullQueueDropsAndBecomesAFault) {
  BusOptions options;
  options.max_consecutive_drops = 3;
  SocketCanBus bus("vcan1", options);
  const std::vector<CanFrame> burst(20, makeFrame(0x201, {}));
  EXPECT_LT(bus.send(burst), burst.size()) << "the queue holds four";
  EXPECT_FALSE(bus.faulty());
  bus.send(burst);
  bus.send(burst);
  EXPECT_TRUE(bus.faulty());
  EXPECT_EQ(bus.counters().sent + bus.counters().tx_dropped, 3 * burst.size());
  EXPECT_EQ(bus.counters().tx_failed, 0u);
}

TEST(SocketCan, NoticesTheLinkGoingDownAndUp) {
  SocketCanBus bus(kInterface);
  std::array<CanFrame, 4> frames;
  EXPECT_EQ(bus.state(), BusState::kActive);
  LinkChange change;
  change.up = false;
  changeLink(kInterface, change);
  bus.receive(frames);
  EXPECT_EQ(bus.state(), BusState::kDown);
  EXPECT_TRUE(bus.faulty());
  const CanFrame frame = makeFrame(1, {});
  EXPECT_EQ(bus.send({&frame, 1}), 0u);
  EXPECT_EQ(bus.counters().tx_failed, 1u);
  EXPECT_THROW(SocketCanBus{kInterface}, std::system_error) << "it is down";
  change.up = true;
  changeLink(kInterface, change);
  bus.receive(frames);
  EXPECT_EQ(bus.state(), BusState::kActive);
  EXPECT_EQ(bus.send({&frame, 1}), 1u);
  EXPECT_EQ(bus.counters().link_losses, 1u);
}

TEST(SocketCan, NetlinkDescribesTheInterface) {
  const auto link = findLink(kInterface);
  ASSERT_TRUE(link);
  EXPECT_EQ(link->kind, "vcan");
  EXPECT_TRUE(link->up);
  EXPECT_TRUE(link->fd);
  EXPECT_EQ(link->mtu, 72u);
  EXPECT_FALSE(link->bit_rate) << "no controller";
  LinkChange change;
  change.queue_length = 77;
  changeLink(kInterface, change);
  EXPECT_EQ(findLink(kInterface)->queue_length, 77u);
  EXPECT_THROW(restartLink(kInterface), std::system_error);
  EXPECT_THROW(SocketCanBus("lo"), std::system_error);
}

TEST(SocketCan, TwelveNodesComeUpAndOneMoves) {
  SocketCanBus drive_side(kInterface), master_side(kInterface);
  sim::drives::DriveBus drives(drive_side, test::rigSpec(6), monotonicNow());
  canopen::Network network(master_side);
  for (int k = 1; k <= 6; ++k)
    network.addNode(test::driveSetup(k));
  for (int k = 17; k <= 22; ++k)
    network.addNode(test::encoderSetup(k));
  using canopen::NodePhase;
  bool booting = true;
  std::int64_t next_sync = 0;
  const auto turn = [&] {
    const std::int64_t now = monotonicNow();
    drives.poll(now);
    network.receive(now);
    const bool sync = now >= next_sync && !booting;
    if (sync)
      next_sync = now + test::kBusPeriod;
    network.transmit(now, {sync, sync});
  };
  const auto until = [&](auto condition) {
    const std::int64_t end = monotonicNow() + 20'000'000'000;
    while (!condition() && monotonicNow() < end)
      turn();
    return condition();
  };
  network.setHeartbeat(true);
  network.bootAll(monotonicNow());
  ASSERT_TRUE(until([&] { return network.all(NodePhase::kConfigured) || network.anyFailed(); }));
  for (int k = 0; k < 12; ++k)
    ASSERT_EQ(network.node(k).phase(), NodePhase::kConfigured) << network.node(k).describeFailure();
  network.startAll(monotonicNow());
  ASSERT_TRUE(until([&] { return network.all(NodePhase::kOperational); }));
  booting = false;
  auto& command = network.node(0).rpdos()[0];
  auto& feedback = network.node(0).tpdos()[0];
  for (const std::uint16_t word : {0x06, 0x07, 0x0F}) {
    command.set(test::kControl, word);
    const std::uint64_t expected = word == 0x06 ? 0x21 : word == 0x07 ? 0x23 : 0x27;
    ASSERT_TRUE(until([&] { return (feedback.get(test::kStatus) & 0x6F) == expected; }));
  }
  command.set(test::kTarget, 1000);
  ASSERT_TRUE(until([&] { return std::abs(feedback.getSigned(test::kActual) - 1000) <= 1; }));
  EXPECT_EQ(network.counters().total(), network.counters().received);
  EXPECT_EQ(master_side.counters().rx_overflow, 0u);
}

}  // namespace
}  // namespace tandem::hal::can
