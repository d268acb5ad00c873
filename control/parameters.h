// SPDX-License-Identifier: Apache-2.0
/** @file What a user can choose about redundancy resolution. */
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace tandem::control {

/** Redundancy-resolution methods. Equation numbers: Alsaka et al. 2024. */
enum class Method {
  kNsp,          ///< (3), damped pseudoinverse and null-space projection, no limits
  kNspwln,       ///< (6), weighted least norm, as printed
  kNspwlnJoint,  ///< the corrected law: one weighted inverse over all joints
  kNspqp,        ///< (7), null-space projection as a constrained QP
  kSnsqp,        ///< (8), saturation in the null space as a sequence of constrained QPs
  kSns,          ///< its analytic form, Flacco et al. 2015, algorithm 4
  kHqp,          ///< ours: strict priorities below all inequalities, exact task scaling, continuous
};
inline constexpr int kMethodCount = 7;

/** Who solves the quadratic programmes. */
enum class Backend { kActiveSet, kIpopt };

/** How equation (1) becomes bounds on velocities. */
enum class BoundsKind {
  kCoupled,  ///< rows over both tubes' velocities: exact
  kFrozen,   ///< per-tube intervals with the neighbours held at their present position: the paper's formula, literally
};

std::string_view name(Method method);
std::string_view name(Backend backend);
std::string_view name(BoundsKind kind);
std::optional<Method> methodFromName(std::string_view name);
std::optional<Backend> backendFromName(std::string_view name);
std::optional<BoundsKind> boundsFromName(std::string_view name);

/** Parameters of all methods; each method reads its own. SI units (m, rad). */
struct MethodParameters {
  double period = 0.1;  ///< T, s: control sampling time
  BoundsKind bounds = BoundsKind::kCoupled;
  Backend backend = Backend::kActiveSet;
  double nsp_damping = 1e-4;         ///< damping of the pseudoinverses of (3), m
  double track_weight = 1e8;         ///< W_track of (4)
  double translation_weight = 30.0;  ///< lambda_t
  double rotation_weight = 1e-3;     ///< lambda_r
  double nspqp_zeta = 1e-6;          ///< zeta of (7)
  double snsqp_zeta = 3e-2;          ///< zeta of (8)
  /// rad/s, bound on every rotation in all methods: steps stay where the Jacobian holds, and no tube spins
  double rotation_velocity = 2.0;
  double snsqp_rotation_velocity =
      0.5;  ///< rad/s, bound on every rotation in (8); without it the optimum spins the tubes
  /// m, bound on every translation in one period in the QP methods. Where ends of tubes pass each other the tip's
  /// Jacobian jumps, and longer steps go to and fro across that place for ever.
  double translation_step = 1e-3;
  /// m/rad: a direction in which the rotations move a task by less is singular to the closed-form methods, which damp
  /// it
  double singular_lever = 5e-4;
  double hqp_zeta = 1e-3;         ///< zeta of hqp, (s/rad)^2: what a velocity costs against the share of a task
  double spread_distance = 0.01;  ///< m: hqp leads tubes away from limits and neighbours that are nearer, where it can
  double spread_gain = 0.5;       ///< 1/s: how fast
  double barrier_gain = 1.0;      ///< 1/s: largest rate at which hqp lets a margin go to its least value
  double least_stability = 0.0;   ///< elastic stability that hqp keeps (Tip::stability); 0: it does not look
  double least_distance = 0.0;  ///< m between the bodies of arms of a relative task that hqp keeps; 0: it does not look
  double posture_gain = 2.0;    ///< k_p, 1/s: how fast joints go to the posture of a reference
};

/** A number that can be changed while a method runs, by its name in robot files (there with a unit) and on the wire. */
struct Tunable {
  const char* name;
  double MethodParameters::*member;
};
/// All of them; each has to be finite and above zero.
inline constexpr std::array<Tunable, 15> kTunables{{
    {"nsp_damping", &MethodParameters::nsp_damping},
    {"track_weight", &MethodParameters::track_weight},
    {"translation_weight", &MethodParameters::translation_weight},
    {"rotation_weight", &MethodParameters::rotation_weight},
    {"nspqp_zeta", &MethodParameters::nspqp_zeta},
    {"snsqp_zeta", &MethodParameters::snsqp_zeta},
    {"rotation_velocity", &MethodParameters::rotation_velocity},
    {"snsqp_rotation_velocity", &MethodParameters::snsqp_rotation_velocity},
    {"translation_step", &MethodParameters::translation_step},
    {"singular_lever", &MethodParameters::singular_lever},
    {"posture_gain", &MethodParameters::posture_gain},
    {"hqp_zeta", &MethodParameters::hqp_zeta},
    {"spread_distance", &MethodParameters::spread_distance},
    {"spread_gain", &MethodParameters::spread_gain},
    {"barrier_gain", &MethodParameters::barrier_gain},
}};

}  // namespace tandem::control
