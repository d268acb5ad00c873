// SPDX-License-Identifier: Apache-2.0
/** @file Frames of a foreign node on an operational bus, with a master and simulated drives, one of them enabled: every
 * frame is accounted for, positions stay finite, every failed node has a reason, and describes it. Commands for fault
 * injection come with them. */
#include "tests/fuzz/harness.h"
#include "tests/unit/support/drive_rig.h"

using namespace tandem;
using fuzz::expect;

namespace {

const sim::drives::BusSpec& spec() {
  static const sim::drives::BusSpec shared = test::rigSpec(2);  // parses the data sheets once
  return shared;
}

/// One frame: two bytes of identifier and length, then the payload.
hal::can::CanFrame take(fuzz::Input& input) {
  const auto head = input.number<std::uint16_t>();
  std::array<std::uint8_t, 8> payload{};
  const std::size_t length = std::min<std::size_t>(head >> 11, 8);
  for (std::size_t k = 0; k < length; ++k)
    payload[k] = input.number<std::uint8_t>();
  hal::can::CanFrame frame = hal::can::makeFrame(head & 0x7FF, {payload.data(), length});
  frame.remote = head >> 11 == 9;
  frame.extended = head >> 11 == 10;
  frame.error = head >> 11 == 11;
  return frame;
}

void judge(test::DriveRig& rig) {
  const auto& counters = rig.network.counters();
  expect(counters.total() == counters.received, "every received frame is counted once");
  for (const auto& drive : rig.drives.drives())
    expect(std::isfinite(drive->position()), "a drive's position is finite");
  for (int k = 0; k < rig.network.nodeCount(); ++k) {
    auto& node = rig.network.node(k);
    if (node.phase() == hal::canopen::NodePhase::kFailed) {
      expect(!node.describeFailure().empty(), "a failure has a text");
      rig.network.boot(k, rig.now);
    }
  }
}

void inject(test::DriveRig& rig, std::string_view line) {
  try {
    const auto command = sim::drives::parseFaultCommand(std::string(line));
    if (command.kind == sim::drives::FaultCommand::Kind::kInject) {
      expect(std::abs(command.injection.value) <= 1e9 && command.injection.duration <= 1e6,
             "an injected fault has a value and a duration that can be counted in ns", std::string(line));
      rig.drives.inject(command.injection);
    }
  } catch (const std::invalid_argument& error) {
    expect(std::strlen(error.what()) > 0, "a refused command has a reason");
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, std::min<std::size_t>(size, 4096));
  const std::string_view command = input.upTo('\n');
  test::DriveRig rig(spec());
  auto& attacker = rig.wire.join("attacker");
  for (int k = 1; k <= 2; ++k) {
    rig.network.addNode(test::driveSetup(k));
    rig.network.addNode(test::encoderSetup(16 + k));
  }
  expect(rig.ready(), "an undisturbed bus is operational, with an enabled drive");
  inject(rig, command);
  while (!input.empty()) {
    for (int k = 0; k < 4 && !input.empty(); ++k) {
      const hal::can::CanFrame frame = take(input);
      attacker.send({&frame, 1});
    }
    rig.network.startAll(rig.now);
    rig.cycle();
    judge(rig);
  }
  return 0;
}
