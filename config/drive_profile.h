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

/** A homing method with a number of the manufacturer's (6098 below 0): a run against a mechanical stop. */
struct VendorHoming {
  int method = 0;
  bool positive = false;  ///< direction of the drive in which the stop is
  bool index = false;     ///< ends at the first index pulse behind the stop
  std::string source;
};

/** A model of drive. */
struct DriveProfile {
  /// The best that it was tried with.
  enum class Tried : std::uint8_t { kDataSheet = 0, kSimulated, kReal };

  std::string name;
  std::string model;                          ///< maker, model, firmware
  std::uint32_t vendor = 0;                   ///< number of the maker, object 1018:1; 0: of any
  std::vector<std::string> makers, products;  ///< words of which a data sheet has one in VendorName, in ProductName
  Tried tried = Tried::kDataSheet;
  std::vector<std::string> modes;      ///< "csp", "csv", "pv"
  std::vector<hal::Protection> lacks;  ///< protections
  hal::DriveUnits units;
  bool states_velocity_unit = false, states_acceleration_unit = false;  ///< else `units` has the defaults
  std::vector<hal::SdoWrite> sdo;
  std::vector<VendorHoming> homing_methods;
  std::vector<DriveFact> facts;
};

/// @throw Error with all violations.
DriveProfile loadDriveProfile(const std::filesystem::path& file);

/// Table of the profiles in a folder, in Markdown: the section of docs/hardware.md.
std::string triedWith(const std::filesystem::path& folder);

}  // namespace tandem::config
