// SPDX-License-Identifier: Apache-2.0
#include "services/hal/bus_claim.h"

#include <spdlog/spdlog.h>

#include "services/hal/hal_events.h"
#include "services/runtime/periodic_loop.h"

namespace tandem::service {

std::vector<hal::can::BusLock> lockBuses(const hal::HardwareConfig& hardware) {
  std::vector<hal::can::BusLock> locks;
  for (const hal::BusConfig& bus : hardware.buses) {
    try {
      locks.emplace_back(bus.address);
    } catch (const hal::can::BusTaken& taken) {
      throw Occupied(nameOf(bus) + ": " + taken.what() + "; stop it first: a bus has one master");
    }
  }
  return locks;
}

bool listenFirst(HalCore& core, const StopSignal& stop) {
  constexpr double kRound = 0.01;  // s
  const hal::RobotHardware& robot = core.robot();
  spdlog::info("listening on {} buses for {} s: does somebody command them?", robot.busCount(), robot.listeningTime());
  const std::int64_t end = monotonicNow() + static_cast<std::int64_t>(1e9 * robot.listeningTime());
  for (std::int64_t now = monotonicNow(); now < end; now = monotonicNow()) {
    core.listen(now);
    if (stop.waitFor(kRound))
      return false;
  }
  core.listen(monotonicNow());
  for (int b = 0; b < robot.busCount(); ++b) {
    const hal::canopen::MasterWatch& masters = robot.network(b).masters();
    const hal::BusConfig& bus = robot.config().buses[static_cast<std::size_t>(b)];
    if (masters.heardAny())
      throw Occupied(nameOf(bus) + ": somebody else commands it: received " + masters.describe() +
                     "; stop the other tandem-hal, or whatever it is. Nothing was sent");
  }
  return true;
}

}  // namespace tandem::service
