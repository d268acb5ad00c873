// SPDX-License-Identifier: Apache-2.0
#include "hal/can/bus.h"

#include <gtest/gtest.h>
#include <linux/can/error.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <system_error>

#include "hal/can/clock.h"
#include "hal/can/detail/seqpacket.h"
#include "hal/can/link.h"
#include "hal/can/virtual_bus.h"
#include "tests/unit/hal/random_frame.h"

namespace tandem::hal::can {
namespace {

std::string freshPath(const char* name) {
  return testing::TempDir() + "tandem-" + name + "-" + std::to_string(getpid());
}

CanFrame errorFrame(std::uint32_t error_class, std::uint8_t controller = 0) {
  CanFrame frame;
  frame.error = true;
  frame.id = error_class;
  frame.length = 8;
  frame.data[1] = controller;
  return frame;
}

/// Waits until a bus is readable; false after 5 s.
bool waitFor(const Bus& bus) {
  pollfd source{bus.fd(), POLLIN, 0};
  return poll(&source, 1, 5000) == 1;
}

TEST(Frame, LengthsOfCanFd) {
  for (std::size_t bytes = 0; bytes <= 64; ++bytes) {
    CanFrame frame;
    frame.fd = true;
    frame.length = fdLengthFor(bytes);
    EXPECT_GE(frame.length, bytes);
    EXPECT_TRUE(lengthIsValid(frame));
    if (frame.length > bytes) {
      frame.length = static_cast<std::uint8_t>(bytes);
      EXPECT_FALSE(lengthIsValid(frame)) << bytes;
    }
  }
}

TEST(Clock, StampsBecomeMonotonic) {
  const std::int64_t now = monotonicNow(), offset = realtimeOffset();
  EXPECT_EQ(toMonotonic(now + offset - 1000, now, offset), now - 1000);
  EXPECT_EQ(toMonotonic(now + offset + 1000, now, offset), now) << "from the future";
  EXPECT_EQ(toMonotonic(now + offset - 5'000'000'000, now, offset), now) << "the wall clock was set";
}

TEST(Bus, StateFollowsErrorFrames) {
  VirtualBus wire;
  auto& master = wire.join("master");
  auto& other = wire.join("other");
  std::array<CanFrame, 8> frames;
  const auto receive = [&](const CanFrame& frame) {
    other.send({&frame, 1});
    EXPECT_EQ(master.receive(frames), 1u);
    return master.state();
  };
  EXPECT_EQ(receive(errorFrame(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_WARNING)), BusState::kWarning);
  EXPECT_EQ(receive(errorFrame(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_PASSIVE)), BusState::kPassive);
  EXPECT_EQ(receive(errorFrame(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW)), BusState::kPassive);
  EXPECT_EQ(receive(errorFrame(CAN_ERR_CRTL, CAN_ERR_CRTL_ACTIVE)), BusState::kActive);
  EXPECT_FALSE(master.faulty());
  EXPECT_EQ(receive(errorFrame(CAN_ERR_BUSOFF)), BusState::kOff);
  EXPECT_TRUE(master.faulty());
  EXPECT_EQ(receive(errorFrame(CAN_ERR_CRTL, CAN_ERR_CRTL_ACTIVE)), BusState::kOff) << "only a restart ends bus-off";
  EXPECT_EQ(receive(errorFrame(CAN_ERR_RESTARTED)), BusState::kActive);
  EXPECT_FALSE(master.faulty());
  EXPECT_EQ(master.counters().bus_off, 1u);
  EXPECT_EQ(master.counters().restarts, 1u);
  EXPECT_EQ(master.counters().error_frames, 7u);
  CanFrame counters = errorFrame(CAN_ERR_CRTL | CAN_ERR_CNT, CAN_ERR_CRTL_TX_WARNING);
  counters.data[6] = 97;
  counters.data[7] = 3;
  receive(counters);
  EXPECT_EQ(master.counters().tx_errors, 97);
  EXPECT_EQ(master.counters().rx_errors, 3);
}

TEST(Bus, RepeatedDropsAreAFault) {
  VirtualBus wire;
  BusOptions options;
  options.max_consecutive_drops = 3;
  auto& port = wire.join("port", options);
  const std::array<CanFrame, 2> frames{makeFrame(1, {}), makeFrame(2, {})};
  wire.blocked = true;
  for (int k = 1; k <= 3; ++k) {
    EXPECT_FALSE(port.faulty());
    EXPECT_EQ(port.send(frames), 0u);
    EXPECT_EQ(port.consecutiveDrops(), k);
  }
  EXPECT_TRUE(port.faulty());
  EXPECT_EQ(port.counters().tx_dropped, 6u);
  wire.blocked = false;
  EXPECT_EQ(port.send(frames), 2u);
  EXPECT_FALSE(port.faulty());
  EXPECT_EQ(port.counters().sent, 2u);
}

TEST(Bus, FiltersPassMatchingFrames) {
  VirtualBus wire;
  BusOptions options;
  options.filters = {{0x180, 0x780, false}, {0x12345, 0x1FFFFFFF, true}};
  auto& port = wire.join("port", options);
  auto& sender = wire.join("sender");
  test::Random random(test::baseSeed());
  SCOPED_TRACE(test::trace(test::baseSeed()));
  std::size_t expected = 0;
  for (int k = 0; k < 1000; ++k) {
    const CanFrame frame = test::randomFrame(random);
    expected += frame.error || (!frame.remote && !frame.extended && (frame.id & 0x780) == 0x180);
    sender.send({&frame, 1});
  }
  CanFrame wanted;
  wanted.extended = true;
  wanted.id = 0x12345;
  sender.send({&wanted, 1});
  std::vector<CanFrame> frames(2000);
  EXPECT_EQ(port.receive(frames), expected + 1);
}

TEST(OpenBus, RefusesOtherAddresses) {
  for (const char* address : {"", "vcan0", "can:", "tcp:1", "unix:"})
    EXPECT_THROW(openBus(address), std::invalid_argument) << address;
  EXPECT_THROW(openBus("unix:/nowhere/to/be/found"), std::system_error);
  EXPECT_THROW(openBus("can:none0"), std::system_error);
}

TEST(Link, OnlyCanInterfacesCount) {
  EXPECT_EQ(findLink("lo"), std::nullopt);
  for (const LinkInfo& link : listLinks()) {
    EXPECT_FALSE(link.name.empty());
    EXPECT_GT(link.index, 0);
    EXPECT_EQ(link.fd, link.mtu >= 72) << link.name;
  }
  EXPECT_THROW(LinkMonitor("lo"), std::system_error);
  EXPECT_THROW(restartLink("none0"), std::system_error);
}

TEST(Seqpacket, EveryParticipantReceivesAllOthersInOrder) {
  const std::string path = freshPath("hub");
  BusOptions fd;
  fd.fd = true;
  SeqpacketHub hub(path, fd);
  SeqpacketBus a(path, fd), b(path, fd);
  test::Random random(test::baseSeed());
  SCOPED_TRACE(test::trace(test::baseSeed()));
  std::vector<CanFrame> sent, incoming(256);
  for (int k = 0; k < 200; ++k)
    sent.push_back(test::randomFrame(random, true));
  ASSERT_EQ(a.send(std::span(sent).first(100)), 100u);
  ASSERT_EQ(hub.receive(incoming), 100u);
  EXPECT_EQ(hub.peers(), 2u);
  ASSERT_TRUE(waitFor(b));
  ASSERT_EQ(b.receive(incoming), 100u);
  for (std::size_t k = 0; k < 100; ++k) {
    EXPECT_TRUE(sameOnWire(incoming[k], sent[k])) << k;
    EXPECT_GT(incoming[k].time, 0);
  }
  EXPECT_EQ(a.receive(incoming), 0u) << "no node receives its own frames";
  ASSERT_EQ(hub.send(std::span(sent).last(100)), 100u);
  EXPECT_EQ(a.receive(incoming), 100u);
  EXPECT_EQ(b.receive(incoming), 100u);
}

TEST(Seqpacket, ComesBackWithTheHub) {
  const std::string path = freshPath("restart");
  auto hub = std::make_unique<SeqpacketHub>(path);
  EXPECT_THROW(SeqpacketHub{path}, std::system_error) << "two hubs at one path";
  SeqpacketBus bus(path);
  std::array<CanFrame, 4> frames;
  const CanFrame one = makeFrame(1, {});
  hub->receive(frames);
  hub.reset();
  EXPECT_EQ(bus.receive(frames), 0u);
  EXPECT_EQ(bus.state(), BusState::kDown);
  EXPECT_TRUE(bus.faulty());
  EXPECT_EQ(bus.send({&one, 1}), 0u);
  EXPECT_EQ(bus.counters().tx_failed, 1u);
  hub = std::make_unique<SeqpacketHub>(path);
  const std::int64_t deadline = monotonicNow() + 5'000'000'000;
  while (bus.state() == BusState::kDown && monotonicNow() < deadline)
    bus.receive(frames);
  EXPECT_EQ(bus.state(), BusState::kActive);
  EXPECT_EQ(bus.send({&one, 1}), 1u);
  EXPECT_EQ(hub->receive(frames), 1u);
}

TEST(Seqpacket, AFullQueueDropsAndCounts) {
  const std::string path = freshPath("full");
  SeqpacketHub hub(path);
  SeqpacketBus bus(path);
  std::vector<CanFrame> burst(100, makeFrame(0x201, std::array<std::uint8_t, 6>{}));
  std::uint64_t asked = 0;
  for (int k = 0; k < 1000 && !bus.faulty(); ++k, asked += burst.size())
    bus.send(burst);
  EXPECT_TRUE(bus.faulty()) << "nobody fetches them";
  EXPECT_EQ(bus.counters().sent + bus.counters().tx_dropped, asked);
  std::uint64_t fetched = 0;
  for (std::size_t count = burst.size(); count == burst.size(); fetched += count)
    count = hub.receive(burst);
  EXPECT_EQ(fetched, bus.counters().sent) << "what was taken arrives";
  EXPECT_EQ(bus.send({burst.data(), 1}), 1u);
  EXPECT_FALSE(bus.faulty());
}

TEST(Seqpacket, WhatIsNoFrameIsCounted) {
  const std::string path = freshPath("invalid");
  SeqpacketHub hub(path);
  const int fd = socket(AF_UNIX, SOCK_SEQPACKET, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  ASSERT_EQ(connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  std::array<char, 200> bytes{};
  bytes[4] = 9;  // longer than a classical frame can be
  for (const std::size_t length : {1u, 15u, 16u, 17u, 71u, 73u, 200u})
    ASSERT_EQ(send(fd, bytes.data(), length, 0), static_cast<ssize_t>(length));
  std::array<CanFrame, 16> frames;
  EXPECT_EQ(hub.receive(frames), 0u);
  EXPECT_EQ(hub.counters().rx_invalid, 7u);
  close(fd);
}

}  // namespace
}  // namespace tandem::hal::can
