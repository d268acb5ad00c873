// SPDX-License-Identifier: Apache-2.0
/** @file Joint-limit weights W_act of the weighted least-norm methods (Alsaka et al. 2024, equation (6)). */
#pragma once

#include "control/damping.h"
#include "control/parameters.h"
#include "control/step_problem.h"

namespace tandem::control {

/** Interpretation of the limits of equation (1) by H. */
struct LimitView {
  bool both_neighbours;  ///< false: as printed, tube i's interval depends on tube i-1 only; true: on tube i+1, too
  double nearest;        ///< m: smallest distance to a limit used in H, which is infinite at the limit
};

/// Equation (1) as printed.
inline constexpr LimitView kAsPrinted{false, 1e-6};
/// Corrected law: the outer neighbour counts, too, and weights stay small enough for motion away from the limit.
inline constexpr LimitView kCorrected{true, 2e-3};

/** Weights per joint, Alsaka et al. 2024, section 2.1: lambda_r for rotations, lambda_t w_i for translations, with
 *
 *   w_i = 1 + |dH/dbeta_i|,
 *   dH/dbeta_i = (max - min)^2 (2 beta - max - min) / (4 (max - beta)^2 (beta - min)^2)      (Chan & Dubey 1995)
 *
 * beta is in mm inside H. Chan and Dubey's switch is not used: the weight of a joint does not depend on whether it
 * approaches or leaves its limit. */
RobotVector limitWeights(const StepProblem& problem, const MethodParameters& parameters, LimitView view) noexcept;

/// A_0 A_0^T, A_0 = J W_0^-1/2: the same weights with w_i = 1.
/// @param begin  the joint of J's first column
TaskGram plainGram(const StepProblem& problem,
                   const MethodParameters& parameters,
                   int begin,
                   const TaskJacobian& J) noexcept;

/// singular_lever converted to a singular value of A_0.
double singularThreshold(const MethodParameters& parameters) noexcept;

}  // namespace tandem::control
