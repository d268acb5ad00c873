// SPDX-License-Identifier: Apache-2.0
#include "services/cli/can/import_axis.h"

#include <algorithm>
#include <cstdio>
#include <tuple>

namespace tandem::cli {
namespace {

using hal::canopen::Eds;
using hal::canopen::EdsObject;

/// Takes the units that the sheet states; names the objects with which a drive chooses other ones.
void chooseUnits(const Eds& sheet, hal::AxisConfig& drive, std::vector<std::string>& notes) {
  const auto stated = [&](std::uint16_t index) {
    const EdsObject* object = sheet.find({index, 0});
    return object != nullptr && object->has_value ? static_cast<std::uint32_t>(object->value) : 0u;
  };
  hal::DriveUnits& units = drive.units;
  if (const auto unit = hal::unitOfVelocityCode(stated(0x60A9))) {
    std::tie(units.velocity, units.velocity_scale) = *unit;
    notes.push_back("velocities: " + std::string(hal::kVelocityUnits[static_cast<std::size_t>(unit->first)]) +
                    " (60A9 = " + hexadecimal(stated(0x60A9)) + ")");
  }
  if (const auto unit = hal::unitOfAccelerationCode(stated(0x60AA))) {
    std::tie(units.acceleration, units.acceleration_scale) = *unit;
    notes.push_back("accelerations: " + std::string(hal::kAccelerationUnits[static_cast<std::size_t>(unit->first)]) +
                    " (60AA = " + hexadecimal(stated(0x60AA)) + ")");
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

void takeFromSheet(const Eds& sheet, hal::AxisConfig& drive, std::vector<std::string>& notes) {
  chooseUnits(sheet, drive, notes);
  choosePdoObjects(sheet, drive, notes);
  chooseWatch(sheet, drive, notes);
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
