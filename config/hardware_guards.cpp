// SPDX-License-Identifier: Apache-2.0
#include "config/hardware_guards.h"

#include <algorithm>

namespace tandem::config {

hal::PowerlessHold readPowerlessHold(const Map& drive) {
  const std::string word = drive.text("holds_without_power");
  if (word == "self_locking")
    return hal::PowerlessHold::kSelfLocking;
  return word == "brake" ? hal::PowerlessHold::kBrake : hal::PowerlessHold::kNo;
}

hal::TorqueLimit readTorqueLimit(const Map& drive) {
  hal::TorqueLimit torque;
  if (!drive.has("torque_limit"))
    return torque;
  const Map map = drive.map("torque_limit");
  torque.object = map.text("object") == "current" ? 0x6078 : 0x6077;
  torque.limit = 1e-3 * map.number("limit_per_mille");
  torque.time = map.number("time");
  return torque;
}

namespace {

/// One entry of `emergency_stop`, for one drive or all of its bus.
void readEmergencyInput(const Map& map, hal::HardwareConfig& hardware) {
  const auto bus = std::find_if(hardware.buses.begin(), hardware.buses.end(),
                                [&](const hal::BusConfig& b) { return b.name == map.text("bus"); });
  if (bus == hardware.buses.end())
    map.fail("bus", "found '" + map.text("bus") + "', expected one of the buses of this file");
  hal::EmergencyInput input;
  input.statusword = map.has("statusword_bit");
  if (input.statusword == map.has("input_bit"))
    map.fail("bus", std::string("found ") + (input.statusword ? "both input_bit and statusword_bit" : "neither") +
                        ", expected one of input_bit and statusword_bit");
  input.bit = map.integer(input.statusword ? "statusword_bit" : "input_bit");
  if (input.statusword && (input.bit == 5 || input.bit == 6))
    map.fail("statusword_bit", "found " + std::to_string(input.bit) +
                                   ", which is part of the drive's state, expected "
                                   "another one");
  input.active_low = map.text("active") == "low";
  const auto before = hardware.emergency_stop.size();
  for (std::size_t i = 0; i < hardware.axes.size(); ++i) {
    const hal::AxisConfig& axis = hardware.axes[i];
    if (axis.bus != bus - hardware.buses.begin() || (map.has("node") && axis.node != map.integer("node")))
      continue;
    input.axis = static_cast<int>(i);
    hardware.emergency_stop.push_back(input);
  }
  if (hardware.emergency_stop.size() == before)
    map.fail(map.has("node") ? "node" : "bus", "found no drive there, expected the node of a drive of this file");
}

}  // namespace

void readEmergencyStop(const Map& map, hal::HardwareConfig& hardware) {
  if (!map.has("emergency_stop"))
    return;
  for (const Map& entry : map.maps("emergency_stop"))
    readEmergencyInput(entry, hardware);
}

}  // namespace tandem::config
