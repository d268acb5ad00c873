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
  system.run(3.0);
  for (int b = 0; b < static_cast<int>(hardware.buses.size()); ++b) {
    BusPlan plan = hardware.planOf(b, safety::Budgets{}.drive_heartbeat);
    const double planned = computeLoad(plan).load;
    std::erase_if(plan.streams, [](const FrameStream& stream) { return stream.what.starts_with("SDO"); });
    const double without_requests = computeLoad(plan).load;
    const double measured = system.robot->bus(b).load();
    constexpr double kEdge = 0.005;  // a heartbeat more or less in the second that is measured
    EXPECT_LE(measured, planned + kEdge) << hardware.buses[static_cast<std::size_t>(b)].name;
    EXPECT_GE(measured, without_requests - kEdge) << hardware.buses[static_cast<std::size_t>(b)].name;
  }
}

}  // namespace
}  // namespace tandem::hal::test
