// SPDX-License-Identifier: Apache-2.0
#include "services/hal/bus_setup.h"

#include <spdlog/spdlog.h>

#include <filesystem>
#include <stdexcept>

#include "hal/can/link.h"
#include "hal/cia402/canopen_bus.h"
#include "services/runtime/periodic_loop.h"

namespace tandem::hal_service {
namespace {

constexpr std::string_view kCan = "can:";
/// Queue length for the frames of one cycle and a burst of parameter access.
constexpr std::uint32_t kQueueLength = 64;

void checkLink(const hal::BusConfig& bus) {
  if (!bus.address.starts_with(kCan))
    return;
  const auto link = hal::can::findLink(bus.address.substr(kCan.size()));
  if (!link)
    return;
  if (link->bit_rate && static_cast<double>(*link->bit_rate) != bus.bit_rate) {
    const std::string wanted = std::to_string(static_cast<std::uint32_t>(bus.bit_rate));
    throw std::invalid_argument("bus " + bus.name + ": found " + link->name + " at " + std::to_string(*link->bit_rate) +
                                " bit/s, expected the " + wanted + " bit/s of the hardware file; `ip link set " +
                                link->name + " down`, then `ip link set " + link->name + " up type can bitrate " +
                                wanted + "`, or change the bit rate in the file");
  }
  if (link->restart_ms.value_or(0) != 0)
    spdlog::warn(
        "bus {}: {} restarts by itself {} ms after bus-off, although drives may have stopped by then; `ip link set {} "
        "type can restart-ms 0` leaves the restart to tandem-hal",
        bus.name, link->name, *link->restart_ms, link->name);
  if (link->queue_length < kQueueLength)
    spdlog::warn("bus {}: {} has a transmit queue of {}; `ip link set {} txqueuelen {}` avoids dropped frames",
                 bus.name, link->name, link->queue_length, link->name, kQueueLength);
}

}  // namespace

hal::HardwareConfig loadHardwareOf(const runtime::Setup& setup) {
  const config::Deployment& deployment = setup.deployment;
  const auto refuse = [&](const std::string& key, const std::string& message) {
    throw config::Error(deployment.file.string(), 0, 0, key, message);
  };
  if (deployment.hardware.empty())
    refuse("hardware", "found none, expected a hardware file: tandem-hal needs one");
  if (deployment.clock != config::ClockMode::kRealTime)
    refuse("clock", "found lock_step, expected real_time: drives run in real time only");
  hal::HardwareConfig hardware = config::loadHardware(deployment.hardware, deployment.budgets.drive_heartbeat);
  std::error_code ignored;
  if (!std::filesystem::equivalent(hardware.robot_file, deployment.robot, ignored))
    refuse("hardware",
           "found one for robot " + hardware.robot_file + ", expected one for " + deployment.robot.string());
  if (hardware.period > deployment.control_period)
    refuse("control_period", "found " + std::to_string(deployment.control_period) +
                                 " s, expected at least the period of the buses in the hardware file, " +
                                 std::to_string(hardware.period) + " s");
  return hardware;
}

std::vector<std::unique_ptr<hal::Fieldbus>> openBuses(const hal::HardwareConfig& hardware,
                                                      const safety::Budgets& budgets,
                                                      const runtime::StopSignal& stop,
                                                      double timeout) {
  constexpr double kRetry = 0.1;  // s
  std::vector<std::unique_ptr<hal::Fieldbus>> buses;
  const std::int64_t deadline = runtime::monotonicNow() + static_cast<std::int64_t>(1e9 * timeout);
  for (const hal::BusConfig& bus : hardware.buses) {
    checkLink(bus);
    for (bool reported = false;; reported = true) {
      try {
        const int index = static_cast<int>(buses.size());
        if (hal::inLibrary(bus))
          buses.push_back(openLibrary(hardware, index));
        else
          buses.push_back(std::make_unique<hal::CanopenBus>(hal::can::openBus(bus.address), hardware, index, budgets));
        break;
      } catch (const std::exception& error) {
        if (runtime::monotonicNow() > deadline)
          throw std::runtime_error("bus " + bus.name + ": " + error.what());
        if (!reported)
          spdlog::info("bus {}: waiting for {} ({})", bus.name, bus.address, error.what());
      }
      if (stop.waitFor(kRetry))
        return {};
    }
  }
  return buses;
}

}  // namespace tandem::hal_service
