// SPDX-License-Identifier: Apache-2.0
#include "hal/hardware.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <stdexcept>

#include "config/arm_names.h"
#include "config/detail/drive_profile.h"
#include "config/detail/exact.h"
#include "config/detail/hardware_guards.h"
#include "config/detail/hardware_homing.h"
#include "config/detail/loaders.h"
#include "config/file_tables.h"
#include "config/robot_files.h"
#include "hal/fieldbus.h"

namespace tandem::config {
namespace {

using hal::AxisConfig;
constexpr double kTurn = 2.0 * std::numbers::pi;  // travel per revolution of a rotation; a translation has its lead

/// Values common to all axes of a group.
struct Group {
  AxisConfig axis;
  std::optional<hal::EncoderConfig> encoder;
};

Group readGroup(const Map& map, bool translation, const FactsOfProfiles& facts) {
  const Map drive = map.map("drive");
  Group group;
  AxisConfig& axis = group.axis;
  axis.translation = translation;
  axis.gearing.travel_per_revolution = kTurn;
  drive.read(axis);
  const ProfileFacts* profile = drive.has("profile") ? &facts.at(drive.text("profile")) : nullptr;
  if (profile != nullptr)
    axis.foretold = profile->lacks;
  if (!drive.has("slew_limit"))
    axis.slew_limit = axis.velocity / hal::kSlewTime;
  if (!drive.has("first_motion"))
    axis.first_motion = translation ? hal::kFirstTranslation : hal::kFirstRotation;
  if (axis.positive_switch >= 0 && axis.positive_switch == axis.negative_switch)
    drive.fail("positive_switch_bit",
               "found the bit of negative_switch_bit, expected one of its own: a joint could not "
               "leave a switch whose side is not known");
  axis.torque = readTorqueLimit(drive);
  axis.sdo = readSdo(drive);
  readReference(drive, profile == nullptr ? std::vector<VendorHoming>{} : profile->homing_methods, axis);
  readObject(drive, "temperature_object", axis.temperature_index, axis.temperature_sub);
  if (map.has("encoder")) {
    group.encoder.emplace().gearing.travel_per_revolution = kTurn;
    map.map("encoder").read(*group.encoder);
  } else if (axis.reference == hal::PositionReference::kAbsoluteEncoder) {
    drive.fail("reference", "found absolute_encoder, expected an `encoder` mapping in this group");
  }
  return group;
}

/// Each protection once, with a reason that says something.
void checkAccepted(const Map& axis) {
  if (!axis.has("accept"))
    return;
  std::set<std::string> named;
  axis.each("accept", [&](const Map& loss) {
    if (!named.insert(loss.text("protection")).second)
      loss.fail("protection", "found " + loss.text("protection") + " a second time, expected each protection once");
    if (loss.text("reason").find_first_not_of(" \t\r\n") == std::string::npos)
      loss.fail("reason", "found nothing but blanks, expected what stops the axis instead, or how far it travels");
  });
}

/** Collects the axes of all groups and refuses joints and nodes that are used twice. */
class AxisReader {
 public:
  AxisReader(const Robot& robot, const std::vector<hal::BusConfig>& buses) : robot_(robot), buses_(buses) {
    for (std::size_t b = 0; b < buses.size(); ++b)
      nodes_.insert({static_cast<int>(b), buses[b].node_id});
  }

  void read(const Map& map, const Group& group) {
    AxisConfig axis = group.axis;
    map.read(axis);
    checkAccepted(map);
    for (hal::SdoWrite& write : readSdo(map))
      axis.sdo.push_back(std::move(write));
    placeJoint(map, axis);
    placeNode(map, axis);
    map.expectBelow("lower", "upper");
    readEncoder(map, group, axis);
    checkRange(map, axis);
    axes_.push_back(axis);
  }

  /// Arms and joints in order. @throw Error if a joint has no axis.
  std::vector<AxisConfig> finish(const Map& map) {
    for (std::size_t a = 0; a < robot_.arms.size(); ++a) {
      const int n = robot_.arms[a].limits.jointCount();
      for (int j = 0; j < n; ++j) {
        if (joints_.count({static_cast<int>(a), j}) == 0) {
          const bool translation = 2 * j < n;
          map.fail(translation ? "translations" : "rotations",
                   "found no axis for tube " + std::to_string(j % (n / 2) + 1) + " of " + robot_.arms[a].name +
                       ", expected one for every joint of the robot");
        }
      }
    }
    std::sort(axes_.begin(), axes_.end(),
              [](const auto& a, const auto& b) { return a.arm != b.arm ? a.arm < b.arm : a.joint < b.joint; });
    return axes_;
  }

 private:
  void placeJoint(const Map& map, AxisConfig& axis) {
    const std::string arm = map.text("arm");
    const auto found =
        std::find_if(robot_.arms.begin(), robot_.arms.end(), [&](const Arm& a) { return a.name == arm; });
    if (found == robot_.arms.end())
      map.fail("arm", "found '" + arm + "', expected an arm of the robot: " + armNames(robot_));
    axis.arm = static_cast<int>(found - robot_.arms.begin());
    const int tubes = found->limits.jointCount() / 2;
    const int tube = map.integer("tube");
    if (tube > tubes)
      map.fail("tube", "found " + std::to_string(tube) + ", expected at most " + std::to_string(tubes));
    axis.joint = tube - 1 + (axis.translation ? 0 : tubes);
    axis.name = arm + (axis.translation ? " translation " : " rotation ") + std::to_string(tube);
    if (!joints_.insert({axis.arm, axis.joint}).second)
      map.fail("tube", "found " + axis.name + " a second time, expected each joint once");
  }

  void claimNode(const Map& map, const std::string& key, int bus, int node) {
    if (!nodes_.insert({bus, node}).second) {
      map.fail(key, "found node id " + std::to_string(node) + " a second time on " +
                        buses_[static_cast<std::size_t>(bus)].name +
                        " (the HAL's own id included), expected unique ids");
    }
  }

  void placeNode(const Map& map, AxisConfig& axis) {
    axis.bus = busOf(map, buses_);
    claimNode(map, "node", axis.bus, axis.node);
  }

  void readEncoder(const Map& map, const Group& group, AxisConfig& axis) {
    hal::EncoderConfig encoder = group.encoder.value_or(hal::EncoderConfig{});
    map.read(encoder);
    for (const char* key : {"encoder_node", "encoder_serial"}) {
      if (encoder.atDrive() && map.has(key))
        map.fail(key, "found one, expected none: the drive reads this encoder (`drive_input` of the group)");
    }
    if (!encoder.atDrive() && !map.has("encoder_node")) {
      if (axis.reference == hal::PositionReference::kAbsoluteEncoder)
        map.fail("encoder_node", "found none, expected one with `reference: absolute_encoder`");
      return;
    }
    if (!group.encoder)
      map.fail("encoder_node", "found an encoder node in a group without an `encoder` mapping; expected both or none");
    const double range = encoder.range * hal::AxisUnits(encoder.gearing).resolution();
    if (encoder.range > 0.0 && axis.upper - axis.lower >= range)
      map.fail("upper", "found a travel of " + exact(axis.upper - axis.lower) +
                            " for an encoder that begins again after " + exact(range) +
                            " (m or rad), expected less: it could not tell where the joint is");
    axis.encoder = encoder;
    if (!encoder.atDrive())
      claimNode(map, "encoder_node", axis.bus, encoder.node);
  }

  /// A velocity or acceleration must be a number that the drive's objects can hold.
  static void checkRate(const Map& map,
                        const AxisConfig& axis,
                        const std::string& key,
                        double amount,
                        const std::string& object,
                        std::int64_t (hal::AxisUnits::*convert)(double) const noexcept) {
    const std::int64_t number = std::abs((hal::AxisUnits(axis.gearing, axis.units).*convert)(amount));
    if (number < 1 || number > std::numeric_limits<std::int32_t>::max())
      map.fail("node", axis.name + ": found a " + key + " that is " + std::to_string(number) +
                           " in the drive's unit (object " + object +
                           "), expected 1 to 2147483647; see velocity_unit and acceleration_unit");
  }

  /// The drive must be able to count the whole travel, from any start value of its counter.
  static void checkRange(const Map& map, const AxisConfig& axis) {
    constexpr double kRoom = 1 << 30;
    const auto refuse = [&](const std::string& key, double found, const std::string& counts, double least,
                            const char* place = "node") {
      map.fail(place, "found a " + key + " of " + exact(found) + ", expected at least " + counts + ", " + exact(least) +
                          (axis.translation ? " m" : " rad"));
    };
    try {
      const double resolution = hal::AxisUnits(axis.gearing).resolution();
      if ((axis.upper - axis.lower) / resolution > kRoom)
        map.fail("upper", "found a travel of " + exact((axis.upper - axis.lower) / resolution) +
                              " counts, expected at most 2^30, which a drive can count");
      checkRate(map, axis, "velocity", axis.velocity, "60FF", &hal::AxisUnits::toVelocityNumber);
      checkRate(map, axis, "quick_stop_deceleration", axis.quick_stop_deceleration, "6085",
                &hal::AxisUnits::toAccelerationNumber);
      if (axis.following_error < 2.0 * resolution)
        refuse("following_error", axis.following_error, "two counts of this axis", 2.0 * resolution);
      if (axis.first_motion < 2.0 * resolution)
        refuse("first_motion", axis.first_motion, "two counts of this axis", 2.0 * resolution);
      if (axis.encoder && axis.encoder->tolerance < hal::AxisUnits(axis.encoder->gearing).resolution())
        refuse("tolerance", axis.encoder->tolerance, "one count of the encoder",
               hal::AxisUnits(axis.encoder->gearing).resolution(), axis.hasEncoderNode() ? "encoder_node" : "node");
    } catch (const std::invalid_argument& error) {
      map.fail("node", error.what());
    }
  }

  const Robot& robot_;
  const std::vector<hal::BusConfig>& buses_;
  std::set<std::pair<int, int>> joints_;  ///< arm, joint
  std::set<std::pair<int, int>> nodes_;   ///< bus, id
  std::vector<AxisConfig> axes_;
};

void readCutLimits(const Map& map, const Robot& robot, hal::HardwareConfig& hardware) {
  for (std::size_t a = 0; a < robot.arms.size(); ++a) {
    try {
      hardware.arms.push_back(
          {robot.arms[a].name, hal::cutLimits(robot.arms[a].limits, hardware.axes, static_cast<int>(a))});
    } catch (const std::invalid_argument& error) {
      map.fail("robot", robot.arms[a].name + ": " + error.what());
    }
  }
}

}  // namespace

hal::HardwareConfig loadHardware(const std::filesystem::path& file, double heartbeat_budget, bool refuse_overload) {
  Document document(file.string(), readFile(file));
  FactsOfProfiles facts;
  const Map map = checkHardware(document, file, facts);
  map.expectDistinct("buses", "name");
  map.expectDistinct("buses", "interface");
  auto hardware = map.read<hal::HardwareConfig>();
  for (std::size_t b = 0; b < hardware.buses.size(); ++b) {
    if (hardware.buses[b].sync_counter == 1)
      map.fail("buses",
               hardware.buses[b].name + ": found sync_counter 1, expected 0 (no counter) or 2 to 240 (CiA 301)",
               static_cast<int>(b));
  }
  const Robot robot = loadAnyRobot(robotPath(map, file));
  hardware.robot_file = robot.file.string();
  if (!hardware.simulated && !robot.hardware)
    map.fail("robot", "found a robot with `hardware: false`, expected `hardware: true`, or `simulated: true` here");
  constexpr double kTicksPerSecond = 1e4;
  if (std::abs(kTicksPerSecond * hardware.period - std::round(kTicksPerSecond * hardware.period)) > 1e-6)
    map.fail("period", "found " + map.inUnit("period", hardware.period) + ", expected a multiple of 0.1 ms");
  AxisReader reader(robot, hardware.buses);
  for (const bool translation : {true, false}) {
    map.each(translation ? "translations" : "rotations", [&](const Map& entry) {
      const Group group = readGroup(entry, translation, facts);
      entry.each("axes", [&](const Map& axis) { reader.read(axis, group); });
    });
  }
  hardware.axes = reader.finish(map);
  readEmergencyStop(map, hardware);
  readCutLimits(map, robot, hardware);
  checkHomingTogether(map, hardware);
  for (std::size_t b = 0; b < hardware.buses.size(); ++b) {
    const hal::BusPlan plan = hardware.planOf(static_cast<int>(b), heartbeat_budget);
    if (refuse_overload && !hal::inLibrary(hardware.buses[b]) && !hal::computeLoad(plan).fits) {
      map.fail("buses",
               hardware.buses[b].name + ": " +
                   hal::explainLoad(plan, hardware.trafficOf(static_cast<int>(b), heartbeat_budget)),
               static_cast<int>(b));
    }
  }
  document.finish();
  return hardware;
}

}  // namespace tandem::config
