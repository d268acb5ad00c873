// SPDX-License-Identifier: Apache-2.0
#include "config/arm_tables.h"

#include "control/parameters.h"
#include "safety/limits.h"

namespace tandem::config {

using enum Quantity;
constexpr double kUnlimited = safety::kUnlimited;

Field armName() {
  return text("name", "topic name, unique in the file")
      .required()
      .matching("^[a-z][a-z0-9_]*$", "a name of small letters, digits and _, a letter first");
}

const Mapping& poseTable() {
  static const Mapping table{
      "pose",
      "A frame in its parent.",
      {
          number("position", kLength, "[x, y, z]").vector3().defaultsTo(0.0),
          number("rpy", kAngle, "[roll, pitch, yaw]: R = Rz(yaw) Ry(pitch) Rx(roll)").vector3().defaultsTo(0.0),
      }};
  return table;
}

Field speedLimit(Quantity quantity) {
  return number("velocity", quantity, "largest speed; finite for hardware")
      .above(0)
      .orUnlimited()
      .defaultsTo(kUnlimited);
}

std::vector<Field> accelerationLimits(Quantity quantity, double stop_default) {
  return {
      number("approach_acceleration", quantity,
             "A_max: shapes the approach to a limit, does not bound the command's jumps")
          .above(0)
          .orUnlimited()
          .defaultsTo(kUnlimited),
      number("slew_limit", quantity, "largest change of the commanded velocity per second, held by the gate")
          .above(0)
          .orUnlimited()
          .defaultsTo(kUnlimited),
      number("stop_deceleration", quantity, "deceleration of the stop ramp").above(0).defaultsTo(stop_default),
  };
}

Field stepLimit(Quantity quantity) {
  return number("max_step", quantity, "a setpoint farther than this from the last one is an integrity fault")
      .above(0)
      .orUnlimited()
      .defaultsTo(kUnlimited);
}

const Mapping& controlTable() {
  const control::MethodParameters defaults;
  static const Mapping table{
      "control",
      "Default parameters of the redundancy-resolution methods; weights in SI (m, rad).",
      {
          number("period", kTime, "T, control sampling time").above(0).defaultsTo(defaults.period),
          text("bounds", "how equation (1) becomes bounds on velocities")
              .oneOf({"coupled", "frozen"})
              .defaultsTo(std::string(name(defaults.bounds))),
          text("backend", "who solves the quadratic programmes")
              .oneOf({"active-set", "ipopt"})
              .defaultsTo(std::string(name(defaults.backend))),
          number("nsp_damping", kLength, "damping of the pseudoinverses of (3)")
              .atLeast(0)
              .defaultsTo(defaults.nsp_damping),
          number("track_weight", kNone, "W_track of (4)").above(0).defaultsTo(defaults.track_weight),
          number("translation_weight", kNone, "lambda_t").above(0).defaultsTo(defaults.translation_weight),
          number("rotation_weight", kNone, "lambda_r").above(0).defaultsTo(defaults.rotation_weight),
          number("nspqp_zeta", kNone, "zeta of (7)").above(0).defaultsTo(defaults.nspqp_zeta),
          number("snsqp_zeta", kNone, "zeta of (8)").above(0).defaultsTo(defaults.snsqp_zeta),
          number("rotation_velocity", kAngularSpeed, "bound on every rotation in all methods: no tube spins")
              .above(0)
              .defaultsTo(defaults.rotation_velocity),
          number("snsqp_rotation_velocity", kAngularSpeed, "bound on every rotation in (8)")
              .above(0)
              .defaultsTo(defaults.snsqp_rotation_velocity),
          number("translation_step", kLength, "bound on every translation in one period in the QP methods")
              .above(0)
              .defaultsTo(defaults.translation_step),
          number("singular_lever", kLength,
                 "per rad: a direction in which the rotations move a tip by less is singular to nsp and nspwln-joint")
              .above(0)
              .defaultsTo(defaults.singular_lever),
          number("posture_gain", kGain, "k_p: how fast joints go to the posture of a reference")
              .above(0)
              .defaultsTo(defaults.posture_gain),
          number("hqp_zeta", kNone, "zeta of hqp: what velocities cost against the share of a task that is done")
              .above(0)
              .defaultsTo(defaults.hqp_zeta),
          number("spread_distance", kLength, "hqp leads tubes away from limits and neighbours that are nearer")
              .above(0)
              .defaultsTo(defaults.spread_distance),
          number("spread_gain", kGain, "and so fast").above(0).defaultsTo(defaults.spread_gain),
          number("barrier_gain", kGain, "largest rate at which hqp lets a margin go to its least value")
              .above(0)
              .defaultsTo(defaults.barrier_gain),
          number("least_stability", kNone, "elastic stability that hqp keeps; 0: it does not look")
              .within(0, 1)
              .defaultsTo(defaults.least_stability),
          number("least_distance", kLength, "between the arms of a relative task that hqp keeps; 0: it does not look")
              .atLeast(0)
              .defaultsTo(defaults.least_distance),
      }};
  return table;
}

}  // namespace tandem::config
