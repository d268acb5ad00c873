// SPDX-License-Identifier: Apache-2.0
/** @file A master and simulated drives on one bus, in simulated time. */
#pragma once

#include <gtest/gtest.h>

#include "hal/can/virtual_bus.h"
#include "hal/canopen/network.h"
#include "sim/drives/drive_bus.h"

namespace tandem::test {

inline constexpr std::int64_t kMillisecond = 1'000'000;
inline constexpr std::int64_t kBusPeriod = 4 * kMillisecond;
inline constexpr std::uint32_t kRigSerial = 1000;  ///< + node id

/// Nodes 1..drives, and an encoder 16 + k on each.
inline sim::drives::BusSpec rigSpec(int drives, bool encoders = true) {
  sim::drives::BusSpec spec;
  for (int k = 1; k <= drives; ++k) {
    sim::drives::DriveSpec drive;
    drive.id = static_cast<std::uint8_t>(k);
    drive.serial = kRigSerial + drive.id;
    spec.drives.push_back(drive);
    if (encoders) {
      sim::drives::EncoderSpec encoder;
      encoder.id = static_cast<std::uint8_t>(16 + k);
      encoder.serial = kRigSerial + encoder.id;
      encoder.drive = drive.id;
      spec.encoders.push_back(encoder);
    }
  }
  return spec;
}

/** Slots of the drives' PDOs. */
enum RigSlot { kControl = 0, kTarget = 1, kStatus = 0, kActual = 1 };

/// A drive in a cyclic mode (8: position, 9: velocity) or another one, monitored from both sides.
inline hal::canopen::NodeSetup driveSetup(int id, int mode = 8) {
  using namespace hal::canopen;
  NodeSetup setup;
  setup.id = static_cast<std::uint8_t>(id);
  setup.name = "axis " + std::to_string(id);
  setup.steps = identitySteps({0x00020192, 0, 0x402, 0, kRigSerial + static_cast<std::uint32_t>(id)});
  for (auto& step : guardingSteps({127, 100, 25, 0}))
    setup.steps.push_back(step);
  for (const auto direction : {PdoDirection::kReceive, PdoDirection::kTransmit}) {
    for (auto& step : pdoOffSteps(2, direction, id))
      setup.steps.push_back(step);
  }
  setup.steps.push_back(write({0x6007, 0}, 3, 2, "abort connection option"));
  setup.steps.push_back(write({0x60C2, 1}, 4, 1, "interpolation period"));
  setup.steps.push_back(write({0x6060, 0}, mode, 1, "mode"));
  PdoConfig command, feedback;
  command.event_timer = 50;
  command.layout.add({{0x6040, 0}, 16});
  command.layout.add({{static_cast<std::uint16_t>(mode == 9 ? 0x60FF : 0x607A), 0}, 32});
  feedback.layout.add({{0x6041, 0}, 16});
  feedback.layout.add({{0x6064, 0}, 32});
  setup.rpdos = {command};
  setup.tpdos = {feedback};
  return setup;
}

inline hal::canopen::NodeSetup encoderSetup(int id) {
  using namespace hal::canopen;
  NodeSetup setup;
  setup.id = static_cast<std::uint8_t>(id);
  setup.name = "encoder " + std::to_string(id);
  setup.steps = identitySteps({0x00020196, 0, 0x406, 0, kRigSerial + static_cast<std::uint32_t>(id)});
  for (auto& step : guardingSteps({127, 100, 25, 0}))
    setup.steps.push_back(step);
  for (auto& step : pdoOffSteps(1, PdoDirection::kTransmit, id))
    setup.steps.push_back(step);
  PdoConfig feedback;
  feedback.number = 2;
  feedback.layout.add({{0x6004, 0}, 32});
  feedback.layout.add({{0x6503, 0}, 16});
  setup.tpdos = {feedback};
  return setup;
}

/** Bus, drives and master. The master sends RPDOs and SYNC each kBusPeriod. */
struct DriveRig {
  hal::can::VirtualBus wire{4096};
  std::int64_t now = 1'000 * kMillisecond;
  hal::can::VirtualBus::Port& drive_port = wire.join("drives");
  hal::can::VirtualBus::Port& master_port = wire.join("master");
  sim::drives::DriveBus drives;
  hal::canopen::Network network;
  bool alive = true;      ///< the master runs
  bool setpoints = true;  ///< the master sends RPDOs
  bool stalled = false;   ///< the process of the drives is not scheduled

  explicit DriveRig(const sim::drives::BusSpec& spec)
      : drives(drive_port, spec, now), network(master_port, hal::canopen::NetworkOptions{}) {}
  explicit DriveRig(int count, int mode = 8, bool encoders = true) : DriveRig(rigSpec(count, encoders)) {
    for (int k = 1; k <= count; ++k)
      network.addNode(driveSetup(k, mode));
    for (int k = 1; k <= count && encoders; ++k)
      network.addNode(encoderSetup(16 + k));
  }

  /// One bus period; the master's part between the drives' polls.
  template <class Body>
  void cycle(Body body) {
    for (std::int64_t k = 0; k < kBusPeriod; k += kMillisecond) {
      now += kMillisecond;
      wire.now = now;
      poll();
      if (!alive)
        continue;
      network.receive(now);
      if (k == 0) {
        body();
        network.transmit(now, {setpoints, true});
      } else {
        network.transmit(now);
      }
      poll();
    }
  }
  void poll() {
    if (!stalled)
      drives.poll(now);
  }
  void cycle() {
    cycle([] {});
  }
  void run(double seconds) {
    for (const std::int64_t end = now + static_cast<std::int64_t>(1e9 * seconds); now < end;)
      cycle();
  }
  /// Cycles until a condition is met; false after `seconds`.
  template <class Condition>
  bool until(Condition condition, double seconds = 5.0) {
    for (const std::int64_t end = now + static_cast<std::int64_t>(1e9 * seconds); now < end; cycle()) {
      if (condition())
        return true;
    }
    return condition();
  }

  sim::drives::Drive& drive(int index = 0) { return *drives.drives()[static_cast<std::size_t>(index)]; }
  sim::drives::Encoder& encoder(int index = 0) { return *drives.encoders()[static_cast<std::size_t>(index)]; }
  hal::canopen::Rpdo& command(int index = 0) { return network.node(index).rpdos()[0]; }
  hal::canopen::Tpdo& feedback(int index = 0) { return network.node(index).tpdos()[0]; }
  std::uint16_t status(int index = 0) { return static_cast<std::uint16_t>(feedback(index).get(kStatus)); }

  /// Boots and starts all nodes.
  bool bringUp() {
    using hal::canopen::NodePhase;
    network.setHeartbeat(true);
    network.bootAll(now);
    if (!until([&] { return network.all(NodePhase::kConfigured) || network.anyFailed(); }) || network.anyFailed())
      return false;
    network.startAll(now);
    return until([&] { return network.all(NodePhase::kOperational); });
  }

  /// Brings one drive to "operation enabled", with its target at the present position.
  bool enable(int index = 0) {
    for (const std::uint16_t word : {0x0006, 0x0007, 0x000F}) {
      command(index).set(kTarget, network.node(index).setup().rpdos[0].layout[1].object.index == 0x607A
                                      ? feedback(index).getSigned(kActual)
                                      : 0);
      command(index).set(kControl, word);
      const auto expected = static_cast<std::uint16_t>(word == 0x0006 ? 0x21 : word == 0x0007 ? 0x23 : 0x27);
      if (!until([&] { return (status(index) & 0x6F) == expected; }, 0.2))
        return false;
    }
    return true;
  }
  bool ready(int mode_index = 0) { return bringUp() && enable(mode_index); }

  /// Reads or writes an object of a running node.
  std::uint64_t read(int index, hal::canopen::ObjectAddress object) {
    auto& sdo = network.node(index).sdo();
    sdo.upload(object, now);
    EXPECT_TRUE(until([&] { return !sdo.busy(); }, 1.0));
    EXPECT_EQ(sdo.status(), hal::canopen::SdoStatus::kDone) << describe(object) << ": " << describe(sdo.abort());
    return sdo.value();
  }
  hal::canopen::SdoAbort write(int index, hal::canopen::ObjectAddress object, std::int64_t value, int size) {
    auto& sdo = network.node(index).sdo();
    sdo.download(object, static_cast<std::uint64_t>(value), size, now);
    EXPECT_TRUE(until([&] { return !sdo.busy(); }, 1.0));
    return sdo.abort();
  }
};

}  // namespace tandem::test
