// SPDX-License-Identifier: Apache-2.0
/** @file Objects that the HAL exchanges with a drive in every period, and their distribution over its PDOs. */
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hal/hardware.h"

namespace tandem::hal {

/** One object in the PDOs of a drive. */
struct CyclicObject {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  int bits = 0;
};

/// Controlword and target, in the order of the PDOs.
std::vector<CyclicObject> commandObjects(const AxisConfig& axis);
/// Statusword, position, and what else the hardware file asks for, in the order of the PDOs.
std::vector<CyclicObject> feedbackObjects(const HardwareConfig& hardware, const AxisConfig& axis);

/// The objects of each PDO, in order: as many as fit into eight bytes, and at most so many objects.
std::vector<std::vector<CyclicObject>> packPdos(const std::vector<CyclicObject>& objects, int most_objects);

/// Adds the PDOs that these objects need to the numbers of PDOs by their length.
void countFrames(std::array<double, 9>& frames, const std::vector<CyclicObject>& objects, int most_objects);

}  // namespace tandem::hal
