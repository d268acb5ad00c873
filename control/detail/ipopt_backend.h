// SPDX-License-Identifier: Apache-2.0
/** @file QP backend with Ipopt: reference for the active-set backend in tests. */
#pragma once

#include "control/quadratic_program.h"

namespace tandem::control {

/** Interior-point method Ipopt (Waechter & Biegler 2006) on the same problem. Allocates and takes milliseconds: for
 * comparison, not for the periodic path. */
class IpoptBackend final : public QpBackend {
 public:
  void solve(const QuadraticProgram& qp, QpSolution& solution) noexcept override;
};

}  // namespace tandem::control
