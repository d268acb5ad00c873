// SPDX-License-Identifier: Apache-2.0
#include "services/cli/can/import_axis.h"

#include <algorithm>
#include <cstdio>
#include <tuple>

namespace tandem::cli {
namespace {

using hal::canopen::Eds;
using hal::canopen::EdsObject;

/// Takes the units that the sheet states; names the objects with which a drive chooses other ones, and units that
/// nobody states.
std::vector<std::string> chooseUnits(const Eds& sheet,
                                     const config::AxisOrigin& origin,
                                     hal::AxisConfig& drive,
                                     std::vector<std::string>& notes) {
  std::vector<std::string> unknown;
  const auto from_file = [&](bool stated, const std::string& key, const std::string& what, const char* unit) {
    if (!stated)
      unknown.push_back(key);
    notes.push_back(what + (stated ? std::string(": ") + unit +
                                         ", of the hardware file or its profile: the data sheet "
                                         "does not state the unit"
                                   : ": neither the data sheet nor the hardware file nor a profile states the unit: "
                                     "fill in " +
                                         key + " by the drive's manual. This report assumes " + unit));
  };
  const auto stated = [&](std::uint16_t index) {
    const EdsObject* object = sheet.find({index, 0});
    return object != nullptr && object->has_value ? static_cast<std::uint32_t>(object->value) : 0u;
  };
  hal::DriveUnits& units = drive.units;
  if (const auto unit = hal::unitOfVelocityCode(stated(0x60A9))) {
    std::tie(units.velocity, units.velocity_scale) = *unit;
    notes.push_back("velocities: " + std::string(hal::kVelocityUnits[static_cast<std::size_t>(unit->first)]) +
                    " (60A9 = " + hexadecimal(stated(0x60A9)) + ")");
  } else {
    from_file(origin.states_velocity_unit, "velocity_unit", "velocities",
              hal::kVelocityUnits[static_cast<std::size_t>(units.velocity)]);
  }
  if (const auto unit = hal::unitOfAccelerationCode(stated(0x60AA))) {
    std::tie(units.acceleration, units.acceleration_scale) = *unit;
    notes.push_back("accelerations: " + std::string(hal::kAccelerationUnits[static_cast<std::size_t>(unit->first)]) +
                    " (60AA = " + hexadecimal(stated(0x60AA)) + ")");
  } else {
    from_file(origin.states_acceleration_unit, "acceleration_unit", "accelerations",
              hal::kAccelerationUnits[static_cast<std::size_t>(units.acceleration)]);
  }
  std::string others;
  for (const std::uint16_t index : {0x6091, 0x6092, 0x6096, 0x6097}) {
    char text[24];
    std::snprintf(text, sizeof text, "%04X", index);
    if (sheet.hasIndex(index))
      others += (others.empty() ? "" : ", ") + std::string(text);
  }
  if (!others.empty())
    notes.push_back("the drive can have other units (" + others +
                    "): compare its manual with velocity_unit and acceleration_unit of the axis");
  return unknown;
}

/// Takes the largest number of objects in one PDO that the sheet permits.
void choosePdoObjects(const Eds& sheet, hal::AxisConfig& drive, std::vector<std::string>& notes) {
  int most = 8;
  for (const std::uint16_t index : {0x1600, 0x1A00}) {
    const EdsObject* count = sheet.find({index, 0});
    int entries = 0;
    while (entries < most && sheet.find({index, static_cast<std::uint8_t>(entries + 1)}) != nullptr)
      ++entries;
    if (count != nullptr && count->high)
      entries = static_cast<int>(std::min<std::int64_t>(entries, *count->high));
    most = std::max(1, std::min(most, entries));
  }
  drive.pdo_objects = most;
  if (most < 8)
    notes.push_back("PDOs: at most " + std::to_string(most) + (most == 1 ? " object" : " objects") +
                    " in each (1600, 1A00)");
}

/// Node guarding where the drive cannot watch a heartbeat.
void chooseWatch(const Eds& sheet, hal::AxisConfig& drive, std::vector<std::string>& notes) {
  const auto has = [&](std::uint16_t index) { return sheet.hasIndex(index); };
  const bool guarding = !has(0x1016) && has(0x100C) && has(0x100D);
  drive.watch = guarding ? hal::MutualWatch::kNodeGuarding : hal::MutualWatch::kHeartbeat;
  if (guarding)
    notes.push_back("the drive has no heartbeat consumer (1016) but node guarding (100C, 100D)");
}

}  // namespace

std::string hexadecimal(std::uint64_t value) {
  char text[24];
  std::snprintf(text, sizeof text, "0x%llX", static_cast<unsigned long long>(value));
  return text;
}

std::vector<std::string> takeFromSheet(const Eds& sheet,
                                       const config::AxisOrigin& origin,
                                       hal::AxisConfig& drive,
                                       std::vector<std::string>& notes) {
  std::vector<std::string> unknown = chooseUnits(sheet, origin, drive, notes);
  choosePdoObjects(sheet, drive, notes);
  chooseWatch(sheet, drive, notes);
  return unknown;
}

void judgeMaker(const config::DriveProfile& profile, Eds& sheet) {
  const std::string expected = ", expected that of profile " + profile.name + " (" + profile.model + "): ";
  const auto warn = [&](std::size_t line, const std::string& text) { sheet.warnings.push_back({line, text}); };
  const EdsObject* object = sheet.find({0x1018, 1});
  if (profile.vendor != 0 && object != nullptr && object->has_value && object->value != profile.vendor)
    warn(object->line, "object 1018:01: found vendor " + hexadecimal(static_cast<std::uint32_t>(object->value)) +
                           expected + hexadecimal(profile.vendor));
  if (profile.vendor != 0 && sheet.vendor && *sheet.vendor != 0 && *sheet.vendor != profile.vendor)
    warn(sheet.vendor_line,
         "VendorNumber: found " + hexadecimal(*sheet.vendor) + expected + hexadecimal(profile.vendor));
  const auto compare = [&](const char* key, const std::string& found, std::size_t line,
                           const std::vector<std::string>& words) {
    const bool named = std::ranges::any_of(words, [&](const std::string& word) {
      return hal::canopen::lowerCase(found).find(hal::canopen::lowerCase(word)) != std::string::npos;
    });
    std::string list;
    for (const std::string& word : words)
      list += (list.empty() ? "" : " or ") + word;
    if (line != 0 && !words.empty() && !named)
      warn(line, std::string(key) + ": found '" + found + "'" + expected + list);
  };
  compare("VendorName", sheet.vendor_name, sheet.vendor_name_line, profile.makers);
  compare("ProductName", sheet.product, sheet.product_line, profile.products);
  std::ranges::stable_sort(sheet.warnings, {}, &hal::canopen::FileWarning::line);
}

void judgeCounts(const hal::AxisConfig& drive, const hal::SheetCheck& check, std::vector<std::string>& notes) {
  if (check.counts)
    notes.push_back("by default the drive states " + hal::describeCounts(*check.counts, drive.gearing) + ": " +
                    (drive.checks_counts ? "tandem-hal refuses to boot it until counts_per_revolution or the drive "
                                           "is corrected"
                                         : "tandem-hal logs that (checks_counts: false)"));
}

void judgeProfile(const hal::AxisConfig& drive, hal::ProtectionMask lost, std::vector<std::string>& notes) {
  if (!drive.foretold)
    return;
  if (const hal::ProtectionMask more = lost & ~*drive.foretold; more != 0)
    notes.push_back("the profile of " + drive.name + " does not say that the drive lacks " +
                    hal::describeProtections(more) + ", as its data sheet does");
  if (const hal::ProtectionMask fewer = *drive.foretold & ~lost; fewer != 0)
    notes.push_back("the profile of " + drive.name + " says that the drive may lack " +
                    hal::describeProtections(fewer) + "; by its data sheet it does not in this mode");
}

}  // namespace tandem::cli
