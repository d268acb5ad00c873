// SPDX-License-Identifier: Apache-2.0
/** @file The load of a bus as the HAL measures it, against the one that `tandem can budget` plans. */
#include "robot_fixture.h"

namespace tandem::hal::test {
namespace {

/// Both count the longest frames. The plan has all SDO requests that it permits; a run has those that it needs.
TEST(BusLoad, MeasuredInOperationIsThePlannedOneWithoutUnusedRequests) {
  const HardwareConfig hardware = presetHardware();
  System system(hardware);
  ASSERT_TRUE(system.boot());
  ASSERT_TRUE(system.enable());
  system.move(0, speeds(-1e-3, 0.05));
  std::vector<double> bits(system.wires.size());
  for (std::size_t b = 0; b < bits.size(); ++b)
    system.wires[b]->bus.tap = [&bits, b](const can::CanFrame& f) { bits[b] += frameBits(static_cast<int>(f.length)); };
  constexpr double kTime = 3.0;
  system.run(kTime);
  for (int b = 0; b < static_cast<int>(hardware.buses.size()); ++b) {
    BusPlan plan = hardware.planOf(b, safety::Budgets{}.drive_heartbeat);
    const double planned = computeLoad(plan).load;
    std::erase_if(plan.streams, [](const FrameStream& stream) { return stream.what.starts_with("SDO"); });
    const double without_requests = computeLoad(plan).load;
    const double measured = system.robot->bus(b).load();
    constexpr double kEdge = 0.005;  // a heartbeat more or less in the second that is measured
    EXPECT_LE(measured, planned + kEdge) << hardware.buses[static_cast<std::size_t>(b)].name;
    EXPECT_NEAR(measured, bits[static_cast<std::size_t>(b)] / kTime / plan.bit_rate, kEdge) << "of the frames";
    EXPECT_GE(measured, without_requests - kEdge) << hardware.buses[static_cast<std::size_t>(b)].name;
  }
}

}  // namespace
}  // namespace tandem::hal::test
