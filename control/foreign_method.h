// SPDX-License-Identifier: Apache-2.0
/** @file Interface of a redundancy-resolution method in a shared library outside the project (docs/own-method.md). */
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "control/resolver.h"

namespace tandem::control {

/** Interface properties that a program and a library must share before one calls the other. Integers of fixed size,
 * readable in any build. */
struct MethodAbi {
  std::uint64_t interface = 0;        ///< version of the meaning of Resolver, StepProblem and Solution
  std::uint64_t eigen_alignment = 0;  ///< EIGEN_MAX_ALIGN_BYTES: depends on the instruction set (-mavx, -march=native)
  std::uint64_t eigen_version = 0;    ///< 30400 for 3.4.0
  std::uint64_t compiler_abi = 0;     ///< __GXX_ABI_VERSION
  std::uint64_t layout = 0;           ///< hash of sizes, alignments and offsets in the headers

  bool operator==(const MethodAbi&) const = default;
};

/** Description of a method that a library exports under kForeignSymbol: see TANDEM_METHOD. */
struct ForeignMethod {
  MethodAbi abi;
  const char* name = nullptr;  ///< lower-case letters, digits and -
  /// Creates the method, whenever method or parameters change. May throw, for parameters that it does not accept.
  std::unique_ptr<Resolver> (*make)(const MethodParameters& parameters) = nullptr;
};

inline constexpr const char* kForeignSymbol = "tandem_method";

// Offsets in types with private or nested members are "conditionally supported"; g++ and clang have them.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Winvalid-offsetof"
/// MethodAbi of the code that calls it.
constexpr MethodAbi methodAbi() noexcept {
  using P = StepProblem;
  using S = Solution;
  using M = MethodParameters;
  using J = JointState;
  using R = CoupledRow;
  using V = VelocityBounds;
  using L = Conflict::Limit;
  constexpr std::size_t kNumbers[] = {
      // clang-format off
      sizeof(Resolver), alignof(Resolver), sizeof(P), alignof(P), sizeof(S), alignof(S), sizeof(M), alignof(M),
      sizeof(J), sizeof(R), sizeof(V), sizeof(L), sizeof(Conflict), sizeof(Task), sizeof(Barrier),
      sizeof(RobotVector), alignof(RobotVector), sizeof(TaskJacobian), alignof(TaskJacobian), sizeof(TaskVector),
      offsetof(P, joint_count), offsetof(P, arm_count), offsetof(P, arm_offset), offsetof(P, joint),
      offsetof(P, row_count), offsetof(P, row), offsetof(P, task_count), offsetof(P, task),
      offsetof(P, barrier_count), offsetof(P, barrier), offsetof(P, posture),
      offsetof(Task, jacobian), offsetof(Task, velocity), offsetof(Task, activation),
      offsetof(Barrier, gradient), offsetof(Barrier, rate),
      offsetof(J, kind), offsetof(J, position), offsetof(J, lower), offsetof(J, upper), offsetof(J, frozen_lower),
      offsetof(J, frozen_upper), offsetof(J, moving_lower), offsetof(J, moving_upper), offsetof(J, velocity),
      offsetof(J, approach_acceleration),
      offsetof(R, first), offsetof(R, second), offsetof(R, a_first), offsetof(R, a_second), offsetof(R, gap),
      offsetof(R, approach_acceleration),
      offsetof(S, status), offsetof(S, velocity), offsetof(S, scale), offsetof(S, residual), offsetof(S, iterations),
      offsetof(S, kkt_residual), offsetof(S, bounds), offsetof(S, joint_active), offsetof(S, active_count),
      offsetof(S, conflict),
      offsetof(V, lower), offsetof(V, upper), offsetof(V, row_count), offsetof(V, row_rate),
      offsetof(V, step_translation), offsetof(V, step_rotation),
      offsetof(M, period), offsetof(M, bounds), offsetof(M, backend), offsetof(M, nsp_damping),
      offsetof(M, track_weight), offsetof(M, translation_weight), offsetof(M, rotation_weight),
      offsetof(M, nspqp_zeta), offsetof(M, snsqp_zeta), offsetof(M, rotation_velocity),
      offsetof(M, snsqp_rotation_velocity), offsetof(M, translation_step), offsetof(M, singular_lever),
      offsetof(M, hqp_zeta), offsetof(M, spread_distance), offsetof(M, spread_gain), offsetof(M, barrier_gain),
      offsetof(M, least_stability), offsetof(M, least_distance), offsetof(M, posture_gain), offsetof(M, foreign),
      static_cast<std::size_t>(Method::kForeign), static_cast<std::size_t>(SolveStatus::kInfeasible),
      // clang-format on
  };
  std::uint64_t hash = 14695981039346656037U;  // FNV-1a
  for (const std::size_t number : kNumbers)
    hash = (hash ^ number) * 1099511628211U;
  return {.interface = 1,
          .eigen_alignment = EIGEN_MAX_ALIGN_BYTES,
          .eigen_version = EIGEN_WORLD_VERSION * 10000 + EIGEN_MAJOR_VERSION * 100 + EIGEN_MINOR_VERSION,
          .compiler_abi = __GXX_ABI_VERSION,
          .layout = hash};
}
#pragma GCC diagnostic pop

/** Exports a method: once per library, at global scope.
 * @param method_name  its name in status and recordings
 * @param Type  derives from Resolver, is constructed from MethodParameters, its method() returns Method::kForeign */
// NOLINTBEGIN(bugprone-macro-parentheses): a type
#define TANDEM_METHOD(method_name, Type)                                                                             \
  extern "C" __attribute__((visibility("default"))) constinit const tandem::control::ForeignMethod tandem_method = { \
      tandem::control::methodAbi(), method_name,                                                                     \
      [](const tandem::control::MethodParameters& parameters) -> std::unique_ptr<tandem::control::Resolver> {        \
        return std::make_unique<Type>(parameters);                                                                   \
      }}
// NOLINTEND(bugprone-macro-parentheses)

}  // namespace tandem::control
