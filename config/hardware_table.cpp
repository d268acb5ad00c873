// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "config/file_tables.h"
#include "hal/hardware.h"

namespace tandem::config {
namespace {

using enum Quantity;

/** Which of two names, quantities and texts a table takes: linear stages or rotations. */
struct Kind {
  bool translation;
  const char* name() const { return translation ? "translation" : "rotation"; }
  std::string prefixed(const std::string& what) const { return std::string(name()) + "_" + what; }
  Quantity position() const { return translation ? kLength : kAngle; }
  Quantity speed() const { return translation ? kSpeed : kAngularSpeed; }
  Quantity acceleration() const { return translation ? kAcceleration : kAngularAcceleration; }
};
constexpr Kind kTranslation{true};
constexpr Kind kRotation{false};

Field identityNumber(const std::string& name, const std::string& description) {
  return text(name, description)
      .orInteger()
      .matching("^(0x[0-9A-Fa-f]{1,8}|[0-9]{1,10})$", "a number below 2^32, decimal or 0x...")
      .defaultNote("not checked");
}

Field nodeId(const std::string& name, const std::string& description) {
  return integer(name, description).within(1, 127);
}

const Mapping& busTable() {
  const hal::BusConfig defaults;
  static const Mapping table{
      "bus",
      "One CAN bus.",
      {
          text("name", "unique in the file")
              .required()
              .matching("^[a-z][a-z0-9_]*$", "a name of small letters, digits and _, a letter first"),
          text("interface", "can:INTERFACE of Linux, or unix:SOCKET of a simulated bus")
              .required()
              .matching("^(can:[A-Za-z0-9_.-]{1,15}|unix:[^ ]{1,100})$", "can:INTERFACE or unix:SOCKET"),
          number("bit_rate", kBitRate, "of the bus; CANopen knows no more than 1000 kbit/s")
              .within(1e4, 1e6)
              .defaultsTo(defaults.bit_rate),
          number("load_limit", kNone, "share of the bit rate that the HAL may plan for; more is refused")
              .within(0.05, 0.95)
              .defaultsTo(defaults.load_limit),
          nodeId("node_id", "under which the HAL sends its heartbeat").defaultsTo(defaults.node_id),
      }};
  return table;
}

Mapping homingMapping(Kind kind) {
  const hal::HomingConfig defaults;
  return {kind.prefixed("homing"),
          "The homing run of a drive, CiA 402.",
          {
              integer("method", "object 0x6098: 17 and 18 limit switches, 33 and 34 index, 37 present position")
                  .required()
                  .within(-128, 127),
              number("fast", kind.speed(), "towards the switch; at most `velocity`").required().above(0),
              number("slow", kind.speed(), "off the switch, or to the index; at most `velocity`").required().above(0),
              number("acceleration", kind.acceleration(), "of the run").required().above(0),
              integer("order", "axes with the same number run together, smaller numbers first")
                  .within(0, 64)
                  .defaultsTo(defaults.order),
              number("budget", kTime, "the run has to end within it").above(0).defaultsTo(defaults.budget),
          }};
}

const Mapping& homingTable(Kind kind) {
  static const Mapping translation = homingMapping(kTranslation);
  static const Mapping rotation = homingMapping(kRotation);
  return kind.translation ? translation : rotation;
}

Mapping brakeMapping(Kind kind) {
  const hal::BrakeConfig defaults;
  return {
      kind.prefixed("brake"),
      "A holding brake at a digital output of the drive, object 0x60FE. The HAL opens it once torque holds the joint, "
      "and takes torque away once it is closed. A brake that the drive moves by itself needs no entry.",
      {
          integer("output_bit", "of 0x60FE:1").within(0, 31).defaultsTo(defaults.output_bit),
          integer("closed_level", "of that output while the brake is closed")
              .within(0, 1)
              .defaultsTo(static_cast<int>(defaults.closed_level)),
          number("closing_time", kTime, "until it holds").above(0).defaultsTo(defaults.closing_time),
          number("opening_time", kTime, "until it lets go").above(0).defaultsTo(defaults.opening_time),
          number("slip", kind.position(), "what a joint may move behind it; more is a brake that does not hold")
              .required()
              .above(0),
      }};
}

const Mapping& brakeTable(Kind kind) {
  static const Mapping translation = brakeMapping(kTranslation);
  static const Mapping rotation = brakeMapping(kRotation);
  return kind.translation ? translation : rotation;
}

std::vector<Field> gearingFields(Kind kind) {
  std::vector<Field> fields{
      number("counts_per_revolution", kNone, "of the shaft that it sits on").required().above(0),
      number("gear_ratio", kNone,
             kind.translation ? "revolutions of that shaft per revolution of the lead screw"
                              : "revolutions of that shaft per revolution of the tube")
          .above(0)
          .defaultsTo(1.0),
  };
  if (kind.translation)
    fields.push_back(number("lead", kLength, "travel per revolution of the lead screw").required().above(0));
  return fields;
}

std::vector<Field> identityFields() {
  return {
      identityNumber("vendor", "object 0x1018:1"),
      identityNumber("product", "object 0x1018:2"),
      identityNumber("revision", "object 0x1018:3"),
  };
}

void append(std::vector<Field>& fields, const std::vector<Field>& more) {
  fields.insert(fields.end(), more.begin(), more.end());
}

const Mapping& torqueTable() {
  const hal::TorqueLimit defaults;
  static const Mapping table{"torque_limit",
                             "How much torque an axis may need in operation; beyond it the arm stops and latches.",
                             {
                                 text("object", "what is watched: torque, object 0x6077, or current, object 0x6078")
                                     .oneOf({"torque", "current"})
                                     .defaultsTo("torque"),
                                 number("limit_per_mille", kNone, "of the rated torque (0x6076) or current (0x6075)")
                                     .required()
                                     .within(1, 32767),
                                 number("time", kTime, "for which it may be beyond: speeding up takes more")
                                     .atLeast(0)
                                     .defaultsTo(defaults.time),
                             }};
  return table;
}

Mapping driveMapping(Kind kind) {
  Mapping table{kind.prefixed("drive"), "What the drives of a group have in common, CiA 402.", gearingFields(kind)};
  append(table.fields,
         {
             text("mode", "cyclic synchronous position, or velocity with the position loop in the HAL")
                 .oneOf({"csp", "csv"})
                 .defaultsTo("csp"),
             number("velocity_gain", kGain, "of the position loop in mode csv").above(0).defaultsTo(10.0),
             number("velocity", kind.speed(), "the fastest that the axis may move").required().above(0),
             number("slew_limit", kind.acceleration(),
                    "largest change of the commanded velocity per second, held by the gate of the HAL; the tighter of "
                    "this and the robot file's holds")
                 .above(0)
                 .orUnlimited()
                 .defaultNote("velocity within 0.1 s"),
             number("quick_stop_deceleration", kind.acceleration(), "object 0x6085").required().above(0),
             number("following_error", kind.position(), "window of drive and HAL, object 0x6065").required().above(0),
             number("following_time", kTime, "for which the error may be outside, object 0x6066")
                 .atLeast(0)
                 .defaultsTo(0.05),
             text("reference", "where the position comes from after power on")
                 .oneOf({"absolute_encoder", "drive", "homing"})
                 .defaultsTo("absolute_encoder"),
             text("holds_without_power",
                  "what keeps these axes where they are without power; power is taken from an idle arm whose axes all "
                  "say so")
                 .oneOf({"no", "self_locking", "brake"})
                 .defaultsTo("no"),
             mapping("torque_limit", torqueTable(), "a guard on torque or current").defaultNote("not watched"),
             text("temperature_object", "object with a temperature, signed")
                 .matching("^[0-9A-Fa-f]{4}:[0-9A-Fa-f]{1,2}$", "INDEX:SUB, hexadecimal")
                 .orInteger()
                 .defaultNote("none"),
             number("temperature_scale", kNone, "degrees Celsius per unit of that object").above(0).defaultsTo(1.0),
             mapping("homing", homingTable(kind), "with `reference: homing`").defaultNote("none"),
             mapping("brake", brakeTable(kind), "one that the HAL moves").defaultNote("none"),
         });
  append(table.fields, identityFields());
  return table;
}

const Mapping& driveTable(Kind kind) {
  static const Mapping translation = driveMapping(kTranslation);
  static const Mapping rotation = driveMapping(kRotation);
  return kind.translation ? translation : rotation;
}

Mapping encoderMapping(Kind kind) {
  Mapping table{kind.prefixed("encoder"), "What the absolute encoders of a group have in common, CiA 406.",
                gearingFields(kind)};
  table.fields.push_back(
      number("tolerance", kind.position(), "largest difference to the drive's position").required().above(0));
  append(table.fields, identityFields());
  return table;
}

const Mapping& encoderTable(Kind kind) {
  static const Mapping translation = encoderMapping(kTranslation);
  static const Mapping rotation = encoderMapping(kRotation);
  return kind.translation ? translation : rotation;
}

Mapping axisMapping(Kind kind) {
  return {
      kind.prefixed("axis"),
      "One joint.",
      {
          text("arm", "name of the arm in the robot file").required(),
          integer("tube", "counts from 1, the innermost").required().within(1, 4),
          text("bus", "name of the bus").required(),
          nodeId("node", "of the drive").required(),
          identityNumber("serial", "of the drive, object 0x1018:4"),
          flag("reversed", "positive counts of the drive move the joint in its negative direction").defaultsTo(0.0),
          number("offset", kind.position(), "position at zero counts of the drive; with `reference: drive`")
              .defaultsTo(0.0),
          number("lower", kind.position(), "software limit of the drive, object 0x607D:1").required(),
          number("upper", kind.position(), "software limit of the drive, object 0x607D:2").required(),
          number("home_position", kind.position(), "where a homing run ends; with `reference: homing`").defaultsTo(0.0),
          nodeId("encoder_node", "of the absolute encoder").defaultNote("none"),
          identityNumber("encoder_serial", "object 0x1018:4 of the encoder"),
          flag("encoder_reversed", "positive counts of the encoder are negative positions").defaultsTo(0.0),
          number("encoder_offset", kind.position(), "position at zero counts of the encoder").defaultsTo(0.0),
      }};
}

const Mapping& axisTable(Kind kind) {
  static const Mapping translation = axisMapping(kTranslation);
  static const Mapping rotation = axisMapping(kRotation);
  return kind.translation ? translation : rotation;
}

Mapping groupMapping(Kind kind) {
  return {kind.prefixed("group"),
          kind.translation ? "Linear stages of one make." : "Rotations of one make.",
          {
              mapping("drive", driveTable(kind), "the drives").required(),
              mapping("encoder", encoderTable(kind), "the absolute encoders").defaultNote("none"),
              mapping("axes", axisTable(kind), "the joints").required().list(1, safety::kMaxJoints),
          }};
}

const Mapping& groupTable(Kind kind) {
  static const Mapping translation = groupMapping(kTranslation);
  static const Mapping rotation = groupMapping(kRotation);
  return kind.translation ? translation : rotation;
}

const Mapping& emergencyStopTable() {
  static const Mapping table{
      "emergency_stop_input",
      "Where the emergency stop can be read back: a bit of the drives' digital inputs, or of their statusword (STO).",
      {
          text("bus", "name of the bus").required(),
          nodeId("node", "of the drive").defaultNote("every drive of that bus"),
          integer("input_bit", "of the digital inputs, object 0x60FD").within(0, 31).defaultNote("statusword_bit"),
          integer("statusword_bit", "of the statusword, object 0x6041; none that makes the state")
              .within(4, 15)
              .defaultNote("input_bit"),
          text("active", "the value that says that it is pressed; low: a broken wire says so, too")
              .required()
              .oneOf({"low", "high"}),
      }};
  return table;
}

}  // namespace

const Mapping& hardwareTable() {
  const hal::HardwareConfig defaults;
  static const Mapping table{
      "hardware",
      "The drives and encoders of a robot: on which bus, in which units, within which limits.",
      {
          text("tandem", "kind and version of the file; the first key").required().oneOf({"hardware/1"}),
          text("name", "name of the hardware").required(),
          text("robot", "robot file, relative to the folder of this file, or the name of a preset").required(),
          flag("simulated", "true: the nodes are simulated drives; a robot file with `hardware: false` is accepted")
              .defaultsTo(0.0),
          number("period", kTime, "of SYNC on all buses; a multiple of 0.1 ms")
              .within(1e-3, 20e-3)
              .defaultsTo(defaults.period),
          number("node_heartbeat", kTime, "period of the nodes' heartbeats")
              .within(5e-3, 1.0)
              .defaultsTo(defaults.node_heartbeat),
          number("feedback_budget", kTime, "for which a node in operation may owe its PDO; three periods at the least")
              .within(5e-3, 1.0)
              .defaultsTo(defaults.feedback_budget),
          number("boot_budget", kTime, "a node has to be there within it after a reset")
              .within(0.1, 60.0)
              .defaultsTo(defaults.boot_budget),
          number("transition_budget", kTime, "a drive has to take each step of its state machine within it")
              .within(0.02, 10.0)
              .defaultsTo(defaults.transition_budget),
          number("power_budget", kTime, "all drives of an arm have to be in operation within it")
              .within(0.1, 20.0)
              .defaultsTo(defaults.power_budget),
          mapping("buses", busTable(), "the CAN buses").required().list(1, 8),
          mapping("emergency_stop", emergencyStopTable(),
                  "any of these stops all arms, and keeps them from being cleared while it is pressed")
              .list(1, 2 * safety::kMaxJoints)
              .defaultNote("it cannot be read"),
          mapping("translations", groupTable(kTranslation), "linear stages").required().list(1, 16),
          mapping("rotations", groupTable(kRotation), "rotations").required().list(1, 16),
      }};
  return table;
}

}  // namespace tandem::config
