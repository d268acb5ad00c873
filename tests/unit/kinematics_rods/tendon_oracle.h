// SPDX-License-Identifier: Apache-2.0
/** @file Second integration of a rod with tendons, with other equations. */
#pragma once

#include "tests/unit/kinematics_rods/random_rods.h"

namespace tandem::test {

/** Integrates the strains: v' and u' by equations (17) of Rucker and Webster 2011, in which tendons are distributed
 * loads and, where they end, point loads. Starts with the reported strains at the clamp; the residual at the end
 * must vanish. */
struct TendonOracle {
  TendonOracle(const kinematics::cosserat::Rod& rod,
               const kinematics::cosserat::RodInput& input,
               const kinematics::cosserat::RodPoint& clamp);

  Eigen::Isometry3d pose;                   ///< of the rod's end
  Eigen::Vector3d left_force, left_moment;  ///< residual: of rod less load at the end, rod's frame, N and N m
};

}  // namespace tandem::test
