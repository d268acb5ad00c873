// SPDX-License-Identifier: Apache-2.0
#include "services/hal/bus_claim.h"

#include <spdlog/spdlog.h>

#include "services/hal/hal_events.h"
#include "services/runtime/periodic_loop.h"

namespace tandem::hal_service {

std::vector<hal::can::BusLock> lockBuses(const hal::HardwareConfig& hardware) {
  std::vector<hal::can::BusLock> locks;
  for (const hal::BusConfig& bus : hardware.buses) {
    if (hal::inLibrary(bus))
      continue;
    try {
      locks.emplace_back(bus.address);
    } catch (const hal::can::BusTaken& taken) {
      throw runtime::ResourceInUse(nameOf(bus) + ": " + taken.what() + "; stop it first: a bus has one master");
    }
  }
  return locks;
}

bool waitForSilentBus(HalCore& core, const runtime::StopSignal& stop) {
  constexpr double kRound = 0.01;  // s
  const hal::RobotHardware& robot = core.robot();
  spdlog::info("listening for another master for {:.1f} s, number of buses: {}", robot.listeningTime(),
               robot.busCount());
  const std::int64_t end = runtime::monotonicNow() + static_cast<std::int64_t>(1e9 * robot.listeningTime());
  for (std::int64_t now = runtime::monotonicNow(); now < end; now = runtime::monotonicNow()) {
    core.listen(now);
    if (stop.waitFor(kRound))
      return false;
  }
  core.listen(runtime::monotonicNow());
  for (int b = 0; b < robot.busCount(); ++b) {
    const std::string masters = robot.bus(b).otherMasters();
    const hal::BusConfig& bus = robot.config().buses[static_cast<std::size_t>(b)];
    if (!masters.empty())
      throw runtime::ResourceInUse(nameOf(bus) + ": another master is active: received " + masters +
                                   "; stop the other tandem-hal or master first. No frame was sent");
  }
  return true;
}

}  // namespace tandem::hal_service
