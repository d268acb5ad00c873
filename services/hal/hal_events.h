// SPDX-License-Identifier: Apache-2.0
/** @file Log messages for hardware events. */
#pragma once

#include <map>
#include <string>

#include "hal/robot_hardware.h"
#include "services/dds/messages.h"
#include "services/runtime/diagnostics.h"

namespace tandem::hal_service {

/// "bus bus_a (can:can0)".
std::string nameOf(const hal::BusConfig& bus);

/** Description of an event for the log. Not for the periodic thread: it allocates. Reads only parts of the robot that
 * do not change after construction. */
std::string describe(const hal::HardwareEvent& event, const hal::RobotHardware& robot);

/// Protections that drives lack: "arm_a translation 1: command_deadline (1400:05); ..." or "none".
std::string describeLost(const hal::HardwareConfig& hardware, const dds::HalStatus& status);

/** Why drives and encoders have failed, as long as their axes are AxisPhase::kFailed. */
class DeviceFailures {
 public:
  void note(const hal::HardwareEvent& event, const std::string& text);
  /// Keys runtime::kFailedKey and the name of the axis.
  runtime::Details details(const hal::HardwareConfig& hardware, const dds::HalStatus& status) const;

 private:
  std::map<std::size_t, std::string> reasons_;  ///< by dds::jointIndex()
};

/// Whether the drive of an axis that is ready lacks a protection, or states what the hardware file does not say.
bool isRemarkable(const hal::HardwareEvent& event, const hal::RobotHardware& robot);

/// Whether an event needs the attention of an operator.
bool isProblem(const hal::HardwareEvent& event);

}  // namespace tandem::hal_service
