// SPDX-License-Identifier: Apache-2.0
/** @file Keys of a hardware file that a drive profile may give, and the profiles themselves. */
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "config/detail/yaml_reader.h"
#include "config/drive_profile.h"
#include "hal/drives/protections.h"
#include "hal/drives/sdo_write.h"

namespace tandem::config {

/// Fields of `drive` that belong to a model of drive rather than to an axis: units, identity, answers, `sdo`.
std::vector<Field> modelFields();
/// Reads the address of an object, INDEX:SUB; both keep their values if the key is absent.
void readObject(const Map& map, const std::string& name, std::uint16_t& index, std::uint8_t& sub);
/// Field `sdo`: what is written to a drive at boot, for a drive profile, the drives of a group, or one axis.
Field sdoField(const std::string& description);
/// Reads `sdo` of a mapping. @throw Error for an object that a hardware file may not write, or a value beyond its type.
std::vector<hal::SdoWrite> readSdo(const Map& map);

/** Values that the axes of a hardware file take from a profile besides the keys of `drive`. */
struct ProfileFacts {
  hal::ProtectionMask lacks = 0;
  std::vector<VendorHoming> homing_methods;
};
/// By the texts with which a hardware file names the profiles.
using FactsOfProfiles = std::map<std::string, ProfileFacts>;

/// Completes each `drive` of a checked hardware file by the profile that it names: keys that it has not, and the
/// profile's `sdo` before its own. @return false if no drive names one @throw Error for a profile that is not found,
/// or of the profile's own file.
bool completeDrives(const Map& hardware, const std::filesystem::path& file, FactsOfProfiles& facts);
/// Checks a hardware file and completes its drives. @throw Error as both do.
Map checkHardware(Document& document, const std::filesystem::path& file, FactsOfProfiles& facts);

}  // namespace tandem::config
