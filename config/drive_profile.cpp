// SPDX-License-Identifier: Apache-2.0
#include "config/detail/drive_profile.h"

#include <cstdlib>
#include <set>

#include "config/detail/bind.h"
#include "config/detail/device_identity.h"
#include "config/detail/loaders.h"
#include "config/drive_profile.h"
#include "config/file_tables.h"
#include "hal/hardware.h"

namespace tandem::config {
namespace {

using enum Quantity;
using hal::AxisConfig;
using hal::SdoWrite;

/// "u16": bytes, and whether the number has a sign.
struct NumberType {
  int size;
  bool is_signed;
  std::int64_t least() const { return is_signed ? -(std::int64_t{1} << (8 * size - 1)) : 0; }
  std::int64_t most() const { return (std::int64_t{1} << (8 * size - (is_signed ? 1 : 0))) - 1; }
};
NumberType typeOf(const std::string& word) { return {std::stoi(word.substr(1)) / 8, word.front() == 'i'}; }

/// The address of an object of a drive.
Field objectField(const std::string& name, const std::string& description) {
  return text(name, description).matching("^[0-9A-Fa-f]{4}:[0-9A-Fa-f]{1,2}$", "INDEX:SUB, hexadecimal").orInteger();
}

const Mapping& sdoTable() {
  static const Mapping table{
      "sdo_write",
      "One value that the HAL writes to a drive at boot, before everything that it writes by itself.",
      {
          objectField("object", "object of the drive; not one that commands it, or that the HAL's communication needs")
              .required(),
          text("type", "type of the number").oneOf({"u8", "u16", "u32", "i8", "i16", "i32"}).required(),
          text("value", "the number")
              .required()
              .orInteger()
              .matching("^(-?[0-9]{1,10}|0x[0-9A-Fa-f]{1,8})$", "a number, decimal or 0x..."),
          flag("read_back", "the value is read back and compared; false for objects that cannot be read",
               &SdoWrite::read_back),
          number("tolerance", kNone, "largest difference of the value that is read back: drives round")
              .within(0, 65535)
              .defaultsTo(0),
          flag("optional", "a drive without the object boots as well", &SdoWrite::optional),
          text("why", "what the value does; messages show it", &SdoWrite::why).required(),
      }};
  return table;
}

SdoWrite readWrite(const Map& map) {
  auto write = map.read<SdoWrite>();
  const std::string object = map.text("object"), value = map.text("value");
  readObject(map, "object", write.index, write.sub);
  const NumberType type = typeOf(map.text("type"));
  write.size = type.size;
  write.value = std::stoll(value, nullptr, value.starts_with("0x") ? 16 : 10);
  write.tolerance = static_cast<std::uint64_t>(map.number("tolerance"));
  if (const std::string reason = hal::forbidden(write); !reason.empty())
    map.fail("object", "found " + object + ", " + reason + "; expected an object that sets up the drive");
  if (write.value < type.least() || write.value > type.most())
    map.fail("value", "found " + value + ", expected " + std::to_string(type.least()) + " to " +
                          std::to_string(type.most()) + " (" + map.text("type") + ")");
  return write;
}

Words<hal::RateUnit> unitWords(const std::array<const char*, hal::kRateUnits.size()>& texts) {
  Words<hal::RateUnit> words;
  for (const hal::RateUnit unit : hal::kRateUnits)
    words.emplace_back(texts[static_cast<std::size_t>(unit)], unit);
  return words;
}

std::vector<Field> unitFields() {
  using hal::DriveUnits;
  return {
      text("velocity_unit", "unit of the objects with velocities: of the motor's shaft", unitWords(hal::kVelocityUnits),
           &AxisConfig::units, &DriveUnits::velocity),
      positive("velocity_unit_scale", kNone, "numbers in these objects per one of the unit: 1000 for thousandths",
               &AxisConfig::units, &DriveUnits::velocity_scale),
      text("acceleration_unit", "unit of the objects with accelerations", unitWords(hal::kAccelerationUnits),
           &AxisConfig::units, &DriveUnits::acceleration),
      positive("acceleration_unit_scale", kNone, "numbers in these objects per one of the unit", &AxisConfig::units,
               &DriveUnits::acceleration_scale),
  };
}

const Mapping& modelTable() {
  static const Mapping table{"drive_model", "Keys of `drive` of a hardware file, which its own keys replace.",
                             modelFields()};
  return table;
}

const Mapping& vendorHomingTable() {
  static const Mapping table{
      "vendor_homing",
      "A homing method (object 0x6098) with a number of the manufacturer's: a run against a mechanical stop, which the "
      "drive finds by its current or torque.",
      {
          integer("method", "number of the method", &VendorHoming::method).required().within(-128, -1),
          text("stop", "direction of the drive in which the stop is", {{"negative", false}, {"positive", true}},
               &VendorHoming::positive)
              .required(),
          flag("index", "ends at the first index pulse behind the stop", &VendorHoming::index),
          text("source", "manual, page or object that says so", &VendorHoming::source).required(),
      }};
  return table;
}

const Mapping& factTable() {
  static const Mapping table{
      "fact",
      "One fact of a drive profile.",
      {
          text("fact", "what the drive has, lacks or does", &DriveFact::fact).required(),
          text("source", "manual, page or object that says so; `assumed` if nothing does", &DriveFact::source)
              .required(),
      }};
  return table;
}

}  // namespace

std::vector<Field> modelFields() {
  std::vector<Field> fields{
      flag("reports_following",
           "in modes csp and csv, bit 12 of the statusword is 1 while the drive follows the target",
           &AxisConfig::reports_following),
      flag("checks_counts",
           "a drive that states other counts per revolution of its motor (608F, 6091, 6092) than counts_per_revolution "
           "is refused at boot; false: for drives that state something else there",
           &AxisConfig::checks_counts),
      number("sdo_timeout", kTime, "longest time for an answer to an SDO request", &AxisConfig::sdo_timeout)
          .within(0.02, 10.0),
      text("watch", "how the HAL and the drive notice each other's end: 1016 and 1017, or 100C and 100D",
           {{"heartbeat", hal::MutualWatch::kHeartbeat}, {"node_guarding", hal::MutualWatch::kNodeGuarding}},
           &AxisConfig::watch),
      integer("pdo_objects", "most objects that the drive takes in one PDO", &AxisConfig::pdo_objects).within(1, 8),
      integer(
          "negative_switch_bit",
          "bit of the digital inputs, object 0x60FD, that is 1 at the limit switch of the drive's negative direction "
          "(CiA 402: 0)",
          &AxisConfig::negative_switch)
          .within(0, 31)
          .defaultNote("not read"),
      integer("positive_switch_bit", "the same for its positive direction (CiA 402: 1)", &AxisConfig::positive_switch)
          .within(0, 31)
          .defaultNote("not read"),
      objectField("temperature_object", "object with a temperature, signed").defaultNote("none"),
      positive("temperature_scale", kNone, "degrees Celsius per unit of the temperature object",
               &AxisConfig::temperature_scale),
      sdoField("values written to these drives at boot, in this order"),
  };
  for (const Field& field : unitFields())
    fields.push_back(field);
  for (const Field& field : identityFields<AxisConfig>())
    fields.push_back(field);
  return fields;
}

void readObject(const Map& map, const std::string& name, std::uint16_t& index, std::uint8_t& sub) {
  if (!map.has(name))
    return;
  const std::string object = map.text(name);
  index = static_cast<std::uint16_t>(std::stoul(object.substr(0, 4), nullptr, 16));
  sub = static_cast<std::uint8_t>(std::stoul(object.substr(5), nullptr, 16));
}

Field sdoField(const std::string& description) {
  return mapping("sdo", sdoTable(), description).list(1, 64).defaultNote("none");
}

std::vector<SdoWrite> readSdo(const Map& map) {
  std::vector<SdoWrite> writes;
  if (map.has("sdo"))
    map.each("sdo", [&](const Map& entry) { writes.push_back(readWrite(entry)); });
  return writes;
}

const Mapping& driveTable() {
  Words<hal::Protection> protections;
  for (int k = 0; k < hal::kProtectionCount; ++k)
    protections.emplace_back(name(static_cast<hal::Protection>(k)), static_cast<hal::Protection>(k));
  static const Mapping table{
      "drive",
      "A model of drive: what a hardware file need not say again.",
      {
          kindField("drive"),
          text("name", "name of the profile", &DriveProfile::name).required(),
          text("model", "maker, model and firmware", &DriveProfile::model).required(),
          text("tried",
               "the best that the profile was tried with: only its data sheet, a simulation of it, or a real drive",
               {{"data_sheet", DriveProfile::Tried::kDataSheet},
                {"simulated", DriveProfile::Tried::kSimulated},
                {"real", DriveProfile::Tried::kReal}},
               &DriveProfile::tried)
              .required(),
          text("modes", "modes of `drive` that it can be used with", &DriveProfile::modes)
              .oneOf({"csp", "csv", "pv"})
              .list(1, 3)
              .required(),
          text("lacks", "protections that it does not have, in any of its modes (docs/hardware.md)", protections,
               &DriveProfile::lacks)
              .list(0, hal::kProtectionCount)
              .required(),
          deviceNumber("vendor",
                       "number of the maker, object 0x1018:1: `tandem can import` compares a data sheet with it",
                       &DriveProfile::vendor)
              .defaultNote("of any"),
          text("makers", "words of which VendorName of a data sheet has one, in capitals or not", &DriveProfile::makers)
              .list(1, 8)
              .defaultNote("of any"),
          text("products", "words of which ProductName of a data sheet has one", &DriveProfile::products)
              .list(1, 8)
              .defaultNote("any"),
          mapping("homing_methods", vendorHomingTable(),
                  "methods with negative numbers that a hardware file may use: all others are refused",
                  &DriveProfile::homing_methods)
              .list(1, 32)
              .defaultNote("none"),
          mapping("drive", modelTable(), "its keys").required(),
          mapping("facts", factTable(), "facts that the profile is based on", &DriveProfile::facts)
              .list(1, 32)
              .required(),
      }};
  return table;
}

namespace {

/// The profile in a checked document.
DriveProfile profileOf(const Map& map) {
  auto profile = map.read<DriveProfile>();
  const Map model = map.map("drive");
  AxisConfig axis;
  model.read(axis);
  profile.units = axis.units;
  profile.states_velocity_unit = model.has("velocity_unit");
  profile.states_acceleration_unit = model.has("acceleration_unit");
  profile.sdo = readSdo(model);
  return profile;
}

}  // namespace

DriveProfile loadDriveProfile(const std::filesystem::path& file) {
  Document document(file.string(), readFile(file));
  const Map map = document.check(driveTable());
  DriveProfile profile = profileOf(map);
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  readObject(map.map("drive"), "temperature_object", index, sub);
  document.finish();
  return profile;
}

namespace {

std::string triedText(DriveProfile::Tried tried) {
  switch (tried) {
    case DriveProfile::Tried::kDataSheet:
      return "data sheet";
    case DriveProfile::Tried::kSimulated:
      return "simulated from data sheet";
    case DriveProfile::Tried::kReal:
      return "real";
  }
  return "";
}

std::string unitText(const char* unit, double scale) {
  return std::string(unit) + (scale == 1.0 ? "" : " / " + formatNumber(scale));
}

std::string rowOf(const DriveProfile& profile) {
  std::vector<std::string> lacks;
  for (const hal::Protection protection : profile.lacks)
    lacks.emplace_back(name(protection));
  const auto unit = [](hal::RateUnit rate) { return static_cast<std::size_t>(rate); };
  return "| `" + profile.name + "` | " + profile.model + " | " + triedText(profile.tried) + " | " +
         join(profile.modes) + " | " +
         unitText(hal::kVelocityUnits[unit(profile.units.velocity)], profile.units.velocity_scale) + ", " +
         unitText(hal::kAccelerationUnits[unit(profile.units.acceleration)], profile.units.acceleration_scale) + " | " +
         (lacks.empty() ? "nothing" : join(lacks)) + " |\n";
}

}  // namespace

std::string triedWith(const std::filesystem::path& folder) {
  std::set<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    files.insert(entry.path());
  std::string rows =
      "| profile | drive | tried with | modes | velocities, accelerations | lacks |\n|---|---|---|---|---|---|\n";
  std::string facts = "| profile | fact | source |\n|---|---|---|\n";
  for (const std::filesystem::path& file : files) {
    const DriveProfile profile = loadDriveProfile(file);
    rows += rowOf(profile);
    for (const DriveFact& fact : profile.facts)
      facts += "| `" + profile.name + "` | " + fact.fact + " | " + fact.source + " |\n";
  }
  return rows + "\n" + facts;
}

bool completeDrives(const Map& hardware, const std::filesystem::path& file, FactsOfProfiles& facts) {
  bool completed = false;
  for (const char* list : {"translations", "rotations"}) {
    for (const Map& group : hardware.maps(list)) {
      const Map drive = group.map("drive");
      if (!drive.has("profile"))
        continue;
      const std::filesystem::path of = companionPath(drive, "profile", file, "drive");
      Document document(of.string(), readFile(of));
      const Map map = document.check(driveTable());
      const DriveProfile profile = profileOf(map);
      drive.indexAmong("mode", profile.modes, join(profile.modes, " or ") + ": " + profile.model + " has no other");
      ProfileFacts& known = facts[drive.text("profile")];
      for (const hal::Protection protection : profile.lacks)
        known.lacks |= hal::bit(protection);
      known.homing_methods = profile.homing_methods;
      group.complete("drive", map.map("drive"));
      completed = true;
    }
  }
  return completed;
}

Map checkHardware(Document& document, const std::filesystem::path& file, FactsOfProfiles& facts) {
  const Map map = document.check(hardwareTable());
  return completeDrives(map, file, facts) ? document.check(hardwareTable()) : map;
}

}  // namespace tandem::config
