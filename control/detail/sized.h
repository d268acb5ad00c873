// SPDX-License-Identifier: Apache-2.0
/** @file Dispatch to fixed-size Eigen vectors for common joint counts. */
#pragma once

#include <type_traits>

#include "control/quadratic_program.h"

namespace tandem::control {

template <int N>
using SizedVector = Eigen::Matrix<double, N, 1, Eigen::ColMajor, N == Eigen::Dynamic ? kMaxVariables : N, 1>;

/// Map of n values from `data` on. @tparam N  n, or Eigen::Dynamic
template <int N, class Number>
auto sized(Number* data, int n) {
  using Vector = Eigen::Matrix<double, N, 1>;
  return Eigen::Map<std::conditional_t<std::is_const_v<Number>, const Vector, Vector>>(data, n);
}

/** Calls f<n>() if n is the number of variables of two arms with three tubes each, or one more for a task's scale; else
 * f<Eigen::Dynamic>(). Loops of known length take half the time. */
template <class F>
void withSize(int n, const F& f) {
  switch (n) {
    case 12:
      return f.template operator()<12>();
    case 13:
      return f.template operator()<13>();
    default:
      return f.template operator()<Eigen::Dynamic>();
  }
}

}  // namespace tandem::control
