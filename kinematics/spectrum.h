// SPDX-License-Identifier: Apache-2.0
/** @file Signs of eigenvalues, for stability tests. The only user of Eigen's eigenvalue solvers, which are compiled
 * once. */
#pragma once

#include <Eigen/Core>

namespace tandem::kinematics {

/// Square matrix of at most 9 rows, without heap allocation.
using Form = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 9, 9>;

/// Number of negative eigenvalues of the symmetric part of a matrix; those smaller than `vague` times the largest do
/// not count.
int negativeDirections(const Form& form, double vague = 0.0);

/// Number of eigenvalues with a negative real part, for any square matrix.
int negativeRealParts(const Form& form);

}  // namespace tandem::kinematics
