// SPDX-License-Identifier: Apache-2.0
#include "config/detail/arm_tables.h"

#include "config/detail/bind.h"
#include "control/parameters.h"
#include "safety/limits.h"

namespace tandem::config {

using enum Quantity;

Field armName() {
  return text("name", "topic name, unique in the file")
      .required()
      .matching("^[a-z][a-z0-9_]*$", "a name of lower-case letters, digits and _, starting with a letter");
}

const Mapping& poseTable() {
  static const Mapping table{
      "pose",
      "Pose of a frame in its parent frame.",
      {
          number("position", kLength, "[x, y, z]").vector3().defaultsTo(0.0),
          number("rpy", kAngle, "[roll, pitch, yaw]: R = Rz(yaw) Ry(pitch) Rx(roll)").vector3().defaultsTo(0.0),
      }};
  return table;
}

std::vector<Field> motionLimits(bool angle) {
  using safety::JointLimit;
  const Quantity speed = angle ? kAngularSpeed : kSpeed, change = angle ? kAngularAcceleration : kAcceleration;
  return {
      positive("velocity", speed, "largest speed; finite for hardware", &JointLimit::velocity)
          .usually(angle ? 1e-4 : 1e-6, angle ? 100.0 : 0.5)
          .orUnlimited(),
      positive("approach_acceleration", change,
               "A_max: shapes the approach to a limit, does not bound the command's jumps",
               &JointLimit::approach_acceleration)
          .orUnlimited(),
      positive("slew_limit", change, "largest change of the commanded velocity per second, enforced by the gate",
               &JointLimit::slew_limit)
          .usually(angle ? 1e-3 : 1e-5, angle ? 1e4 : 50.0)
          .orUnlimited(),
      positive("stop_deceleration", change, "deceleration of the stop ramp", &JointLimit::stop_deceleration)
          .defaultsTo(angle ? 20.0 : 0.1),
      positive("max_step", angle ? kAngle : kLength,
               "largest distance between consecutive setpoints; more is an integrity fault", &JointLimit::max_step)
          .orUnlimited(),
  };
}

const Mapping& controlTable() {
  using control::Backend;
  using control::BoundsKind;
  using P = control::MethodParameters;
  static const Mapping table{
      "control",
      "Default parameters of the redundancy-resolution methods; weights in SI (m, rad).",
      {
          positive("period", kTime, "T, control sampling time", &P::period).usually(1e-4, 1.0),
          text("bounds", "how equation (1) becomes bounds on velocities", allOf<BoundsKind>(), &P::bounds),
          text("backend", "QP solver", allOf<Backend>(), &P::backend),
          positive("nsp_damping", kLength, "damping of the pseudoinverses of equation (3) (nsp)", &P::nsp_damping),
          positive(
              "track_weight", kNone,
              "W_track of equation (4): weight of task errors against weighted joint velocities (nspwln, nspwln-joint)",
              &P::track_weight),
          positive("translation_weight", kNone,
                   "lambda_t of equation (4): weight of translations (nspwln, nspwln-joint)", &P::translation_weight),
          positive("rotation_weight", kNone, "lambda_r of equation (4): weight of rotations (nspwln, nspwln-joint)",
                   &P::rotation_weight),
          positive("nspqp_zeta", kNone, "zeta of equation (7): weight of joint velocities against task errors (nspqp)",
                   &P::nspqp_zeta),
          positive("snsqp_zeta", kNone, "zeta of equation (8): weight of joint velocities against task scales (snsqp)",
                   &P::snsqp_zeta),
          positive("rotation_velocity", kAngularSpeed, "bound on every rotation in all methods: no tube spins",
                   &P::rotation_velocity),
          positive("snsqp_rotation_velocity", kAngularSpeed, "bound on every rotation in equation (8) (snsqp)",
                   &P::snsqp_rotation_velocity),
          positive("translation_step", kLength, "bound on every translation in one period (nspqp, snsqp, sns, hqp)",
                   &P::translation_step),
          positive("singular_lever", kLength,
                   "singular threshold: directions in which rotations move the tip by less than this per rad are "
                   "damped (nsp, nspwln-joint)",
                   &P::singular_lever),
          positive("posture_gain", kGain, "k_p: how fast joints go to the posture of a reference", &P::posture_gain),
          positive("hqp_zeta", kNone,
                   "regularisation of hqp (zeta): weight of joint velocities relative to the task scale", &P::hqp_zeta),
          positive("spread_distance", kLength,
                   "distance to limits and neighbouring tubes below which hqp moves tubes away (d)",
                   &P::spread_distance),
          positive("spread_gain", kGain, "gain of that motion away from limits and neighbours (k_s)", &P::spread_gain),
          positive("barrier_gain", kGain, "largest rate at which hqp lets a margin go to its least value",
                   &P::barrier_gain),
          number("least_stability", kNone, "minimum elastic stability enforced by hqp; 0: off", &P::least_stability)
              .within(0, 1),
          notNegative("least_distance", kLength,
                      "minimum distance between the arms of a relative task, enforced by hqp; 0: off",
                      &P::least_distance),
      }};
  return table;
}

}  // namespace tandem::config
