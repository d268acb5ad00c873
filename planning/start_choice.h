// SPDX-License-Identifier: Apache-2.0
/** @file Choice of start configuration: the one with the largest margin to all limits along the trajectory. */
#pragma once

#include "planning/feasibility.h"

namespace tandem::planning {

/** Room at joints q: the smallest of the distances to the joints' boxes and rows, per 0.1 m and 1 rad, and of the
 * stability above the one that is demanded. */
double roomAt(const Arms& arms, const safety::RobotVector& q, double stability, const Demands& demands);

struct StartCandidate {
  safety::RobotVector q;
  int unreachable = 0;     ///< points of the trajectory that cannot be had from there
  double room = 0.0;       ///< smallest over all points, the start included
  double mean_room = 0.0;  ///< of all points
};

struct StartChoice {
  std::vector<StartCandidate> candidates;  ///< the best first; the given start is one of them
  bool cancelled = false;
};

struct StartOptions {
  FeasibilityOptions feasibility;
  int tries = 20;        ///< random references from which starts are looked for
  int most_points = 25;  ///< a trajectory of more points is judged by so many
  std::function<void(int tried, int tries)> progress;
};

/** Chooses    max_q0 min_k room(q_k)    over the starts q0 that have the tips of `given` and from which the
 * trajectory's points q_1 .. q_N follow by continuation; candidates with fewer unreachable points come first.
 * Candidates are the joints that reach those tips nearest to random references, so the choice is the best of `tries`,
 * not of all. */
StartChoice chooseStart(const Arms& arms,
                        const TrajectorySpec& spec,
                        const safety::RobotVector& given,
                        const StartOptions& options);

}  // namespace tandem::planning
