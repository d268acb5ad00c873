// SPDX-License-Identifier: Apache-2.0
/** @file Random and mutated frames over a real socket: no crash, no motion, every frame counted.
 *
 * Each test begins with every 11-bit identifier at every length. By hand, a million frames per bus:
 *
 *     TANDEM_FUZZ_FRAMES=1000000 build/release/tests/test_hal_fuzz
 *     TANDEM_FUZZ_BUS=can:vcan0 build/release/tests/test_hal_fuzz   # an idle interface instead of a socket
 *
 * TANDEM_FUZZ_FRAMES sets how many frames each test sends (default 60 000), TANDEM_TEST_SEED where they begin. */
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "hal/can/clock.h"
#include "hal/can/detail/seqpacket.h"
#include "tests/unit/support/can_attack.h"
#include "tests/unit/support/drive_rig.h"

namespace tandem::hal {
namespace {

using can::CanFrame;

int frameCount() {
  const char* text = std::getenv("TANDEM_FUZZ_FRAMES");
  return text != nullptr ? std::atoi(text) : 60'000;
}

using test::Attack;
using test::drain;

/** A bus: a socket of the test, or the interface in TANDEM_FUZZ_BUS. The drives' end is created first. */
class Wire {
 public:
  explicit Wire(const char* name) : path_(testing::TempDir() + "tandem-fuzz-" + name + "-" + std::to_string(getpid())) {
    const char* address = std::getenv("TANDEM_FUZZ_BUS");
    interface_ = address != nullptr ? address : "";
    drives_ = can::openBus(interface_.empty() ? "unix-hub:" + path_ : interface_);
  }
  can::Bus& drives() { return *drives_; }
  can::Bus& join() { return *ends_.emplace_back(can::openBus(interface_.empty() ? "unix:" + path_ : interface_)); }
  /// Frames that an end lost because they were not read in time; all are counted.
  std::uint64_t lost() const {
    const auto* hub = dynamic_cast<const can::SeqpacketHub*>(drives_.get());
    std::uint64_t count = hub != nullptr ? hub->undelivered() : drives_->counters().rx_overflow;
    for (const auto& end : ends_)
      count += end->counters().rx_overflow;
    return count;
  }

 private:
  std::string path_, interface_;
  std::unique_ptr<can::Bus> drives_;
  std::vector<std::unique_ptr<can::Bus>> ends_;
};

TEST(Fuzz, DrivesStayAtStandstillUnderRandomFrames) {
  Wire wire("drives");
  can::Bus& attacker = wire.join();
  std::int64_t now = 1'000'000'000;
  sim::drives::DriveBus drives(wire.drives(), test::rigSpec(6), now);
  Attack attack(0);
  SCOPED_TRACE(test::trace(test::baseSeed()));
  std::uint64_t sent = 0;
  for (int k = 0; k < frameCount(); ++k) {
    CanFrame frame = attack.next();
    test::spoilDownload(frame, attack.random());
    test::spoilNmt(frame, attack.random(), false);
    sent += attacker.send({&frame, 1});
    if (k % 64 == 0) {
      now += test::kMillisecond;
      drives.poll(now);
      drain(attacker);
    }
  }
  drives.poll(now += test::kMillisecond);
  EXPECT_EQ(drives.record().received, sent);
  EXPECT_EQ(wire.drives().counters().received, sent);
  for (const auto& drive : drives.drives()) {
    EXPECT_EQ(drive->record().travel, 0.0) << "node " << int{drive->id()};
    EXPECT_NE(drive->state(), sim::drives::DriveState::kEnabled);
  }
}

TEST(Fuzz, DrivesSurviveCommandsToo) {
  Wire wire("commands");
  can::Bus& attacker = wire.join();
  std::int64_t now = 1'000'000'000;
  sim::drives::DriveBus drives(wire.drives(), test::rigSpec(6), now);
  Attack attack(1);
  test::Random& random = attack.random();
  SCOPED_TRACE(test::trace(test::baseSeed()));
  std::uint64_t sent = 0, received = 0;
  for (int k = 0; k < frameCount(); ++k) {
    const CanFrame frame = attack.next();
    sent += attacker.send({&frame, 1});
    if (random.chance(0.001)) {
      sim::drives::Injection injection;
      injection.kind = static_cast<sim::drives::FaultKind>(random.integer(0, sim::drives::kFaultKinds - 1));
      injection.node = static_cast<std::uint8_t>(random.chance(0.2) ? 0 : random.integer(1, 22));
      injection.duration = random.uniform(0.001, 0.05);
      drives.inject(injection);
    }
    if (k % 32 == 0) {
      now += test::kMillisecond;
      drives.poll(now);
      received += drain(attacker);
    }
  }
  drives.poll(now += test::kMillisecond);
  received += drain(attacker);
  EXPECT_EQ(drives.record().received, sent);
  EXPECT_EQ(drives.record().sent, wire.drives().counters().sent);
  EXPECT_LE(received, wire.drives().counters().sent);
  EXPECT_EQ(received + wire.lost(), wire.drives().counters().sent) << "every answer arrives or is counted";
  EXPECT_GT(received, 1000u);
  for (const auto& drive : drives.drives())
    EXPECT_TRUE(std::isfinite(drive->position()));
}

TEST(Fuzz, TheMasterAccountsForEveryFrame) {
  Wire wire("master");
  can::Bus &bus = wire.join(), &attacker = wire.join();
  std::int64_t now = 1'000'000'000;
  sim::drives::DriveBus drives(wire.drives(), test::rigSpec(6), now);
  canopen::Network network(bus);
  for (int k = 1; k <= 6; ++k) {
    network.addNode(test::driveSetup(k));
    network.addNode(test::encoderSetup(16 + k));
  }
  network.setHeartbeat(true);
  Attack attack(2);
  SCOPED_TRACE(test::trace(test::baseSeed()));
  network.bootAll(now);
  int reached = 0;
  for (int k = 0; k < frameCount(); ++k) {
    CanFrame frame = attack.next();
    test::spoilBusOff(frame);
    attacker.send({&frame, 1});
    if (k % 32 != 0)
      continue;
    now += test::kMillisecond;
    drives.poll(now);
    network.receive(now);
    for (int node = 0; node < network.nodeCount(); ++node) {
      reached += network.node(node).phase() == canopen::NodePhase::kConfigured;
      if (network.node(node).phase() == canopen::NodePhase::kFailed)
        network.boot(node, now);
    }
    network.startAll(now);
    network.transmit(now, {true, true});
    drain(attacker);
    canopen::NetworkEvent event;
    while (network.nextEvent(event)) {
      if (event.phase == canopen::NodePhase::kFailed && event.node >= 0) {
        EXPECT_FALSE(network.node(event.node).describeFailure().empty());
      }
    }
  }
  drives.poll(now += test::kMillisecond);
  network.receive(now);
  const canopen::NetworkCounters& counters = network.counters();
  EXPECT_EQ(counters.total(), counters.received);
  EXPECT_EQ(counters.received, bus.counters().received);
  EXPECT_EQ(wire.lost(), 0u);
  EXPECT_EQ(counters.received, wire.drives().counters().sent + attacker.counters().sent) << "what others sent";
  EXPECT_GT(reached, 0) << "nodes get through their configuration between attacks";
}

/** Operational drives with a master that repeats the same cycle, whatever it receives. */
class Operation {
 public:
  /// Boots, starts and enables all drives.
  bool enable() {
    canopen::Network network(bus_);
    for (int k = 1; k <= kDrives; ++k) {
      network.addNode(test::driveSetup(k));
      network.addNode(test::encoderSetup(16 + k));
    }
    network.setHeartbeat(true);
    network.bootAll(now_);
    const auto until = [&](auto condition) {
      for (int k = 0; k < 5000 && !condition(); ++k) {
        now_ += test::kMillisecond;
        drives_.poll(now_);
        network.receive(now_);
        const bool cycle = k % 4 == 0 && network.all(canopen::NodePhase::kOperational);
        network.transmit(now_, {cycle, cycle});
        drain(attacker_);
      }
      return condition();
    };
    if (!until([&] { return network.all(canopen::NodePhase::kConfigured); }))
      return false;
    network.startAll(now_);
    if (!until([&] { return network.all(canopen::NodePhase::kOperational); }))
      return false;
    for (const std::uint16_t word : {0x06, 0x07, 0x0F}) {
      for (int k = 0; k < kDrives; ++k) {
        auto& node = network.node(2 * k);
        node.rpdos()[0].set(test::kControl, word);
        node.rpdos()[0].set(test::kTarget, node.tpdos()[0].getSigned(test::kActual));
      }
      const std::uint64_t expected = word == 0x06 ? 0x21 : word == 0x07 ? 0x23 : 0x27;
      if (!until([&] {
            for (int k = 0; k < kDrives; ++k) {
              if ((network.node(2 * k).tpdos()[0].get(test::kStatus) & 0x6F) != expected)
                return false;
            }
            return true;
          }))
        return false;
    }
    for (int k = 0; k < kDrives; ++k) {
      const canopen::Rpdo& rpdo = network.node(2 * k).rpdos()[0];
      std::array<std::uint8_t, 6> bytes;
      for (std::size_t i = 0; i < bytes.size(); ++i)
        bytes[i] = static_cast<std::uint8_t>(rpdo.word >> (8 * i));
      cycle_.push_back(can::makeFrame(rpdo.id, bytes));
    }
    const std::array<std::uint8_t, 1> operational{5};
    cycle_.push_back(can::makeFrame(0x77F, operational));
    cycle_.push_back(can::makeFrame(0x80, {}));
    return true;
  }
  void send(const CanFrame& frame) { sent_ += attacker_.send({&frame, 1}); }
  void millisecond() {
    now_ += test::kMillisecond;
    if (++ticks_ % 4 == 0)
      sent_ += bus_.send(cycle_);
    drives_.poll(now_);
    drain(attacker_);
    drain(bus_);
  }
  sim::drives::DriveBus& drives() { return drives_; }
  std::uint64_t sent() const { return sent_; }

 private:
  static constexpr int kDrives = 6;
  std::int64_t now_ = 1'000'000'000;
  Wire wire_{"operation"};
  can::Bus& bus_ = wire_.join();
  can::Bus& attacker_ = wire_.join();
  sim::drives::DriveBus drives_{wire_.drives(), test::rigSpec(kDrives), now_};
  std::vector<CanFrame> cycle_;
  std::uint64_t sent_ = 0;
  int ticks_ = 0;
};

TEST(Fuzz, EnabledDrivesHoldUnderRandomFrames) {
  Operation operation;
  ASSERT_TRUE(operation.enable());
  for (int k = 0; k < 200; ++k)
    operation.millisecond();
  sim::drives::DriveBus& drives = operation.drives();
  std::vector<double> held;
  for (const auto& drive : drives.drives())
    held.push_back(drive->position());
  drives.mark();
  const std::uint64_t before = drives.record().received - operation.sent();
  Attack attack(3);
  SCOPED_TRACE(test::trace(test::baseSeed()));
  for (int k = 0; k < frameCount(); ++k) {
    CanFrame frame = attack.next();
    test::spoilDownload(frame, attack.random());
    test::spoilNmt(frame, attack.random(), true);
    test::spoilSetpoint(frame, attack.random());
    test::spoilBusOff(frame);
    operation.send(frame);
    if (k % 32 == 0)
      operation.millisecond();
  }
  operation.millisecond();
  EXPECT_EQ(drives.record().received, before + operation.sent());
  for (std::size_t k = 0; k < held.size(); ++k) {
    const sim::drives::Drive& drive = *drives.drives()[k];
    EXPECT_EQ(drive.state(), sim::drives::DriveState::kEnabled) << "node " << int{drive.id()};
    EXPECT_NEAR(drive.position(), held[k], 1e-6) << "counts";
    EXPECT_LT(drive.record().travel, 1e-3) << "counts";
    EXPECT_EQ(drive.record().faults, 0u);
  }
}

}  // namespace
}  // namespace tandem::hal
