// SPDX-License-Identifier: Apache-2.0
/** @file Axes of a hardware file with other drives or directions, as text for a hardware file. */
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "hal/hardware.h"

namespace tandem::config {

/** A group with this axis alone, as YAML: the keys and values of the file, with the node and the identity of `drive`,
 * its units, its mode if it is not the file's, and its temperature object only if it has one. The text ends inside the
 * mapping of the axis: lines indented by eight blanks may follow.
 * @param file, hardware the hardware file and what it contains. @param axis index in hardware.axes
 * @param mode "csp", "csv" or "pv"
 * @throw std::runtime_error if the file has changed meanwhile. */
std::string axisBlock(const std::filesystem::path& file,
                      const hal::HardwareConfig& hardware,
                      std::size_t axis,
                      const hal::AxisConfig& drive,
                      const std::string& mode);

/// The hardware file with `reversed` of these axes, and `encoder_reversed` if they have encoders, turned round; without
/// its comments. @throw std::runtime_error if the file has changed meanwhile.
std::string withDirectionsReversed(const std::filesystem::path& file,
                                   const hal::HardwareConfig& hardware,
                                   const std::vector<const hal::AxisConfig*>& axes);

}  // namespace tandem::config
