// SPDX-License-Identifier: Apache-2.0
#include "config/detail/hardware_guards.h"

namespace tandem::config {

int busOf(const Map& map, const std::vector<hal::BusConfig>& buses) {
  std::vector<std::string> names;
  for (const hal::BusConfig& bus : buses)
    names.push_back(bus.name);
  return static_cast<int>(map.indexAmong("bus", names, "one of the buses of this file"));
}

hal::TorqueLimit readTorqueLimit(const Map& drive) {
  if (!drive.has("torque_limit"))
    return {};
  const Map map = drive.map("torque_limit");
  auto torque = map.read<hal::TorqueLimit>();
  torque.limit = 1e-3 * map.number("limit_per_mille");
  return torque;
}

namespace {

/// One entry of `emergency_stop`, for one drive or all of its bus.
void readEmergencyInput(const Map& map, hal::HardwareConfig& hardware) {
  const int bus = busOf(map, hardware.buses);
  auto input = map.read<hal::EmergencyInput>();
  input.statusword = map.has("statusword_bit");
  if (input.statusword == map.has("input_bit"))
    map.fail("bus", std::string("found ") + (input.statusword ? "both input_bit and statusword_bit" : "neither") +
                        ", expected one of input_bit and statusword_bit");
  input.bit = map.integer(input.statusword ? "statusword_bit" : "input_bit");
  if (input.statusword && (input.bit == 5 || input.bit == 6))
    map.fail("statusword_bit", "found " + std::to_string(input.bit) +
                                   ", which is part of the drive's state, expected "
                                   "another one");
  const auto before = hardware.emergency_stop.size();
  for (std::size_t i = 0; i < hardware.axes.size(); ++i) {
    const hal::AxisConfig& axis = hardware.axes[i];
    if (axis.bus != bus || (map.has("node") && axis.node != map.integer("node")))
      continue;
    input.axis = static_cast<int>(i);
    hardware.emergency_stop.push_back(input);
  }
  if (hardware.emergency_stop.size() == before && map.has("node"))
    map.fail("node", "found " + map.text("node") + ", expected the node of a drive on bus '" + map.text("bus") + "'");
  if (hardware.emergency_stop.size() == before)
    map.fail("bus", "found '" + map.text("bus") + "', which has no drive in this file, expected a bus with a drive");
}

}  // namespace

void readEmergencyStop(const Map& map, hal::HardwareConfig& hardware) {
  if (!map.has("emergency_stop"))
    return;
  for (const Map& entry : map.maps("emergency_stop"))
    readEmergencyInput(entry, hardware);
}

}  // namespace tandem::config
