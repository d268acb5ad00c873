// SPDX-License-Identifier: Apache-2.0
/** @file SDO configuration of drives and encoders, written and read back in state pre-operational. */
#pragma once

#include <array>
#include <cstdint>

#include "hal/canopen/node.h"
#include "hal/hardware.h"

namespace tandem::hal {

/// Objects that more than one part of the HAL knows.
namespace objects {
inline constexpr canopen::ObjectAddress kControlword{0x6040, 0};
inline constexpr canopen::ObjectAddress kStatusword{0x6041, 0};
inline constexpr canopen::ObjectAddress kPosition{0x6064, 0};
inline constexpr canopen::ObjectAddress kTargetPosition{0x607A, 0};
inline constexpr canopen::ObjectAddress kTargetVelocity{0x60FF, 0};
inline constexpr canopen::ObjectAddress kTorque{0x6077, 0};
inline constexpr canopen::ObjectAddress kCurrent{0x6078, 0};
inline constexpr canopen::ObjectAddress kInputs{0x60FD, 0};
inline constexpr std::uint16_t kAdditionalPosition = 0x60E4;  ///< of further encoders, from sub-index 1
inline constexpr canopen::ObjectAddress kEncoderPosition{0x6004, 0};
inline constexpr canopen::ObjectAddress kEncoderAlarms{0x6503, 0};
inline constexpr canopen::ObjectAddress kMode{0x6060, 0};
inline constexpr canopen::ObjectAddress kModeDisplay{0x6061, 0};
inline constexpr canopen::ObjectAddress kLowerLimit{0x607D, 1};
inline constexpr canopen::ObjectAddress kUpperLimit{0x607D, 2};
inline constexpr canopen::ObjectAddress kOutputs{0x60FE, 1};
inline constexpr canopen::ObjectAddress kOutputMask{0x60FE, 2};
inline constexpr canopen::ObjectAddress kVelocityUnit{0x60A9, 0};
inline constexpr canopen::ObjectAddress kAccelerationUnit{0x60AA, 0};
inline constexpr canopen::ObjectAddress kIncrements{0x608F, 1};
/// Factors of position, velocity and acceleration, numerators and divisors, in the order of StatedFactors.
inline constexpr canopen::ObjectAddress kFactors[] = {kIncrements, {0x608F, 2}, {0x6091, 1}, {0x6091, 2}, {0x6092, 1},
                                                      {0x6092, 2}, {0x6096, 1}, {0x6096, 2}, {0x6097, 1}, {0x6097, 2}};
inline constexpr canopen::ObjectAddress kMaxTorque{0x6072, 0};
inline constexpr canopen::ObjectAddress kHomingMethod{0x6098, 0};
inline constexpr std::uint16_t kHomingMethods = 0x60E3;  ///< the supported ones, from sub-index 1
}  // namespace objects

/// @param value_of gives the value of an object; 0: absent
template <class ValueOf>
StatedFactors factorsFrom(const ValueOf& value_of) {
  std::array<std::uint32_t, std::size(objects::kFactors)> read{};
  for (std::size_t k = 0; k < read.size(); ++k)
    read[k] = static_cast<std::uint32_t>(value_of(objects::kFactors[k]));
  return {{read[0], read[1]}, {read[2], read[3]}, {read[4], read[5]}, {read[6], read[7]}, {read[8], read[9]}};
}

/// Setup of a drive. @param heartbeat_budget its time-out for the HAL's heartbeat, s.
canopen::NodeSetup driveSetup(const HardwareConfig& hardware, const AxisConfig& axis, double heartbeat_budget);

/// Setup of an absolute encoder; the axis must have one that is a node.
canopen::NodeSetup encoderSetup(const HardwareConfig& hardware, const AxisConfig& axis, double heartbeat_budget);

}  // namespace tandem::hal
