// SPDX-License-Identifier: Apache-2.0
#include "config/axis_block.h"

#include <yaml-cpp/yaml.h>

#include <cstdio>
#include <stdexcept>

#include "config/detail/drive_profile.h"
#include "config/detail/loaders.h"
#include "config/file_tables.h"

namespace tandem::config {
namespace {

/// Place of an axis in a file: keys and indices.
struct Place {
  const char* kind;  ///< "translations"
  std::size_t group, axis;
};

Place findAxis(const YAML::Node& text,
               const std::filesystem::path& file,
               const hal::HardwareConfig& hardware,
               const hal::AxisConfig& of) {
  const std::string& bus = hardware.buses.at(static_cast<std::size_t>(of.bus)).name;
  const char* kind = of.translation ? "translations" : "rotations";
  const YAML::Node& groups = text[kind];
  for (std::size_t g = 0; g < groups.size(); ++g) {
    for (std::size_t a = 0; a < groups[g]["axes"].size(); ++a) {
      const YAML::Node& axis = groups[g]["axes"][a];
      if (axis["bus"].as<std::string>("") == bus && axis["node"].as<int>(0) == of.node)
        return {kind, g, a};
    }
  }
  throw std::runtime_error(file.string() + ": found no axis with bus " + bus + " and node " + std::to_string(of.node) +
                           ", expected that of " + of.name);
}

void setIdentity(YAML::Node drive, const char* key, std::uint32_t number) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%08X", number);
  if (number == 0) {
    drive.remove(key);
  } else {
    drive[key] = text;
  }
}

void setUnit(YAML::Node drive,
             const std::string& key,
             const std::array<const char*, hal::kRateUnits.size()>& words,
             hal::RateUnit unit,
             double scale) {
  drive[key] = words[static_cast<std::size_t>(unit)];
  drive.remove(key + "_scale");
  if (scale != 1.0)
    drive[key + "_scale"] = scale;
}

AxisOrigin originIn(const Map& drive, const std::filesystem::path& file) {
  AxisOrigin origin;
  if (drive.has("profile"))
    origin.profile = loadDriveProfile(companionPath(drive, "profile", file, "drive"));
  origin.states_velocity_unit = drive.has("velocity_unit") || (origin.profile && origin.profile->states_velocity_unit);
  origin.states_acceleration_unit =
      drive.has("acceleration_unit") || (origin.profile && origin.profile->states_acceleration_unit);
  return origin;
}

}  // namespace

AxisOrigin originOf(const std::filesystem::path& file, const hal::HardwareConfig& hardware, std::size_t axis) {
  const Place place = findAxis(YAML::LoadFile(file.string()), file, hardware, hardware.axes.at(axis));
  Document document(file.string(), readFile(file));
  return originIn(document.check(hardwareTable()).maps(place.kind)[place.group].map("drive"), file);
}

std::string axisBlock(const std::filesystem::path& file,
                      const hal::HardwareConfig& hardware,
                      std::size_t axis,
                      const hal::AxisConfig& drive,
                      const std::string& mode,
                      const std::vector<std::string>& fill_in) {
  const hal::AxisConfig& from = hardware.axes.at(axis);
  const YAML::Node text = YAML::LoadFile(file.string());
  const Place place = findAxis(text, file, hardware, from);
  YAML::Node old_group = YAML::Clone(text[place.kind][place.group]), old_axis = old_group["axes"][place.axis];
  YAML::Node of_group = old_group["drive"];
  setIdentity(of_group, "vendor", drive.identity.vendor);
  setIdentity(of_group, "product", drive.identity.product);
  setIdentity(of_group, "revision", drive.identity.revision);
  if (drive.mode != from.mode)
    of_group["mode"] = mode;
  setUnit(of_group, "velocity_unit", hal::kVelocityUnits, drive.units.velocity, drive.units.velocity_scale);
  setUnit(of_group, "acceleration_unit", hal::kAccelerationUnits, drive.units.acceleration,
          drive.units.acceleration_scale);
  for (const std::string& key : fill_in)
    of_group[key] = kFillIn;
  if (drive.watch != from.watch)
    of_group["watch"] = drive.watch == hal::MutualWatch::kNodeGuarding ? "node_guarding" : "heartbeat";
  if (drive.pdo_objects != from.pdo_objects)
    of_group["pdo_objects"] = drive.pdo_objects;
  if (drive.temperature_index == 0) {
    of_group.remove("temperature_object");
    of_group.remove("temperature_scale");
  }
  old_axis["node"] = drive.node;
  old_axis.remove("serial");  // of the drive that is replaced
  of_group.SetStyle(YAML::EmitterStyle::Block);
  old_axis.SetStyle(YAML::EmitterStyle::Block);
  YAML::Node group;
  group["drive"] = of_group;
  if (old_group["encoder"])
    group["encoder"] = old_group["encoder"];
  group["axes"].push_back(old_axis);
  YAML::Node block;
  block[place.kind].push_back(group);
  YAML::Emitter out;
  out << block;
  return std::string(out.c_str()) + "\n";
}

std::string withDirectionsReversed(const std::filesystem::path& file,
                                   const hal::HardwareConfig& hardware,
                                   const std::vector<const hal::AxisConfig*>& axes) {
  YAML::Node text = YAML::LoadFile(file.string());
  // Relative paths are meant from the folder of the file.
  text["robot"] = hardware.robot_file;
  for (const char* kind : {"translations", "rotations"}) {
    for (YAML::Node group : text[kind]) {
      const std::string profile = group["drive"]["profile"].as<std::string>("");
      if (const auto beside = file.parent_path() / profile; !profile.empty() && std::filesystem::exists(beside))
        group["drive"]["profile"] = std::filesystem::absolute(beside).lexically_normal().string();
    }
  }
  for (const hal::AxisConfig* axis : axes) {
    const Place place = findAxis(text, file, hardware, *axis);
    YAML::Node found = text[place.kind][place.group]["axes"][place.axis];
    found["reversed"] = !axis->gearing.reversed;
    if (axis->encoder)
      found["encoder_reversed"] = !axis->encoder->gearing.reversed;
  }
  YAML::Emitter out;
  out << text;
  return std::string(out.c_str()) + "\n";
}

}  // namespace tandem::config
