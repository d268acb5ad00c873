// SPDX-License-Identifier: Apache-2.0
/** @file A rod with tendons, integrated a second time from other equations. */
#pragma once

#include "tests/unit/kinematics_rods/random_rods.h"

namespace tandem::test {

/** Integrates the strains themselves: v' and u' by equations (17) of Rucker and Webster 2011, in which tendons are
 * distributed loads and, where they end, point loads. Begins with the strains reported for the clamp; at the end
 * nothing may be left over. */
struct TendonOracle {
  TendonOracle(const kinematics::cosserat::Rod& rod,
               const kinematics::cosserat::RodInput& input,
               const kinematics::cosserat::RodPoint& clamp);

  Eigen::Isometry3d pose;                   ///< of the rod's end
  Eigen::Vector3d left_force, left_moment;  ///< of rod less load at the end, rod's frame, N and N m
};

}  // namespace tandem::test
