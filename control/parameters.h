// SPDX-License-Identifier: Apache-2.0
/** @file User parameters of redundancy resolution. */
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "idl/enumerations.h"

namespace tandem::control {

using idl::Method;
using idl::name;
/// Number of built-in methods: all but Method::kForeign, the last one.
inline constexpr int kMethodCount = idl::count<Method> - 1;
static_assert(static_cast<int>(Method::kForeign) == kMethodCount, "a new method stands before kForeign, the last one");

struct ForeignMethod;

using idl::Backend;
using idl::BoundsKind;

/** Parameters of all methods; each method uses its own. SI units (m, rad). */
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
  /// rad/s, bound on every rotation in all methods: steps stay where the Jacobian is valid, and no tube spins
  double rotation_velocity = 2.0;
  double snsqp_rotation_velocity =
      0.5;  ///< rad/s, bound on every rotation in (8); without it the optimum spins the tubes
  /// m, bound on every translation in one period in the QP methods, and on motion toward a posture in all. Where ends
  /// of tubes pass each other the tip's Jacobian jumps; longer steps oscillate across that point without end.
  double translation_step = 1e-3;
  /// m/rad: closed-form methods treat a direction as singular, and damp it, if rotations move a task by less than this
  double singular_lever = 5e-4;
  double hqp_zeta = 1e-6;         ///< zeta of hqp, (s/rad)^2: weight of velocity relative to the scale of a task
  double spread_distance = 0.01;  ///< m: hqp moves tubes away from nearer limits and neighbours, if tasks permit
  double spread_gain = 0.5;       ///< 1/s: gain of that motion
  double barrier_gain = 1.0;      ///< 1/s: largest rate at which hqp lets a margin approach its least value
  double least_stability = 0.0;   ///< elastic stability that hqp keeps (Tip::stability); 0: no margin
  double least_distance = 0.0;    ///< m between the bodies of arms of a relative task that hqp keeps; 0: no margin
  double posture_gain = 2.0;      ///< k_p, 1/s: gain of motion toward the posture of a reference
  const ForeignMethod* foreign = nullptr;  ///< implementation of Method::kForeign; null: no library loaded
};

/// Bits 1 << method.
using MethodSet = unsigned;
template <class... Methods>
constexpr MethodSet methods(Methods... some) {
  return ((1U << static_cast<unsigned>(some)) | ...);
}
inline constexpr MethodSet kAllMethods = (1U << kMethodCount) - 1U;

/** A parameter that can be changed while a method runs, by its name in robot files (there with unit) and on the wire.
 */
struct TunableParameter {
  const char* name;
  double MethodParameters::*member;
  MethodSet readers = kAllMethods;  ///< methods that use it
  /// A foreign method may use any parameter.
  constexpr bool readBy(Method method) const { return method == Method::kForeign || (readers & methods(method)) != 0; }
};

namespace tunable_parameters {
using enum idl::Method;
using P = MethodParameters;
inline constexpr MethodSet kWeighted = methods(kNspwln, kNspwlnJoint);
/// All tunable parameters; each must be finite and above zero.
inline constexpr std::array kAll{
    TunableParameter{"nsp_damping", &P::nsp_damping, methods(kNsp)},
    TunableParameter{"track_weight", &P::track_weight, kWeighted},
    TunableParameter{"translation_weight", &P::translation_weight, kWeighted},
    TunableParameter{"rotation_weight", &P::rotation_weight, kWeighted},
    TunableParameter{"nspqp_zeta", &P::nspqp_zeta, methods(kNspqp)},
    TunableParameter{"snsqp_zeta", &P::snsqp_zeta, methods(kSnsqp)},
    TunableParameter{"rotation_velocity", &P::rotation_velocity},
    TunableParameter{"snsqp_rotation_velocity", &P::snsqp_rotation_velocity, methods(kSnsqp)},
    TunableParameter{"translation_step", &P::translation_step},
    TunableParameter{"singular_lever", &P::singular_lever, methods(kNsp, kNspwlnJoint, kSns, kHqp)},
    TunableParameter{"posture_gain", &P::posture_gain},
    TunableParameter{"hqp_zeta", &P::hqp_zeta, methods(kHqp)},
    TunableParameter{"spread_distance", &P::spread_distance, methods(kHqp)},
    TunableParameter{"spread_gain", &P::spread_gain, methods(kHqp)},
    TunableParameter{"barrier_gain", &P::barrier_gain, methods(kHqp)},
};
}  // namespace tunable_parameters
inline constexpr const auto& kTunableParameters = tunable_parameters::kAll;

}  // namespace tandem::control
