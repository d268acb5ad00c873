// SPDX-License-Identifier: Apache-2.0
#include "services/drive_sim/bus_spec.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <stdexcept>
#include <vector>

#include "hal/drives/units.h"

namespace tandem::drive_sim {
namespace {

using sim::drives::DriveSpec;
using sim::drives::EncoderSpec;

constexpr std::uint32_t kSerialBase = 1000;
constexpr double kFall = 0.5, kRotationFall = 5.0;  // m/s^2, rad/s^2

double toNumber(const std::string& text, const std::string& what, double low, double high) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size() || !(value >= low && value <= high))
    throw std::invalid_argument(
        fmt::format("{}: found '{}', expected a number from {:.10g} to {:.10g}", what, text, low, high));
  return value;
}

std::uint8_t toNode(const std::string& text) {
  const double id = toNumber(text, "node", 1, 127);
  if (id != std::floor(id))
    throw std::invalid_argument("node: found '" + text + "', expected an integer from 1 to 127");
  return static_cast<std::uint8_t>(id);
}

std::uint32_t toSerial(const std::string& text) {
  return static_cast<std::uint32_t>(toNumber(text, "serial", 0, 4294967295.0));
}

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

using Setters = std::map<std::string, std::function<void(const std::string&)>>;

void apply(const std::vector<std::string>& parts, const Setters& setters) {
  for (std::size_t k = 1; k < parts.size(); ++k) {
    const std::size_t equal = parts[k].find('=');
    const auto setter = setters.find(parts[k].substr(0, equal));
    if (setter == setters.end()) {
      std::string known;
      for (const auto& [key, unused] : setters)
        known += (known.empty() ? "" : ", ") + key;
      throw std::invalid_argument("unknown option '" + parts[k] +
                                  "' of a simulated drive or encoder, expected one of " + known);
    }
    setter->second(equal == std::string::npos ? "" : parts[k].substr(equal + 1));
  }
}

/// Starts in the middle of the range, with switches and index pulse where the homing run of the axis ends at its home
/// position.
void placeReferences(const hal::AxisConfig& axis, const hal::AxisUnits& units, DriveSpec& spec) {
  using sim::drives::HomingMethod;
  using Switch = HomingMethod::Switch;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kWidth = 0.02;     // of a home switch, and distance of a limit switch behind the range, of the range
  constexpr double kStiffness = 2.0;  // of a mechanical stop, per mille of the rated torque per count
  constexpr double kBefore = 0.3;     // of a revolution, from an edge to the index pulse
  const double home = units.toCounts(axis.homing.position).value;
  const double one = units.toCounts(axis.lower).value, other = units.toCounts(axis.upper).value;
  const double revolution = axis.gearing.counts_per_revolution, margin = kWidth * std::abs(one - other);
  spec.start = 0.5 * (one + other);
  spec.switches.index = home;
  if (axis.reference == hal::PositionReference::kHardStop) {
    (axis.hard_stop.positive != units.reversed() ? spec.motor.high : spec.motor.low) = home;
    spec.switches.at_ends = false;
    spec.motor.end_stiffness = kStiffness;
    return;
  }
  if (axis.homing.stop != 0) {
    spec.stop_number = axis.homing.method;
    spec.stop_method = HomingMethod::toStop(axis.homing.stop, axis.homing.stop_index);
    const double stop = home + (axis.homing.stop_index ? kBefore * axis.homing.stop * revolution : 0.0);
    (axis.homing.stop > 0 ? spec.motor.high : spec.motor.low) = stop;
    spec.switches.at_ends = false;
    return;
  }
  const std::optional<HomingMethod> method = HomingMethod::ofNumber(axis.homing.method);
  if (!method)
    return;
  const int final = method->rising ? -method->edge : method->edge;
  const double edge = method->index ? home - kBefore * final * revolution : home;
  switch (method->of) {
    case Switch::kNegative:
      spec.motor.low = edge;
      break;
    case Switch::kPositive:
      spec.motor.high = edge;
      break;
    case Switch::kHome: {
      const double width = method->turns ? margin : kInfinity;
      spec.switches.home_from = method->edge < 0 ? edge : edge - width;
      spec.switches.home_to = method->edge < 0 ? edge + width : edge;
      if (method->turns && method->search < 0)
        spec.switches.negative = std::min({one, other, edge}) - margin;
      if (method->turns && method->search > 0)
        spec.switches.positive = std::max({one, other, edge}) + margin;
      break;
    }
    case Switch::kNone:
      spec.start = home - (method->index ? kBefore * method->search * revolution : 0.0);
      break;
  }
}

/// Transmission between the drive of an axis and its encoder.
sim::drives::LoadSpec loadOf(const hal::AxisConfig& axis) {
  const hal::EncoderConfig& encoder = *axis.encoder;
  sim::drives::LoadSpec spec;
  spec.ratio = hal::AxisUnits(axis.gearing).scale() / hal::AxisUnits(encoder.gearing).scale();
  spec.range = std::llround(encoder.range);
  // The counter of a drive with absolute position has its own origin: encoder and drive must give the same joint
  // position.
  if (axis.reference != hal::PositionReference::kAbsoluteEncoder)
    spec.offset = hal::AxisUnits(encoder.gearing).toCounts(hal::AxisUnits(axis.gearing).toJoint(0)).value;
  return spec;
}

DriveSpec driveOf(const hal::AxisConfig& axis) {
  const hal::AxisUnits units(axis.gearing, axis.units);
  DriveSpec spec;
  spec.counts_per_revolution = axis.gearing.counts_per_revolution;
  spec.velocity_unit = units.countsPerVelocityNumber();
  spec.acceleration_unit = units.countsPerAccelerationNumber();
  spec.id = static_cast<std::uint8_t>(axis.node);
  spec.serial = axis.identity.serial != 0 ? axis.identity.serial : kSerialBase + spec.id;
  spec.temperature = {axis.temperature_index, axis.temperature_sub};
  spec.temperature_scale = axis.temperature_scale;
  spec.motor.max_velocity = std::max(1.0, 2.0 * std::abs(units.toCountSpeed(axis.velocity)));
  spec.motor.max_acceleration =
      std::max(spec.motor.max_acceleration, 4.0 * std::abs(units.toCountSpeed(axis.quick_stop_deceleration)));
  if (axis.brake) {  // axes with a brake: the simulated joint falls without brake and torque
    spec.brake = {axis.brake->mask(), axis.brake->closed_level, 0.6 * axis.brake->closing_time};
    spec.motor.load = units.toCountSpeed(axis.translation ? kFall : kRotationFall);
  }
  if (axis.encoder && axis.encoder->atDrive()) {
    spec.load = loadOf(axis);
    spec.load_input = static_cast<std::uint8_t>(axis.encoder->drive_input);
  }
  spec.incremental = axis.needsRun() || axis.reference == hal::PositionReference::kMeasured;
  if (axis.needsRun())
    placeReferences(axis, units, spec);
  return spec;
}

EncoderSpec encoderOf(const hal::AxisConfig& axis) {
  const hal::EncoderConfig& encoder = *axis.encoder;
  EncoderSpec spec{loadOf(axis)};
  spec.id = static_cast<std::uint8_t>(encoder.node);
  spec.serial = encoder.identity.serial != 0 ? encoder.identity.serial : kSerialBase + spec.id;
  spec.drive = static_cast<std::uint8_t>(axis.node);
  return spec;
}

}  // namespace

DriveSpec parseDrive(const std::string& text) {
  constexpr double kMost = 2147483647.0, kInfinity = std::numeric_limits<double>::infinity();
  const std::vector<std::string> parts = split(text);
  DriveSpec spec;
  spec.id = toNode(parts[0]);
  spec.serial = kSerialBase + spec.id;
  const auto into = [](double& value, const char* what, double low, double high) {
    return [&value, what, low, high](const std::string& word) { value = toNumber(word, what, low, high); };
  };
  apply(parts, {{"serial", [&](const std::string& word) { spec.serial = toSerial(word); }},
                {"start", into(spec.start, "start", -kMost, kMost)},
                {"low", into(spec.motor.low, "low", -kMost, kMost)},
                {"high", into(spec.motor.high, "high", -kMost, kMost)},
                {"negative_switch",
                 [&](const std::string& w) { spec.switches.negative = toNumber(w, "negative_switch", -kMost, kMost); }},
                {"positive_switch",
                 [&](const std::string& w) { spec.switches.positive = toNumber(w, "positive_switch", -kMost, kMost); }},
                {"home_from", into(spec.switches.home_from, "home_from", -kMost, kMost)},
                {"home_to", into(spec.switches.home_to, "home_to", -kMost, kMost)},
                {"index", into(spec.switches.index, "index", -kMost, kMost)},
                {"max_velocity", into(spec.motor.max_velocity, "max_velocity", 1.0, kMost)},
                {"max_acceleration", into(spec.motor.max_acceleration, "max_acceleration", 1.0, 1e12)},
                {"incremental", [&](const std::string&) { spec.incremental = true; }}});
  // With one edge, the home switch is active on the whole other side.
  sim::drives::Switches& switches = spec.switches;
  const bool from = std::isfinite(switches.home_from), to = std::isfinite(switches.home_to);
  if (from != to)
    (from ? switches.home_to : switches.home_from) = from ? kInfinity : -kInfinity;
  if (from && to && !switches.hasHome())
    throw std::invalid_argument(
        fmt::format("drive '{}': found home_from {:.10g} and home_to {:.10g}, expected "
                    "home_from below home_to",
                    text, switches.home_from, switches.home_to));
  if (spec.motor.low >= spec.motor.high)
    throw std::invalid_argument(fmt::format("drive '{}': found low {:.10g} and high {:.10g}, expected low below high",
                                            text, spec.motor.low, spec.motor.high));
  return spec;
}

EncoderSpec parseEncoder(const std::string& text) {
  constexpr double kMost = 2147483647.0;
  const std::vector<std::string> parts = split(text);
  const std::size_t equal = parts[0].find('=');
  if (equal == std::string::npos)
    throw std::invalid_argument("encoder: found '" + text +
                                "', expected ID=DRIVE: its node id and that of its drive, e.g. 17=1");
  EncoderSpec spec;
  spec.id = toNode(parts[0].substr(0, equal));
  spec.drive = toNode(parts[0].substr(equal + 1));
  spec.serial = kSerialBase + spec.id;
  apply(parts, {{"serial", [&](const std::string& word) { spec.serial = toSerial(word); }},
                {"ratio", [&](const std::string& word) { spec.ratio = toNumber(word, "ratio", -1e6, 1e6); }},
                {"offset", [&](const std::string& word) {
                   spec.offset = static_cast<std::int32_t>(toNumber(word, "offset", -kMost, kMost));
                 }}});
  return spec;
}

void addSheet(const std::string& text,
              const std::function<hal::canopen::Eds(const std::string&)>& load,
              sim::drives::BusSpec& spec) {
  const std::size_t equal = text.find('=');
  // A path may contain the sign, too.
  if (equal == std::string::npos || text.find_first_not_of("0123456789,") != equal) {
    spec.drive_eds = load(text);
    return;
  }
  const hal::canopen::Eds eds = load(text.substr(equal + 1));
  for (const std::string& node : split(text.substr(0, equal)))
    spec.drive_eds_of[toNode(node)] = eds;
}

void addStandardNodes(sim::drives::BusSpec& spec) {
  for (int k = 1; k <= 6; ++k) {
    spec.drives.push_back(parseDrive(std::to_string(k)));
    spec.encoders.push_back(parseEncoder(std::to_string(16 + k) + "=" + std::to_string(k)));
  }
}

void addNodes(const hal::HardwareConfig& hardware, const std::string& bus, sim::drives::BusSpec& spec) {
  const auto found = std::ranges::find(hardware.buses, bus, &hal::BusConfig::name);
  if (found == hardware.buses.end()) {
    std::string names;
    for (const hal::BusConfig& known : hardware.buses)
      names += (names.empty() ? "" : ", ") + known.name;
    throw std::invalid_argument("--hardware-bus: found '" + bus + "', expected a bus of hardware " + hardware.name +
                                ": " + names);
  }
  const auto index = static_cast<int>(found - hardware.buses.begin());
  for (const hal::AxisConfig& axis : hardware.axes) {
    if (axis.bus != index)
      continue;
    spec.drives.push_back(driveOf(axis));
    if (axis.hasEncoderNode())
      spec.encoders.push_back(encoderOf(axis));
  }
}

}  // namespace tandem::drive_sim
