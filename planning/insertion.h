// SPDX-License-Identifier: Apache-2.0
/** @file Insertion of an arm along its own path. */
#pragma once

#include "planning/pose_problem.h"
#include "planning/trajectory.h"

namespace tandem::planning {

/** Computes the joints of an insertion from those at the start, and the tips that follow from them: Insertion::joints
 * and ::tips, point_count of each, evenly spaced over the sum of the stages' lengths,
 *
 *     beta_i = beta_i(0) + length advanced in stages with tubes >= i,   alpha_i = alpha_i(0).
 *
 * The shaft stays on the path of its tip where every stage moves tubes that end together, outer tubes come to rest
 * before inner ones, and every tube has one curvature over all of its part in front of the entry point. Then the
 * backbone at an arc length never changes once it is there. Elastic tubes must also be bent in one plane: others twist
 * each other (Gilbert, Neimat & Webster 2015, circular case; the helical case needs helical tubes, which the models do
 * not have).
 * Does nothing to other shapes.
 * @param start  joints of all arms
 * @throw std::invalid_argument for an arm with fewer tubes that advance, or where a model has no solution */
void setInsertion(const Arms& arms, const safety::RobotVector& start, TrajectorySpec& spec);

}  // namespace tandem::planning
