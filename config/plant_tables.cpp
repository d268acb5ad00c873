// SPDX-License-Identifier: Apache-2.0
#include "config/file_tables.h"
#include "safety/dimensions.h"
#include "sim/plant_options.h"

namespace tandem::config {
namespace {

using enum Quantity;
constexpr double kLongestDelay = 1.0;      // s
constexpr double kLargestDeviation = 0.3;  // relative
constexpr double kLeastError = -0.9, kLargestError = 9.0;

/// A number of an ideal plant unless given: 0.
Field imperfection(const std::string& name, Quantity quantity, const std::string& description) {
  return number(name, quantity, description).atLeast(0).defaultsTo(0);
}

const Mapping& motorsTable() {
  static const Mapping table{
      "motors",
      "Between the reference of a joint and its tube.",
      {
          number("delay", kTime, "of the actuation").within(0, kLongestDelay).defaultsTo(0),
          imperfection("lag_translation", kTime, "time constant of the motors that push, a first-order lag"),
          imperfection("lag_rotation", kTime, "time constant of the motors that turn"),
          imperfection("backlash_translation", kLength, "full play between motor and tube"),
          imperfection("backlash_rotation", kAngle, "full play between motor and tube"),
      }};
  return table;
}

const Mapping& encodersTable() {
  static const Mapping table{"encoders",
                             "Encoders at the motors.",
                             {
                                 imperfection("resolution_translation", kLength, "readings are multiples of this"),
                                 imperfection("resolution_rotation", kAngle, "readings are multiples of this"),
                                 imperfection("noise_translation", kLength, "standard deviation"),
                                 imperfection("noise_rotation", kAngle, "standard deviation"),
                             }};
  return table;
}

Field deviation(const std::string& name) {
  return number(name, kNone, "standard deviation of the relative error").within(0, kLargestDeviation).defaultsTo(0);
}

Field relativeError(const std::string& name) {
  return number(name, kNone, "relative error").within(kLeastError, kLargestError).defaultsTo(0);
}

const Mapping& tubeDeviationTable() {
  static const Mapping table{
      "tube_deviation",
      "How far the plant's tubes are from those of the robot file, at random.",
      {deviation("bending_stiffness"), deviation("torsional_stiffness"), deviation("curvature"), deviation("length")}};
  return table;
}

const Mapping& tubeErrorsTable() {
  static const Mapping table{"tube_errors",
                             "How far one tube of the plant is from that of the robot file: 0.05 is 5 % more.",
                             {
                                 text("arm", "name of the arm in the robot file").required(),
                                 integer("tube", "number of the tube, 1 is the innermost").within(1, 4).required(),
                                 relativeError("bending_stiffness"),
                                 relativeError("torsional_stiffness"),
                                 relativeError("curvature"),
                                 relativeError("length"),
                             }};
  return table;
}

const Mapping& tipForceTable() {
  static const Mapping table{"tip_force",
                             "A constant force on a tool tip.",
                             {
                                 text("arm", "name of the arm in the robot file").required(),
                                 number("force", kForce, "[x, y, z], robot base frame").vector3().required(),
                             }};
  return table;
}

const Mapping& trackerTable() {
  const sim::TipTrackerOptions defaults;
  static const Mapping table{
      "tracker",
      "A tip tracker that publishes sensing/tips.",
      {
          number("rate", kFrequency, "measurements a second; in lock-step at most one a control period")
              .above(0)
              .defaultsTo(defaults.rate),
          imperfection("position_noise", kLength, "standard deviation per axis"),
          imperfection("rotation_noise", kAngle, "standard deviation per axis"),
          number("delay", kTime, "from measurement to arrival").within(0, kLongestDelay).defaultsTo(0),
          number("drop_out", kNone, "probability that a measurement of an arm is marked invalid")
              .within(0, 1)
              .defaultsTo(0),
      }};
  return table;
}

}  // namespace

const Mapping& plantTable() {
  static const Mapping table{
      "plant",
      "What the simulated robot does not do ideally.",
      {
          text("model", "kinematic model of the plant's arms").oneOf({"rigid", "compliant"}).defaultsTo("rigid"),
          integer("seed", "of everything random").within(0, 2147483647).defaultsTo(1),
          mapping("motors", motorsTable(), "motors and transmissions").defaultNote("ideal"),
          mapping("encoders", encodersTable(), "encoders").defaultNote("ideal"),
          mapping("tube_deviation", tubeDeviationTable(), "random errors of all tubes").defaultNote("none"),
          mapping("tube_errors", tubeErrorsTable(), "errors of certain tubes, in place of the random ones")
              .list(0, safety::kMaxJoints)
              .defaultNote("none"),
          mapping("tip_forces", tipForceTable(), "forces on tool tips; only for model: compliant")
              .list(0, safety::kMaxArms)
              .defaultNote("none"),
          mapping("tracker", trackerTable(), "tip tracker").defaultNote("none"),
      }};
  return table;
}

}  // namespace tandem::config
