// SPDX-License-Identifier: Apache-2.0
/** @file Damping of closed-form methods near singular poses. */
#pragma once

#include "control/step_problem.h"

namespace tandem::control {

/// A A^T of a task's weighted Jacobian A.
using TaskGram = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxTaskRows, kMaxTaskRows>;

/** Damps the directions of a task in which joints hardly move it, and only those. With sigma_i and u_i the singular
 * values and left singular vectors of A_0,
 *
 *   G += sum over sigma_i < threshold of lambda_i^2 u_i u_i^T,
 *   lambda_i^2 = (1 - (sigma_i / threshold)^2) (threshold / 2)^2.
 *
 * lambda is that of Chiaverini, Siciliano & Egeland (1994), after Nakamura & Hanafusa (1986): zero at the threshold,
 * largest where the direction is lost; only singular directions are damped, as by Maciejewski & Klein (1988). With
 * G = A_0 A_0^T the damped inverse A_0^T (G + ...)^-1 has no gain above 2 / (sqrt(3) threshold): the trust region of a
 * step. Above the threshold G stays what it is, to the last digit.
 * @param plain  A_0 A_0^T: the task's Jacobian weighted without regard to limits
 * @return how many directions are below the threshold */
int dampSingularDirections(const TaskGram& plain, double threshold, TaskGram& gram) noexcept;

/** The same as a factor: a symmetric D = sum of lambda_i u_i u_i^T, so that the damped inverse is the least of
 * |x|^2 + |y|^2 with A_0 x + D y = v, which a quadratic programme can have among its constraints.
 * @return how many directions are below the threshold; 0: D is zero */
int dampingFactor(const TaskGram& plain, double threshold, TaskGram& factor) noexcept;

}  // namespace tandem::control
