// SPDX-License-Identifier: Apache-2.0
/** @file Joint-limit weights W_act of the weighted least-norm methods (Alsaka et al. 2024, equation (6)). */
#pragma once

#include "control/damping.h"
#include "control/parameters.h"
#include "control/step_problem.h"

namespace tandem::control {

/** How H sees the limits of equation (1). */
struct LimitView {
  bool both_neighbours;  ///< false: as printed, tube i's interval knows tube i-1 alone; true: tube i+1 as well
  double nearest;        ///< m: a limit nearer than this counts as this near, because H is infinite at the limit
};

/// Equation (1) as printed.
inline constexpr LimitView kAsPrinted{false, 1e-6};
/// What the corrected law needs: a tube that feels the tube outside it too, and weights that leave a way back from the
/// limit.
inline constexpr LimitView kCorrected{true, 2e-3};

/** Weights per joint, Alsaka et al. 2024, section 2.1: lambda_r for rotations, lambda_t w_i for translations, with
 *
 *   w_i = 1 + |dH/dbeta_i|,
 *   dH/dbeta_i = (max - min)^2 (2 beta - max - min) / (4 (max - beta)^2 (beta - min)^2)      (Chan & Dubey 1995)
 *
 * beta in mm inside H, without Chan and Dubey's switch (a joint that leaves its limit stays as heavy as one that
 * approaches it). */
RobotVector limitWeights(const StepProblem& problem, const MethodParameters& parameters, LimitView view) noexcept;

/// A_0 A_0^T, A_0 = J W_0^-1/2: the same weights with w_i = 1.
/// @param begin  the joint of J's first column
TaskGram plainGram(const StepProblem& problem,
                   const MethodParameters& parameters,
                   int begin,
                   const TaskJacobian& J) noexcept;

/// singular_lever as a singular value of A_0.
double singularThreshold(const MethodParameters& parameters) noexcept;

}  // namespace tandem::control
