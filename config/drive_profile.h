// SPDX-License-Identifier: Apache-2.0
/** @file Drive profiles: models of drives as data (`tandem: drive/1`), which hardware files name with `profile`. */
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "hal/drives/protections.h"
#include "hal/drives/sdo_write.h"
#include "hal/drives/units.h"

namespace tandem::config {

/** One fact of a drive profile, and where it is written. */
struct DriveFact {
  std::string fact;
  std::string source;  ///< "assumed": nowhere
};

/** A model of drive. */
struct DriveProfile {
  /// The best that it was tried with.
  enum class Tried : std::uint8_t { kDataSheet = 0, kSimulated, kReal };

  std::string name;
  std::string model;  ///< maker, model, firmware
  Tried tried = Tried::kDataSheet;
  std::vector<std::string> modes;      ///< "csp", "csv", "pv"
  std::vector<hal::Protection> lacks;  ///< protections
  hal::DriveUnits units;
  std::vector<hal::SdoWrite> sdo;
  std::vector<DriveFact> facts;
};

/// @throw Error with all violations.
DriveProfile loadDriveProfile(const std::filesystem::path& file);

/// Table of the profiles in a folder, in Markdown: the section of docs/hardware.md.
std::string triedWith(const std::filesystem::path& folder);

}  // namespace tandem::config
