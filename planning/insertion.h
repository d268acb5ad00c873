// SPDX-License-Identifier: Apache-2.0
/** @file Insertion of an arm along its own path. */
#pragma once

#include "planning/pose_problem.h"
#include "planning/trajectory.h"

namespace tandem::planning {

/** Computes the joints of an insertion from those at the start, and the tips that follow from them: Insertion::joints
 * and ::tips, point_count of each, evenly spaced over the sum of the stages' lengths,
 *
 *     beta_i = beta_i(0) + length advanced in stages with tubes >= i,   alpha_i = alpha_i(0) + h_i(0) - h_i,
 *
 * with h_i = ArmModel::helixAngle(): a helical tube turns by tau_i per length as it advances, like a corkscrew.
 *
 * The shaft stays on the path of its tip where every stage moves tubes that end together, outer tubes come to rest
 * before inner ones, and every tube has one curvature and one torsion over all of its part in front of the entry point:
 * then tube i at s bends in the direction alpha_i(0) + h_i(0) + tau_i s always, and the backbone at an arc length never
 * changes once it is there. Elastic tubes twist each other unless they bend in one plane at every s, to the same side
 * or to opposite ones: their torsions must be equal where they overlap, and their directions equal or opposite
 * (Gilbert, Neimat & Webster 2015, circular case tau_i = 0, and helical case). Does nothing to other shapes.
 * @param start  joints of all arms
 * @throw std::invalid_argument for an arm with fewer tubes that advance, or where a model has no solution */
void setInsertion(const Arms& arms, const safety::RobotVector& start, TrajectorySpec& spec);

}  // namespace tandem::planning
