// SPDX-License-Identifier: Apache-2.0
#include "config/detail/bind.h"
#include "config/detail/device_identity.h"
#include "config/detail/drive_profile.h"
#include "config/detail/hardware_homing_table.h"
#include "config/file_tables.h"
#include "hal/hardware.h"

namespace tandem::config {
namespace {

using enum Quantity;
using hal::AxisConfig;
using hal::DeviceIdentity;
using hal::EncoderConfig;

using Kind = JointKind;
constexpr double kLongestBrake = 60.0;  // s
constexpr Kind kTranslation{true};
constexpr Kind kRotation{false};

/// Table of one of them, created once.
template <Mapping (*kMake)(Kind)>
const Mapping& both(Kind kind) {
  static const Mapping translation = kMake(kTranslation), rotation = kMake(kRotation);
  return kind.translation ? translation : rotation;
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
              .matching("^[a-z][a-z0-9_]*$", "a name of lower-case letters, digits and _, starting with a letter"),
          text("interface",
               "can:INTERFACE of Linux, unix:SOCKET of a simulated bus, or library:PATH of a driver of one's own, and "
               "perhaps a comma and a text for it (docs/own-hardware.md)",
               &B::address)
              .required()
              .matching("^(can:[A-Za-z0-9_.-]{1,15}|unix:[^ ]{1,100}|library:/[^ ,]{1,200}(,[^ ]{1,100})?)$",
                        "can:INTERFACE, unix:SOCKET or library:/PATH,TEXT"),
          number("bit_rate", kBitRate, "bit rate; CANopen specifies at most 1000 kbit/s", &B::bit_rate)
              .within(1e4, 1e6),
          number("load_limit", kNone,
                 "largest permitted bus load, as share of the bit rate; a higher computed load is refused",
                 &B::load_limit)
              .within(0.05, 0.95),
          nodeId("node_id", "node id of the HAL", &B::node_id),
          integer(
              "sync_counter",
              "value after which the counter that SYNC carries begins again, object 1019 of every node: 2 to 240; 0: "
              "SYNC has no counter",
              &B::sync_counter)
              .within(0, 240),
      }};
  return table;
}

Mapping brakeMapping(Kind kind) {
  using B = hal::BrakeConfig;
  return {
      kind.prefixed("brake"),
      "A holding brake at a digital output of the drive, object 0x60FE. The HAL opens it once torque holds the joint, "
      "and takes torque away once it is closed. A brake that the drive moves by itself needs no entry.",
      {
          integer("output_bit", "bit of the digital outputs, object 0x60FE:1", &B::output_bit).within(0, 31),
          integer("closed_level", "level of the output while the brake is closed", &B::closed_level).within(0, 1),
          positive("closing_time", kTime, "time until the brake is closed", &B::closing_time).atMost(kLongestBrake),
          positive("opening_time", kTime, "time until the brake is open", &B::opening_time).atMost(kLongestBrake),
          positive("slip", kind.position(),
                   "permitted motion of a joint with closed brake; more triggers the guard `brake`", &B::slip)
              .required(),
      }};
}

template <class Owner>
std::vector<Field> gearingFields(Kind kind) {
  using hal::Gearing;
  std::vector<Field> fields{
      positive("counts_per_revolution", kNone, "counts per revolution of the motor's or encoder's shaft",
               &Owner::gearing, &Gearing::counts_per_revolution)
          .required(),
      positive("gear_ratio", kNone,
               kind.translation ? "revolutions of the motor's or encoder's shaft per revolution of the lead screw"
                                : "revolutions of the motor's or encoder's shaft per revolution of the tube",
               &Owner::gearing, &Gearing::gear_ratio),
  };
  if (kind.translation)
    fields.push_back(positive("lead", kLength, "travel per revolution of the lead screw", &Owner::gearing,
                              &Gearing::travel_per_revolution)
                         .required());
  return fields;
}

void append(std::vector<Field>& fields, const std::vector<Field>& more) {
  fields.insert(fields.end(), more.begin(), more.end());
}

const Mapping& torqueTable() {
  using T = hal::TorqueLimit;
  static const Mapping table{
      "torque_limit",
      "Torque limit of an axis: exceeding it stops the arm and latches a fault.",
      {
          text("object", "monitored quantity: torque, object 0x6077, or current, object 0x6078",
               {{"torque", 0x6077}, {"current", 0x6078}}, &T::object)
              .defaultsTo("torque"),
          number("limit_per_mille", kNone, "limit in thousandths of the rated torque (0x6076) or current (0x6075)")
              .required()
              .within(1, 32767),
          notNegative("time", kTime, "time for which the limit may be exceeded (acceleration needs more torque)",
                      &T::time),
      }};
  return table;
}

Mapping driveMapping(Kind kind) {
  using hal::HoldingMeans;
  using hal::PositionReference;
  Mapping table{kind.prefixed("drive"), "What the drives of a group have in common, CiA 402.",
                gearingFields<AxisConfig>(kind)};
  append(
      table.fields,
      {
          text("profile",
               "model of drive: a preset (tandem presets drive), or a file relative to the folder of this one")
              .defaultNote("none")
              .withoutMotion(),
          text("mode",
               "csp: cyclic synchronous position; csv, pv: cyclic synchronous and profile velocity with the position "
               "loop in the HAL",
               {{"csp", hal::DriveMode::kCyclicPosition},
                {"csv", hal::DriveMode::kCyclicVelocity},
                {"pv", hal::DriveMode::kProfileVelocity}},
               &AxisConfig::mode),
          positive("velocity_gain", kGain, "gain of the position loop in modes csv and pv", &AxisConfig::velocity_gain),
          positive("velocity", kind.speed(), "largest speed of the axis", &AxisConfig::velocity).required(),
          positive(
              "slew_limit", kind.acceleration(),
              "commanded acceleration limit in the HAL's gate; the smaller of this and the robot file's value applies",
              &AxisConfig::slew_limit)
              .orUnlimited()
              .defaultNote("velocity within 0.1 s"),
          positive("quick_stop_deceleration", kind.acceleration(), "quick-stop deceleration, object 0x6085",
                   &AxisConfig::quick_stop_deceleration)
              .required(),
          positive("following_error", kind.position(), "following error window of drive and HAL, object 0x6065",
                   &AxisConfig::following_error)
              .required(),
          number("following_time", kTime, "longest time outside the following error window, object 0x6066",
                 &AxisConfig::following_time)
              .within(1e-3, 60.0),
          positive("first_motion", kind.position(),
                   "how far the first motion after a boot may go beyond its targets, or differ from the encoder",
                   &AxisConfig::first_motion)
              .defaultNote(kind.translation ? "0.2 mm" : "0.5 deg"),
          text("reference", "source of the position after power on",
               {{"absolute_encoder", PositionReference::kAbsoluteEncoder},
                {"drive", PositionReference::kDrive},
                {"homing", PositionReference::kHoming},
                {"hard_stop", PositionReference::kHardStop},
                {"measured", PositionReference::kMeasured}},
               &AxisConfig::reference),
          text("holds_without_power",
               "what keeps the position of these axes without power (self_locking, brake, no); idle power-off needs it "
               "for all axes of an arm",
               {{"no", HoldingMeans::kNo},
                {"self_locking", HoldingMeans::kSelfLocking},
                {"brake", HoldingMeans::kBrake}},
               &AxisConfig::powerless_hold),
          mapping("torque_limit", torqueTable(), "guard on torque or current").defaultNote("not watched"),
          mapping("homing", both<homingMapping>(kind), "homing run; with `reference: homing`", &AxisConfig::homing)
              .defaultNote("none"),
          mapping("hard_stop", both<hardStopMapping>(kind), "mechanical stop; with `reference: hard_stop`")
              .defaultNote("none"),
          positive(
              "jump_tolerance", kind.position(),
              "largest jump of an absolute position since it was last known, while the HAL or the drive was off; a "
              "larger one must be confirmed (`tandem home --confirm`)",
              &AxisConfig::jump_tolerance)
              .defaultNote("not checked"),
          mapping("brake", both<brakeMapping>(kind), "holding brake that the HAL controls", &AxisConfig::brake)
              .defaultNote("none"),
      });
  append(table.fields, modelFields());
  return table;
}

Mapping encoderMapping(Kind kind) {
  Mapping table{kind.prefixed("encoder"),
                "What the absolute encoders of a group have in common: of the profile CiA 406, or read by the drives.",
                gearingFields<EncoderConfig>(kind)};
  table.fields.push_back(positive("tolerance", kind.position(), "largest permitted difference to the drive's position",
                                  &EncoderConfig::tolerance)
                             .required());
  table.fields.push_back(positive("range", kNone,
                                  "counts after which the reading wraps around to 0 (single-turn: one revolution); the "
                                  "range of each axis must be smaller",
                                  &EncoderConfig::range)
                             .defaultNote("no wrap-around"));
  table.fields.push_back(
      integer("drive_input",
              "sub-index of the drives' object 0x60E4 (additional position actual value) that shows the encoder, for "
              "encoders that the drives read; their axes have no encoder_node",
              &EncoderConfig::drive_input)
          .within(1, 254)
          .defaultNote("the encoders are nodes on the bus"));
  append(table.fields, identityFields<EncoderConfig>());
  return table;
}

const Mapping& acceptTable() {
  Words<hal::Protection> words;
  for (int k = 0; k < hal::kProtectionCount; ++k)
    words.emplace_back(name(static_cast<hal::Protection>(k)), static_cast<hal::Protection>(k));
  static const Mapping table{
      "accepted_loss",
      "A protection that the drive of this axis may lack although it is needed (docs/hardware.md).",
      {
          text("protection", "the protection", words, &hal::AcceptedLoss::protection).required(),
          text("reason", "why it is acceptable here: what stops the axis instead, or how far it travels",
               &hal::AcceptedLoss::reason)
              .required(),
      }};
  return table;
}

Mapping axisMapping(Kind kind) {
  using hal::Gearing;
  return {
      kind.prefixed("axis"),
      "One joint.",
      {
          text("arm", "name of the arm in the robot file").required(),
          integer("tube", "number of the tube, 1 is the innermost").required().within(1, 4),
          text("bus", "name of the bus").required(),
          nodeId("node", "node id of the drive", &AxisConfig::node).required(),
          identityNumber<AxisConfig>("serial", "serial number of the drive, object 0x1018:4", &DeviceIdentity::serial),
          flag("reversed", "positive counts of the drive move the joint in its negative direction",
               &AxisConfig::gearing, &Gearing::reversed),
          number("offset", kind.position(), "position at zero counts of the drive; with `reference: drive`",
                 &AxisConfig::gearing, &Gearing::offset),
          number("lower", kind.position(), "software limit of the drive, object 0x607D:1", &AxisConfig::lower)
              .required(),
          number("upper", kind.position(), "software limit of the drive, object 0x607D:2", &AxisConfig::upper)
              .required(),
          number("home_position", kind.position(), "position at the end of a homing run, or of the mechanical stop",
                 &AxisConfig::homing, &hal::HomingConfig::position),
          mapping("accept", acceptTable(), "protections that this drive may lack although they are needed",
                  &AxisConfig::accepted)
              .list(1, hal::kProtectionCount)
              .defaultNote("none"),
          sdoField("values written to this drive at boot, after those of its group"),
          nodeId("encoder_node", "node id of the absolute encoder", &EncoderConfig::node).defaultNote("none"),
          identityNumber<EncoderConfig>("encoder_serial", "serial number of the encoder, object 0x1018:4",
                                        &DeviceIdentity::serial),
          flag("encoder_reversed", "positive counts of the encoder are negative positions", &EncoderConfig::gearing,
               &Gearing::reversed),
          number("encoder_offset", kind.position(), "position at zero counts of the encoder", &EncoderConfig::gearing,
                 &Gearing::offset),
      }};
}

Mapping groupMapping(Kind kind) {
  return {kind.prefixed("group"),
          kind.translation ? "Linear stages of one model (drive and encoder type)."
                           : "Rotations of one model (drive and encoder type).",
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
        nodeId("node", "node id of the drive").defaultNote("every drive of that bus"),
        integer("input_bit", "bit of the digital inputs, object 0x60FD").within(0, 31).defaultNote("statusword_bit"),
        integer("statusword_bit", "bit of the statusword (0x6041) other than those that encode the drive state")
            .within(4, 15)
            .defaultNote("input_bit"),
        text("active",
             "input value that means pressed; `low` also detects a broken wire",
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
          number("period", kTime, "period of SYNC on all buses; a multiple of 0.1 ms", &H::period).within(1e-3, 20e-3),
          number("node_heartbeat", kTime, "period of the nodes' heartbeats", &H::node_heartbeat).within(5e-3, 1.0),
          number("feedback_budget", kTime,
                 "longest time without the PDO of an operational node; at least three periods", &H::feedback_budget)
              .within(5e-3, 1.0),
          number("boot_budget", kTime, "longest time from reset to boot-up message of a node", &H::boot_budget)
              .within(0.1, 60.0),
          number("transition_budget", kTime, "longest duration of one state transition of a drive",
                 &H::transition_budget)
              .within(0.02, 10.0),
          number("power_budget", kTime, "longest time until all drives of an arm are in operation enabled",
                 &H::power_budget)
              .within(0.1, 20.0),
          mapping("buses", busTable(), "the CAN buses", &H::buses).required().list(1, 8),
          mapping("emergency_stop", kEmergencyStopTable,
                  "inputs that read the emergency stop: an active one stops all arms and prevents clearing")
              .list(1, 2 * safety::kMaxJoints)
              .defaultNote("the emergency stop is not read"),
          mapping("translations", both<groupMapping>(kTranslation), "linear stages").required().list(1, 16),
          mapping("rotations", both<groupMapping>(kRotation), "rotations").required().list(1, 16),
      }};
  return table;
}

}  // namespace tandem::config
