// SPDX-License-Identifier: Apache-2.0
/** @file Random and mutated frames over a real socket: nothing crashes, nothing moves, every frame is accounted for.
 *
 * Each test begins with every 11-bit identifier at every length. By hand, a million frames per bus:
 *
 *     TANDEM_FUZZ_FRAMES=1000000 build/release/tests/test_hal_fuzz
 *
 * TANDEM_FUZZ_FRAMES sets how many frames each test sends (default 60 000), TANDEM_TEST_SEED where they begin. */
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "hal/can/clock.h"
#include "hal/can/seqpacket.h"
#include "tests/unit/hal/random_frame.h"
#include "tests/unit/support/drive_rig.h"

namespace tandem::hal {
namespace {

using can::CanFrame;

int frameCount() {
  const char* text = std::getenv("TANDEM_FUZZ_FRAMES");
  return text != nullptr ? std::atoi(text) : 60'000;
}

/// What a bus of this system carries: a good starting point for bad frames.
CanFrame plausibleFrame(test::Random& random) {
  const int node = random.integer(1, 7) + (random.chance(0.3) ? 16 : 0);
  constexpr std::uint32_t kBases[] = {0x000, 0x080, 0x180, 0x200, 0x280, 0x300, 0x580, 0x600, 0x700, 0x77F};
  const int kind = random.integer(0, 9);
  CanFrame frame;
  frame.id = kBases[kind] + (kind == 0 || kind == 9 ? 0u : static_cast<std::uint32_t>(node));
  frame.length = static_cast<std::uint8_t>(kind >= 8 ? 1 : kind == 0 ? 2 : kind == 2 || kind == 3 ? 6 : 8);
  for (std::size_t k = 0; k < 8; ++k)
    frame.data[k] = static_cast<std::uint8_t>(random.integer(0, 255));
  if (kind == 6 || kind == 7) {  // an SDO to or from an object that may exist
    constexpr std::uint16_t kObjects[] = {0x1000, 0x1003, 0x1005, 0x1008, 0x1014, 0x1016, 0x1017, 0x1018, 0x1029,
                                          0x1400, 0x1600, 0x1800, 0x1A00, 0x6007, 0x6040, 0x6060, 0x605A, 0x607A,
                                          0x607D, 0x6085, 0x6098, 0x60C2, 0x60FF, 0x6003, 0x6200, 0x6000};
    const std::uint16_t index = kObjects[random.integer(0, 25)];
    frame.data[0] = static_cast<std::uint8_t>(random.chance(0.5) ? random.integer(0, 255)
                                                                 : (random.integer(0, 4) << 5 | random.integer(0, 15)));
    frame.data[1] = static_cast<std::uint8_t>(index);
    frame.data[2] = static_cast<std::uint8_t>(index >> 8);
    frame.data[3] = static_cast<std::uint8_t>(random.integer(0, 8));
  }
  return frame;
}

CanFrame mutate(CanFrame frame, test::Random& random) {
  switch (random.integer(0, 6)) {
    case 0:
      frame.length = static_cast<std::uint8_t>(random.integer(0, 8));
      break;
    case 1:
      frame.remote = true;
      break;
    case 2:
      frame.extended = true;
      break;
    case 3:
      frame.id ^= 1u << random.integer(0, 10);
      break;
    default:
      break;
  }
  return frame;
}

/** What is sent: first every 11-bit identifier at every length, then anything. */
class Attack {
 public:
  explicit Attack(std::uint32_t offset) : random_(test::baseSeed() + offset) {}
  CanFrame next() {
    if (swept_ < kSweep) {
      const int k = swept_++;
      std::array<std::uint8_t, can::kClassicLength> data;
      for (std::uint8_t& byte : data)
        byte = static_cast<std::uint8_t>(random_.integer(0, 255));
      return can::makeFrame(static_cast<std::uint32_t>(k / kLengths), {data.data(), std::size_t(k % kLengths)});
    }
    return random_.chance(0.25) ? test::randomFrame(random_) : mutate(plausibleFrame(random_), random_);
  }
  test::Random& random() { return random_; }

 private:
  static constexpr int kLengths = 9, kSweep = 0x800 * kLengths;
  test::Random random_;
  int swept_ = 0;
};

std::string freshPath(const char* name) {
  return testing::TempDir() + "tandem-fuzz-" + name + "-" + std::to_string(getpid());
}

// What only a commander that means it may send: its effect is not the fuzzer's business. Of such frames the fuzzer
// sends the beginning alone.

/// An SDO that writes, or goes on writing.
void spoilDownload(CanFrame& frame, test::Random& random) {
  if (frame.classicData() && frame.id > 0x600 && frame.id < 0x680 && frame.length == 8 && frame.data[0] >> 5 <= 1)
    frame.length = static_cast<std::uint8_t>(random.integer(0, 7));
}

/// A network command: any, or "start" alone.
void spoilNmt(CanFrame& frame, test::Random& random, bool any) {
  constexpr std::uint8_t kCommands[] = {1, 2, 128, 129, 130};
  const bool known = any ? std::ranges::count(kCommands, frame.data[0]) != 0 : frame.data[0] == 1;
  if (frame.classicData() && frame.id == 0 && frame.length == 2 && known)
    frame.length = static_cast<std::uint8_t>(random.integer(0, 1));
}

/// Controlword and target for one of the drives 1 to 6.
void spoilSetpoint(CanFrame& frame, test::Random& random) {
  if (frame.classicData() && frame.id > 0x200 && frame.id <= 0x206 && frame.length >= 6)
    frame.length = static_cast<std::uint8_t>(random.integer(0, 5));
}

/// Fetches and forgets. @return how many there were.
std::uint64_t drain(can::Bus& bus) {
  std::array<CanFrame, 256> frames;
  std::uint64_t all = 0;
  for (std::size_t count = frames.size(); count == frames.size(); all += count)
    count = bus.receive(frames);
  return all;
}

TEST(Fuzz, DrivesStandWhateverComes) {
  const std::string path = freshPath("drives");
  can::SeqpacketHub hub(path);
  can::SeqpacketBus attacker(path);
  std::int64_t now = 1'000'000'000;
  sim::drives::DriveBus drives(hub, test::rigSpec(6), now);
  Attack attack(0);
  SCOPED_TRACE(test::trace(test::baseSeed()));
  std::uint64_t sent = 0;
  for (int k = 0; k < frameCount(); ++k) {
    CanFrame frame = attack.next();
    spoilDownload(frame, attack.random());
    spoilNmt(frame, attack.random(), false);
    sent += attacker.send({&frame, 1});
    if (k % 64 == 0) {
      now += test::kMillisecond;
      drives.poll(now);
      drain(attacker);
    }
  }
  drives.poll(now += test::kMillisecond);
  EXPECT_EQ(drives.record().received, sent);
  EXPECT_EQ(hub.counters().received, sent);
  for (const auto& drive : drives.drives()) {
    EXPECT_EQ(drive->record().travel, 0.0) << "node " << int{drive->id()};
    EXPECT_NE(drive->state(), sim::drives::DriveState::kEnabled);
  }
}

TEST(Fuzz, DrivesSurviveCommandsToo) {
  const std::string path = freshPath("commands");
  can::SeqpacketHub hub(path);
  can::SeqpacketBus attacker(path);
  std::int64_t now = 1'000'000'000;
  sim::drives::DriveBus drives(hub, test::rigSpec(6), now);
  Attack attack(1);
  test::Random& random = attack.random();
  SCOPED_TRACE(test::trace(test::baseSeed()));
  std::uint64_t sent = 0, heard = 0;
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
      heard += drain(attacker);
    }
  }
  drives.poll(now += test::kMillisecond);
  heard += drain(attacker);
  EXPECT_EQ(drives.record().received, sent);
  EXPECT_EQ(drives.record().sent, hub.counters().sent);
  EXPECT_LE(heard, hub.counters().sent);
  EXPECT_EQ(heard + hub.undelivered(), hub.counters().sent) << "every answer arrives or is counted";
  EXPECT_GT(heard, 1000u);
  for (const auto& drive : drives.drives())
    EXPECT_TRUE(std::isfinite(drive->position()));
}

TEST(Fuzz, TheMasterAccountsForEveryFrame) {
  const std::string path = freshPath("master");
  can::SeqpacketHub hub(path);
  can::SeqpacketBus bus(path), attacker(path);
  std::int64_t now = 1'000'000'000;
  sim::drives::DriveBus drives(hub, test::rigSpec(6), now);
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
    // The drives' own controllers are not under attack, and neither is ours: bus-off would end the test.
    if (frame.error)
      frame.id &= 0x7u;
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
  EXPECT_EQ(hub.undelivered(), 0u);
  EXPECT_EQ(counters.received, hub.counters().sent + attacker.counters().sent) << "what others sent";
  EXPECT_GT(reached, 0) << "nodes get through their configuration between attacks";
}

/** Drives in operation, led by a master that sends the same cycle again and again, whatever it hears. */
class Operation {
 public:
  Operation() : hub_(path_), bus_(path_), attacker_(path_), drives_(hub_, test::rigSpec(kDrives), now_) {}

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
  std::string path_ = freshPath("operation");
  std::int64_t now_ = 1'000'000'000;
  can::SeqpacketHub hub_;
  can::SeqpacketBus bus_, attacker_;
  sim::drives::DriveBus drives_;
  std::vector<CanFrame> cycle_;
  std::uint64_t sent_ = 0;
  int ticks_ = 0;
};

TEST(Fuzz, EnabledDrivesHoldWhateverComes) {
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
    spoilDownload(frame, attack.random());
    spoilNmt(frame, attack.random(), true);
    spoilSetpoint(frame, attack.random());
    if (frame.error)
      frame.id &= 0x7u;  // bus-off is no garbage: the master falls silent, and the drives stop
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
