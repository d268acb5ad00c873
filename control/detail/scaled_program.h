// SPDX-License-Identifier: Apache-2.0
/** @file Scaling of a quadratic programme to numbers of magnitude one. */
#pragma once

#include "control/quadratic_program.h"

namespace tandem::control {

/** x = unit x', rows divided by their largest entry, objective divided by its own: equilibration (Ruiz 2001). Allocates
 * nothing. */
class ScaledProgram {
 public:
  void set(const QuadraticProgram& original);
  const QuadraticProgram& program() const { return qp_; }
  /// Solution or certificate of program() into one of the original, and back; residuals stay what they are.
  void restore(QpSolution& solution) const;
  void scale(QpSolution& solution) const;

 private:
  void chooseUnits(const QuadraticProgram& original);

  QuadraticProgram qp_;
  QpVector unit_;
  EqualityVector equality_;  ///< what an equality was divided by
  RowVector row_;
  double objective_ = 1.0;
};

}  // namespace tandem::control
