// SPDX-License-Identifier: Apache-2.0
/** @file Text of one axis for a hardware file: the axis of an existing file with another drive or direction. */
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/drive_profile.h"
#include "hal/hardware.h"

namespace tandem::config {

/** Sources of an axis' values in its hardware file. */
struct AxisOrigin {
  std::optional<DriveProfile> profile;  ///< that its group names
  /// The group or the profile states the unit; otherwise the axis has the default.
  bool states_velocity_unit = false, states_acceleration_unit = false;
};
/// @param file, hardware, axis as of axisBlock(). @throw Error if the file has changed meanwhile.
AxisOrigin originOf(const std::filesystem::path& file, const hal::HardwareConfig& hardware, std::size_t axis);

/// Value of a key that somebody has to fill in: validation refuses it.
inline constexpr const char* kFillIn = "FILL_IN";

/** A group with this axis alone, as YAML: the keys and values of the file, with the node and the identity of `drive`,
 * its units, its mode if it is not the file's, and its temperature object only if it has one. The text ends inside the
 * mapping of the axis: lines indented by eight blanks may follow.
 * @param file, hardware the hardware file and what it contains. @param axis index in hardware.axes
 * @param mode "csp", "csv" or "pv". @param fill_in  keys of `drive` that get kFillIn
 * @throw std::runtime_error if the file has changed meanwhile. */
std::string axisBlock(const std::filesystem::path& file,
                      const hal::HardwareConfig& hardware,
                      std::size_t axis,
                      const hal::AxisConfig& drive,
                      const std::string& mode,
                      const std::vector<std::string>& fill_in = {});

/// The hardware file with `reversed` of these axes, and `encoder_reversed` if they have encoders, turned round; without
/// its comments. @throw std::runtime_error if the file has changed meanwhile.
std::string withDirectionsReversed(const std::filesystem::path& file,
                                   const hal::HardwareConfig& hardware,
                                   const std::vector<const hal::AxisConfig*>& axes);

}  // namespace tandem::config
