// SPDX-License-Identifier: Apache-2.0
/** @file Scaling of a quadratic program to values of magnitude one. */
#pragma once

#include "control/quadratic_program.h"

namespace tandem::control {

/** x = unit x', rows divided by their largest entry, objective divided by its own: equilibration (Ruiz 2001). Allocates
 * nothing. */
class ScaledProgram {
 public:
  void set(const QuadraticProgram& original);
  const QuadraticProgram& program() const { return qp_; }
  /// Converts a solution or certificate of program() to the original, and back; residuals stay unchanged.
  void restore(QpSolution& solution) const;
  void scale(QpSolution& solution) const;

 private:
  void chooseUnits(const QuadraticProgram& original);

  QuadraticProgram qp_;
  QpVector unit_;
  EqualityVector equality_;  ///< divisor of each equality
  RowVector row_;
  double objective_ = 1.0;
};

}  // namespace tandem::control
