// SPDX-License-Identifier: Apache-2.0
#include "config/bind.h"
#include "config/file_tables.h"
#include "hal/hardware.h"

namespace tandem::config {
namespace {

using enum Quantity;
using hal::AxisConfig;
using hal::DeviceIdentity;
using hal::EncoderConfig;

/** Which of two names, quantities and texts a table takes: linear stages or rotations. */
struct Kind {
  bool translation;
  const char* name() const { return translation ? "translation" : "rotation"; }
  std::string prefixed(const std::string& what) const { return std::string(name()) + "_" + what; }
  Quantity position() const { return translation ? kLength : kAngle; }
  Quantity speed() const { return translation ? kSpeed : kAngularSpeed; }
  Quantity acceleration() const { return translation ? kAcceleration : kAngularAcceleration; }
};
constexpr double kLongestRun = 3600.0, kLongestBrake = 60.0;  // s
constexpr Kind kTranslation{true};
constexpr Kind kRotation{false};

/// The table of one of them, made once.
template <Mapping (*kMake)(Kind)>
const Mapping& both(Kind kind) {
  static const Mapping translation = kMake(kTranslation), rotation = kMake(kRotation);
  return kind.translation ? translation : rotation;
}

template <class Owner>
Field identityNumber(const std::string& name, const std::string& description, std::uint32_t DeviceIdentity::*number) {
  return text(name, description, &Owner::identity, number)
      .orInteger()
      .matching("^(0x[0-9A-Fa-f]{1,8}|[0-9]{1,10})$", "a number below 2^32, decimal or 0x...")
      .defaultNote("not checked");
}

template <class... Path>
Field nodeId(const std::string& name, const std::string& description, Path... path) {
  return integer(name, description, path...).within(1, 127);
}

const Mapping& busTable() {
  using B = hal::BusConfig;
  static const Mapping table{
      "bus",
      "One CAN bus.",
      {
          text("name", "unique in the file", &B::name)
              .required()
              .matching("^[a-z][a-z0-9_]*$", "a name of small letters, digits and _, a letter first"),
          text("interface", "can:INTERFACE of Linux, or unix:SOCKET of a simulated bus", &B::address)
              .required()
              .matching("^(can:[A-Za-z0-9_.-]{1,15}|unix:[^ ]{1,100})$", "can:INTERFACE or unix:SOCKET"),
          number("bit_rate", kBitRate, "of the bus; CANopen knows no more than 1000 kbit/s", &B::bit_rate)
              .within(1e4, 1e6),
          number("load_limit", kNone, "share of the bit rate that the HAL may plan for; more is refused",
                 &B::load_limit)
              .within(0.05, 0.95),
          nodeId("node_id", "under which the HAL sends its heartbeat", &B::node_id),
      }};
  return table;
}

Mapping homingMapping(Kind kind) {
  using H = hal::HomingConfig;
  return {
      kind.prefixed("homing"),
      "The homing run of a drive, CiA 402.",
      {
          integer("method", "object 0x6098: 17 and 18 limit switches, 33 and 34 index, 37 present position", &H::method)
              .required()
              .within(-128, 127),
          positive("fast", kind.speed(), "towards the switch; at most `velocity`", &H::fast).required(),
          positive("slow", kind.speed(), "off the switch, or to the index; at most `velocity`", &H::slow).required(),
          positive("acceleration", kind.acceleration(), "of the run", &H::acceleration).required(),
          integer("order", "axes with the same number run together, smaller numbers first", &H::order).within(0, 64),
          positive("budget", kTime, "the run has to end within it", &H::budget).atMost(kLongestRun),
      }};
}

Mapping brakeMapping(Kind kind) {
  using B = hal::BrakeConfig;
  return {
      kind.prefixed("brake"),
      "A holding brake at a digital output of the drive, object 0x60FE. The HAL opens it once torque holds the joint, "
      "and takes torque away once it is closed. A brake that the drive moves by itself needs no entry.",
      {
          integer("output_bit", "of 0x60FE:1", &B::output_bit).within(0, 31),
          integer("closed_level", "of that output while the brake is closed", &B::closed_level).within(0, 1),
          positive("closing_time", kTime, "until it holds", &B::closing_time).atMost(kLongestBrake),
          positive("opening_time", kTime, "until it lets go", &B::opening_time).atMost(kLongestBrake),
          positive("slip", kind.position(), "what a joint may move behind it; more is a brake that does not hold",
                   &B::slip)
              .required(),
      }};
}

template <class Owner>
std::vector<Field> gearingFields(Kind kind) {
  using hal::Gearing;
  std::vector<Field> fields{
      positive("counts_per_revolution", kNone, "of the shaft that it sits on", &Owner::gearing,
               &Gearing::counts_per_revolution)
          .required(),
      positive("gear_ratio", kNone,
               kind.translation ? "revolutions of that shaft per revolution of the lead screw"
                                : "revolutions of that shaft per revolution of the tube",
               &Owner::gearing, &Gearing::gear_ratio),
  };
  if (kind.translation)
    fields.push_back(positive("lead", kLength, "travel per revolution of the lead screw", &Owner::gearing,
                              &Gearing::travel_per_revolution)
                         .required());
  return fields;
}

template <class Owner>
std::vector<Field> identityFields() {
  return {
      identityNumber<Owner>("vendor", "object 0x1018:1", &DeviceIdentity::vendor),
      identityNumber<Owner>("product", "object 0x1018:2", &DeviceIdentity::product),
      identityNumber<Owner>("revision", "object 0x1018:3", &DeviceIdentity::revision),
  };
}

void append(std::vector<Field>& fields, const std::vector<Field>& more) {
  fields.insert(fields.end(), more.begin(), more.end());
}

const Mapping& torqueTable() {
  using T = hal::TorqueLimit;
  static const Mapping table{
      "torque_limit",
      "How much torque an axis may need in operation; beyond it the arm stops and latches.",
      {
          text("object", "what is watched: torque, object 0x6077, or current, object 0x6078",
               {{"torque", 0x6077}, {"current", 0x6078}}, &T::object)
              .defaultsTo("torque"),
          number("limit_per_mille", kNone, "of the rated torque (0x6076) or current (0x6075)")
              .required()
              .within(1, 32767),
          notNegative("time", kTime, "for which it may be beyond: speeding up takes more", &T::time),
      }};
  return table;
}

Mapping driveMapping(Kind kind) {
  using hal::PositionReference;
  using hal::PowerlessHold;
  Mapping table{kind.prefixed("drive"), "What the drives of a group have in common, CiA 402.",
                gearingFields<AxisConfig>(kind)};
  append(
      table.fields,
      {
          text("mode", "cyclic synchronous position, or velocity with the position loop in the HAL",
               {{"csp", hal::DriveMode::kCyclicPosition}, {"csv", hal::DriveMode::kCyclicVelocity}}, &AxisConfig::mode),
          positive("velocity_gain", kGain, "of the position loop in mode csv", &AxisConfig::velocity_gain),
          positive("velocity", kind.speed(), "the fastest that the axis may move", &AxisConfig::velocity).required(),
          positive("slew_limit", kind.acceleration(),
                   "largest change of the commanded velocity per second, held by the gate of the HAL; the tighter of "
                   "this and the robot file's holds",
                   &AxisConfig::slew_limit)
              .orUnlimited()
              .defaultNote("velocity within 0.1 s"),
          positive("quick_stop_deceleration", kind.acceleration(), "object 0x6085",
                   &AxisConfig::quick_stop_deceleration)
              .required(),
          positive("following_error", kind.position(), "window of drive and HAL, object 0x6065",
                   &AxisConfig::following_error)
              .required(),
          number("following_time", kTime, "for which the error may be outside, object 0x6066",
                 &AxisConfig::following_time)
              .within(1e-3, 60.0),
          text("reference", "where the position comes from after power on",
               {{"absolute_encoder", PositionReference::kAbsoluteEncoder},
                {"drive", PositionReference::kDrive},
                {"homing", PositionReference::kHoming}},
               &AxisConfig::reference),
          text("holds_without_power",
               "what keeps these axes where they are without power; power is taken from an idle arm whose axes all "
               "say so",
               {{"no", PowerlessHold::kNo},
                {"self_locking", PowerlessHold::kSelfLocking},
                {"brake", PowerlessHold::kBrake}},
               &AxisConfig::powerless_hold),
          mapping("torque_limit", torqueTable(), "a guard on torque or current").defaultNote("not watched"),
          text("temperature_object", "object with a temperature, signed")
              .matching("^[0-9A-Fa-f]{4}:[0-9A-Fa-f]{1,2}$", "INDEX:SUB, hexadecimal")
              .orInteger()
              .defaultNote("none"),
          positive("temperature_scale", kNone, "degrees Celsius per unit of that object",
                   &AxisConfig::temperature_scale),
          mapping("homing", both<homingMapping>(kind), "with `reference: homing`", &AxisConfig::homing)
              .defaultNote("none"),
          mapping("brake", both<brakeMapping>(kind), "one that the HAL moves", &AxisConfig::brake).defaultNote("none"),
      });
  append(table.fields, identityFields<AxisConfig>());
  return table;
}

Mapping encoderMapping(Kind kind) {
  Mapping table{kind.prefixed("encoder"), "What the absolute encoders of a group have in common, CiA 406.",
                gearingFields<EncoderConfig>(kind)};
  table.fields.push_back(
      positive("tolerance", kind.position(), "largest difference to the drive's position", &EncoderConfig::tolerance)
          .required());
  append(table.fields, identityFields<EncoderConfig>());
  return table;
}

Mapping axisMapping(Kind kind) {
  using hal::Gearing;
  return {
      kind.prefixed("axis"),
      "One joint.",
      {
          text("arm", "name of the arm in the robot file").required(),
          integer("tube", "counts from 1, the innermost").required().within(1, 4),
          text("bus", "name of the bus").required(),
          nodeId("node", "of the drive", &AxisConfig::node).required(),
          identityNumber<AxisConfig>("serial", "of the drive, object 0x1018:4", &DeviceIdentity::serial),
          flag("reversed", "positive counts of the drive move the joint in its negative direction",
               &AxisConfig::gearing, &Gearing::reversed),
          number("offset", kind.position(), "position at zero counts of the drive; with `reference: drive`",
                 &AxisConfig::gearing, &Gearing::offset),
          number("lower", kind.position(), "software limit of the drive, object 0x607D:1", &AxisConfig::lower)
              .required(),
          number("upper", kind.position(), "software limit of the drive, object 0x607D:2", &AxisConfig::upper)
              .required(),
          number("home_position", kind.position(), "where a homing run ends; with `reference: homing`",
                 &AxisConfig::homing, &hal::HomingConfig::position),
          nodeId("encoder_node", "of the absolute encoder", &EncoderConfig::node).defaultNote("none"),
          identityNumber<EncoderConfig>("encoder_serial", "object 0x1018:4 of the encoder", &DeviceIdentity::serial),
          flag("encoder_reversed", "positive counts of the encoder are negative positions", &EncoderConfig::gearing,
               &Gearing::reversed),
          number("encoder_offset", kind.position(), "position at zero counts of the encoder", &EncoderConfig::gearing,
                 &Gearing::offset),
      }};
}

Mapping groupMapping(Kind kind) {
  return {kind.prefixed("group"),
          kind.translation ? "Linear stages of one make." : "Rotations of one make.",
          {
              mapping("drive", both<driveMapping>(kind), "the drives").required(),
              mapping("encoder", both<encoderMapping>(kind), "the absolute encoders").defaultNote("none"),
              mapping("axes", both<axisMapping>(kind), "the joints").required().list(1, safety::kMaxJoints),
          }};
}

const Mapping kEmergencyStopTable{
    "emergency_stop_input",
    "Where the emergency stop can be read back: a bit of the drives' digital inputs, or of their statusword (STO).",
    {
        text("bus", "name of the bus").required(),
        nodeId("node", "of the drive").defaultNote("every drive of that bus"),
        integer("input_bit", "of the digital inputs, object 0x60FD").within(0, 31).defaultNote("statusword_bit"),
        integer("statusword_bit", "of the statusword, object 0x6041; none that makes the state")
            .within(4, 15)
            .defaultNote("input_bit"),
        text("active",
             "the value that says that it is pressed; low: a broken wire says so, too",
             {{"low", true}, {"high", false}},
             &hal::EmergencyInput::active_low)
            .required(),
    }};

}  // namespace

const Mapping& hardwareTable() {
  using H = hal::HardwareConfig;
  static const Mapping table{
      "hardware",
      "The drives and encoders of a robot: on which bus, in which units, within which limits.",
      {
          kindField("hardware"),
          text("name", "name of the hardware", &H::name).required(),
          robotField(),
          flag("simulated", "true: the nodes are simulated drives; a robot file with `hardware: false` is accepted",
               &H::simulated),
          number("period", kTime, "of SYNC on all buses; a multiple of 0.1 ms", &H::period).within(1e-3, 20e-3),
          number("node_heartbeat", kTime, "period of the nodes' heartbeats", &H::node_heartbeat).within(5e-3, 1.0),
          number("feedback_budget", kTime, "for which a node in operation may owe its PDO; three periods at the least",
                 &H::feedback_budget)
              .within(5e-3, 1.0),
          number("boot_budget", kTime, "a node has to be there within it after a reset", &H::boot_budget)
              .within(0.1, 60.0),
          number("transition_budget", kTime, "a drive has to take each step of its state machine within it",
                 &H::transition_budget)
              .within(0.02, 10.0),
          number("power_budget", kTime, "all drives of an arm have to be in operation within it", &H::power_budget)
              .within(0.1, 20.0),
          mapping("buses", busTable(), "the CAN buses", &H::buses).required().list(1, 8),
          mapping("emergency_stop", kEmergencyStopTable,
                  "any of these stops all arms, and keeps them from being cleared while it is pressed")
              .list(1, 2 * safety::kMaxJoints)
              .defaultNote("it cannot be read"),
          mapping("translations", both<groupMapping>(kTranslation), "linear stages").required().list(1, 16),
          mapping("rotations", both<groupMapping>(kRotation), "rotations").required().list(1, 16),
      }};
  return table;
}

}  // namespace tandem::config
