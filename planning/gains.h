// SPDX-License-Identifier: Apache-2.0
/** @file Gains of the tasks of a reference. */
#pragma once

namespace tandem::planning {

/** Gains of v = lambda (x_d - x) + xdot_d per task kind, 1/s (Alsaka et al. 2024, below (3)). */
struct Gains {
  double relative = 5.0;  ///< lambda_AB: of kinds with two arms
  double tip = 3.0;       ///< lambda_A: of kinds with one
};

}  // namespace tandem::planning
