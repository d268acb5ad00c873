// SPDX-License-Identifier: Apache-2.0
/** @file Random and mutated frames over a real socket: nothing crashes, nothing moves, every frame is accounted for.
 *
 * TANDEM_FUZZ_FRAMES sets how many frames each test sends (default 60 000), TANDEM_TEST_SEED where they begin. */
#include <gtest/gtest.h>
#include <unistd.h>

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

CanFrame anyFrame(test::Random& random) {
  return random.chance(0.25) ? test::randomFrame(random) : mutate(plausibleFrame(random), random);
}

std::string freshPath(const char* name) {
  return testing::TempDir() + "tandem-fuzz-" + name + "-" + std::to_string(getpid());
}

/// Whether a frame could enable or move a drive: what only a commander that means it may do.
bool commandsPower(const CanFrame& frame) {
  const bool sdo = frame.id > 0x600 && frame.id < 0x680;
  const bool rpdo = frame.id > 0x200 && frame.id < 0x580 && (frame.id & 0x80) == 0;
  const bool start = frame.id == 0 && frame.length == 2 && frame.data[0] == 1;
  return frame.classicData() && (sdo || rpdo || start);
}

TEST(Fuzz, DrivesStandWhateverComes) {
  const std::string path = freshPath("drives");
  can::SeqpacketHub hub(path);
  can::SeqpacketBus attacker(path);
  std::int64_t now = 1'000'000'000;
  sim::drives::DriveBus drives(hub, test::rigSpec(6), now);
  test::Random random(test::baseSeed());
  SCOPED_TRACE(test::trace(test::baseSeed()));
  std::array<CanFrame, 256> answers;
  std::uint64_t sent = 0;
  for (int k = 0; k < frameCount(); ++k) {
    CanFrame frame = anyFrame(random);
    // Frames that command power are somebody's command, not noise: their effect is not the fuzzer's business here.
    if (commandsPower(frame))
      frame.length = static_cast<std::uint8_t>(random.integer(0, frame.id == 0 ? 1 : 3));
    sent += attacker.send({&frame, 1});
    if (k % 64 == 0) {
      now += test::kMillisecond;
      drives.poll(now);
      while (attacker.receive(answers) == answers.size()) {
      }
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
  test::Random random(test::baseSeed() + 1);
  SCOPED_TRACE(test::trace(test::baseSeed()));
  std::array<CanFrame, 256> answers;
  std::uint64_t sent = 0, heard = 0;
  for (int k = 0; k < frameCount(); ++k) {
    const CanFrame frame = anyFrame(random);
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
      for (std::size_t count = answers.size(); count == answers.size(); heard += count)
        count = attacker.receive(answers);
    }
  }
  drives.poll(now += test::kMillisecond);
  for (std::size_t count = answers.size(); count == answers.size(); heard += count)
    count = attacker.receive(answers);
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
  test::Random random(test::baseSeed() + 2);
  SCOPED_TRACE(test::trace(test::baseSeed()));
  network.bootAll(now);
  std::array<CanFrame, 256> unused;
  int reached = 0;
  for (int k = 0; k < frameCount(); ++k) {
    CanFrame frame = anyFrame(random);
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
    while (attacker.receive(unused) == unused.size()) {
    }
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

}  // namespace
}  // namespace tandem::hal
