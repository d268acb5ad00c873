// SPDX-License-Identifier: Apache-2.0
/** @file Independent solver of two rods in contact, as one boundary value problem. */
#pragma once

#include "kinematics/assist/target_assist.h"

namespace tandem::test {

/** Equations (12) as printed except (12.b), in the rod's frame: forces and moments at both clamps are twelve
 * unknowns, agreement of the poses and balance at the contact are twelve conditions. Boost.odeint integrates,
 * Newton's method with finite differences solves, starting near a solution. */
struct TwoRodsOracle {
  TwoRodsOracle(const kinematics::assist::Pair& pair,
                const kinematics::assist::Joints& q,
                const kinematics::assist::ChainBranch& near);

  double gap = 0.0;                                     ///< of the contact, m
  kinematics::Wrench force_on_target, force_on_assist;  ///< at the contact, from each rod's own end
  Eigen::Isometry3d tip;                                ///< of the target
};

}  // namespace tandem::test
