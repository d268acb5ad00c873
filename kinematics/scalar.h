// SPDX-License-Identifier: Apache-2.0
/** @file Dual numbers (automatic differentiation by all joints of an arm) and access to their values. */
#pragma once

#include <Eigen/Core>
#include <unsupported/Eigen/AutoDiff>

#include "kinematics/concentric_tube.h"

namespace tandem::kinematics {

/// A number with its derivatives by the translations and rotations of four tubes.
using Dual = Eigen::AutoDiffScalar<Eigen::Matrix<double, 2 * kMaxTubes, 1>>;

/// Value without derivatives.
inline double valueOf(double number) { return number; }
template <class Derivatives>
double valueOf(const Eigen::AutoDiffScalar<Derivatives>& number) {
  return number.value();
}

/// Values of a matrix.
template <class Derived>
auto valuesOf(const Eigen::MatrixBase<Derived>& matrix) {
  return matrix.unaryExpr([](const typename Derived::Scalar& number) { return valueOf(number); }).eval();
}

}  // namespace tandem::kinematics
