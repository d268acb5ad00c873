// SPDX-License-Identifier: Apache-2.0
/** @file Signs of eigenvalues, for stability tests. The only user of Eigen's eigenvalue solvers, which are compiled
 * once. */
#pragma once

#include <Eigen/Core>

namespace tandem::kinematics {

/// A square matrix of at most 9 rows, without memory of its own on the heap.
using Form = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 9, 9>;

/// Number of negative eigenvalues of the symmetric part of a matrix; less than `vague` of the largest counts as none.
int negativeDirections(const Form& form, double vague = 0.0);

/// Number of eigenvalues of any square matrix whose real part is negative.
int negativeRealParts(const Form& form);

}  // namespace tandem::kinematics
