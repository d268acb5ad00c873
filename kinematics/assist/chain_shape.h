// SPDX-License-Identifier: Apache-2.0
/** @file Shape of the two arms of a target-assist pair in equilibrium. */
#pragma once

#include <optional>
#include <vector>

#include "kinematics/assist/target_assist.h"

namespace tandem::kinematics::assist {

/** Cross-sections of both arms from the entry to the end of the bending section, robot base frame. Of the target's
 * distal end, an arc of constant curvature, pose, arc length and curvature alone are set. */
struct ChainShape {
  std::vector<cosserat::RodPoint> target, assist;
};

/** @param q, branch, chain  joints, memory and answer of one call of TargetAssist::solve() that returned kOk
 * @param points  per rod, at least 2
 * @return nothing if the rods that are integrated along their length do not end at the contact, to 1e-6 m */
std::optional<ChainShape> shapeOf(const Pair& pair,
                                  const Joints& q,
                                  const ChainBranch& branch,
                                  const Chain& chain,
                                  int points);

/// Largest bending strain of both arms: curvature times half the outer diameter.
double largestStrain(const Pair& pair, const Joints& q, const ChainShape& shape);

/// Least coordinate of both arms' cross-sections along the axis of their own base, m; below zero: behind the entry
/// plane.
double leastAdvance(const Pair& pair, const ChainShape& shape);

}  // namespace tandem::kinematics::assist
