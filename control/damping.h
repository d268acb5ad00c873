// SPDX-License-Identifier: Apache-2.0
/** @file Damping of closed-form methods near singular poses. */
#pragma once

#include "control/step_problem.h"

namespace tandem::control {

/// A A^T of a task's weighted Jacobian A.
using TaskGram = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxTaskRows, kMaxTaskRows>;

/** Damps only those directions of a task in which joints hardly move it. With sigma_i and u_i the singular values and
 * left singular vectors of A_0,
 *
 *   G += sum over sigma_i < threshold of lambda_i^2 u_i u_i^T,
 *   lambda_i^2 = (1 - (sigma_i / threshold)^2) (threshold / 2)^2.
 *
 * lambda is that of Chiaverini, Siciliano & Egeland (1994), after Nakamura & Hanafusa (1986): zero at the threshold,
 * largest at sigma_i = 0; only singular directions are damped, as by Maciejewski & Klein (1988). With G = A_0 A_0^T the
 * damped inverse A_0^T (G + ...)^-1 has no gain above 2 / (sqrt(3) threshold): the trust region of a step. Above the
 * threshold G remains bitwise unchanged.
 * @param plain  A_0 A_0^T: the task's Jacobian weighted without regard to limits
 * @return number of directions below the threshold */
int dampSingularDirections(const TaskGram& plain, double threshold, TaskGram& gram) noexcept;

/** The same as a factor: a symmetric D = sum of lambda_i u_i u_i^T, so that the damped inverse minimises |x|^2 + |y|^2
 * subject to A_0 x + D y = v, which can be a constraint of a quadratic program.
 * @return number of directions below the threshold; 0: D is zero */
int dampingFactor(const TaskGram& plain, double threshold, TaskGram& factor) noexcept;

}  // namespace tandem::control
