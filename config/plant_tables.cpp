// SPDX-License-Identifier: Apache-2.0
#include "config/detail/bind.h"
#include "config/file_tables.h"
#include "safety/dimensions.h"
#include "sim/plant_options.h"

namespace tandem::config {
namespace {

using enum Quantity;
constexpr double kLongestDelay = 1.0;       // s
constexpr double kHighestRate = 1e4;        // Hz; a tracker stores the measurements within its delay
constexpr double kLargestDeviation = 0.3;   // relative
constexpr double kLargestResidual = 100.0;  // 1/m
constexpr double kLargestFriction = 2.0;
constexpr double kLongestWay = 0.01;  // m, of play between tubes and of errors of a tracker
constexpr double kLeastError = -0.9, kLargestError = 9.0;

const Mapping& motorsTable() {
  using M = sim::JointMechanics;
  using sim::PerAxisKind;
  static const Mapping table{
      "motors",
      "Motors and transmissions: dynamics between joint reference and tube.",
      {
          number("delay", kTime, "delay of the actuation", &M::delay).within(0, kLongestDelay),
          notNegative("lag_translation", kTime, "time constant of the motors that push, a first-order lag", &M::lag,
                      &PerAxisKind::translation),
          notNegative("lag_rotation", kTime, "time constant of the motors that turn", &M::lag, &PerAxisKind::rotation),
          notNegative("backlash_translation", kLength, "backlash (full width) between motor and tube", &M::backlash,
                      &PerAxisKind::translation),
          notNegative("backlash_rotation", kAngle, "backlash (full width) between motor and tube", &M::backlash,
                      &PerAxisKind::rotation),
      }};
  return table;
}

const Mapping& encodersTable() {
  using E = sim::EncoderOptions;
  using sim::PerAxisKind;
  static const Mapping table{
      "encoders",
      "Encoders at the motors.",
      {
          notNegative("resolution_translation", kLength, "resolution: readings are multiples of this value",
                      &E::resolution, &PerAxisKind::translation),
          notNegative("resolution_rotation", kAngle, "resolution: readings are multiples of this value", &E::resolution,
                      &PerAxisKind::rotation),
          notNegative("noise_translation", kLength, "standard deviation", &E::noise, &PerAxisKind::translation),
          notNegative("noise_rotation", kAngle, "standard deviation", &E::noise, &PerAxisKind::rotation),
      }};
  return table;
}

/// Errors of bending_stiffness, torsional_stiffness, curvature and length, and the residual curvature, of every tube or
/// of one. @param straight description of the latter
std::vector<Field> tubeErrors(const std::string& what, double least, double largest, const std::string& straight) {
  using T = sim::TubeErrors;
  return {
      number("bending_stiffness", kNone, what, &T::bending_stiffness).within(least, largest),
      number("torsional_stiffness", kNone, what, &T::torsional_stiffness).within(least, largest),
      number("curvature", kNone, what, &T::curvature).within(least, largest),
      number("length", kNone, what, &T::length).within(least, largest),
      number("residual_curvature", kCurvature, straight, &T::residual_curvature)
          .within(least < 0 ? -kLargestResidual : 0, kLargestResidual),
  };
}

const Mapping kTubeDeviationTable{"tube_deviation",
                                  "Standard deviations of random relative errors of the tube parameters.",
                                  tubeErrors("standard deviation of the relative error",
                                             0,
                                             kLargestDeviation,
                                             "standard deviation of the precurvature of straight sections")};

const Mapping kTubeErrorsTable = [] {
  Mapping errors{"tube_errors",
                 "Relative errors of one tube of the plant against the robot file: 0.05 is 5 % more.",
                 {
                     text("arm", "name of the arm in the robot file").required(),
                     integer("tube", "number of the tube, 1 is the innermost").within(1, 4).required(),
                 }};
  for (const Field& field :
       tubeErrors("relative error", kLeastError, kLargestError, "precurvature of straight sections"))
    errors.fields.push_back(field);
  return errors;
}();

const Mapping kTipForceTable{
    "tip_force",
    "A constant force on a tool tip.",
    {
        text("arm", "name of the arm in the robot file").required(),
        number("force", kForce, "[x, y, z], robot base frame", &sim::TipForce::force).vector3().required(),
    }};

const Mapping& trackerTable() {
  using T = sim::TipTrackerOptions;
  static const Mapping table{
      "tracker",
      "A tip tracker that publishes sensing/tips.",
      {
          positive("rate", kFrequency, "measurements per second; in lock-step at most one per control period", &T::rate)
              .atMost(kHighestRate),
          notNegative("position_noise", kLength, "standard deviation per axis", &T::position_noise),
          notNegative("rotation_noise", kAngle, "standard deviation per axis", &T::rotation_noise),
          number("delay", kTime, "delay from measurement to arrival", &T::delay).within(0, kLongestDelay),
          number("delay_variation", kTime,
                 "largest addition to the delay, uniformly distributed; measurements arrive in order",
                 &T::delay_variation)
              .within(0, kLongestDelay),
          number("bias", kLength, "[x, y, z], constant error of positions, robot base frame", &T::bias).vector3(),
          number("rotation_bias", kAngle,
                 "[x, y, z], constant error of orientations: rotation vector, robot base frame", &T::rotation_bias)
              .vector3(),
          flag("orientations", "false: the tracker measures positions alone", &T::orientations),
          number("distortion", kLength, "largest error per axis that depends smoothly on the position", &T::distortion)
              .within(0, kLongestWay),
          positive("distortion_period", kLength, "spatial period of the distortion", &T::distortion_period),
          number("drop_out", kNone, "probability that a measurement of an arm is marked invalid", &T::drop_out)
              .within(0, 1),
      }};
  return table;
}

}  // namespace

const Mapping& plantTable() {
  using P = sim::PlantOptions;
  static const Mapping table{
      "plant",
      "Imperfections of the simulated robot.",
      {
          text("model", "kinematic model of the plant's arms", &P::model).oneOf({"rigid", "compliant"}),
          integer("seed", "seed of all random numbers", &P::seed).within(0, 2147483647),
          mapping("motors", motorsTable(), "motors and transmissions", &P::mechanics).defaultNote("ideal"),
          mapping("encoders", encodersTable(), "encoders", &P::encoders).defaultNote("ideal"),
          mapping("tube_deviation", kTubeDeviationTable, "random errors of all tubes", &P::tube_deviation)
              .defaultNote("none"),
          mapping("tube_errors", kTubeErrorsTable, "errors of certain tubes, instead of random ones")
              .list(0, safety::kMaxJoints)
              .defaultNote("none"),
          number("tube_friction", kNone, "Coulomb coefficient of friction between tubes", &P::friction)
              .within(0, kLargestFriction),
          number("tube_clearance", kLength, "diametral clearance between neighbouring tubes", &P::clearance)
              .within(0, kLongestWay),
          number("tube_ovality", kLength, "ovality of bores: largest less smallest diameter", &P::ovality)
              .within(0, kLongestWay),
          mapping("tip_forces", kTipForceTable, "forces on tool tips; only for model: compliant")
              .list(0, safety::kMaxArms)
              .defaultNote("none"),
          mapping("tracker", trackerTable(), "tip tracker", &P::tracker).optional().defaultNote("none"),
      }};
  return table;
}

}  // namespace tandem::config
