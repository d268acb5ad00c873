// SPDX-License-Identifier: Apache-2.0
/** @file File with the last positions of all axes, for the plausibility of absolute positions after a restart.
 *
 * One line per axis, its revision and a check sum at the end. It is written to another name, synced, and renamed: a
 * reader finds the old or the new file, never a part of one. Reading and writing block: not for the periodic path. */
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "hal/hardware.h"
#include "hal/position_memory.h"

namespace tandem::hal {

/// Hash of everything in the hardware file that turns the counts of an axis into its position: with another one, a
/// stored position says nothing.
std::uint64_t conversionRevision(const AxisConfig& axis);

/** Contents of the file: one entry for each axis. */
struct StoredPositions {
  struct One {
    LastPosition state = LastPosition::kMissing;
    double position = 0.0;  ///< m or rad, if the state is kKnown
  };
  std::vector<One> axes;  ///< in the order of HardwareConfig::axes
  std::string problem;    ///< empty, or why the file is damaged: with file, line, what was found and expected
};
/// Never throws for what the file contains: a damaged file makes every position LastPosition::kDamaged.
StoredPositions readPositions(const std::filesystem::path& file, const HardwareConfig& hardware);

/// Replaces the file; its folder is created. Axes that are not known are left out. @throw std::system_error
void writePositions(const std::filesystem::path& file,
                    const HardwareConfig& hardware,
                    const PositionSnapshot& positions);

}  // namespace tandem::hal
