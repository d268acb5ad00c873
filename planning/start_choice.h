// SPDX-License-Identifier: Apache-2.0
/** @file Choice of start configuration: the one with the largest margin to all limits along the trajectory. */
#pragma once

#include "planning/feasibility.h"

namespace tandem::planning {

/** Room at joints q: the smallest distance to the joints' boxes and rows, in units of 0.1 m and 1 rad, or the margin of
 * the stability above the demanded one if that is smaller. */
double roomAt(const Arms& arms, const safety::RobotVector& q, double stability, const Demands& demands);

struct StartCandidate {
  safety::RobotVector q;
  int unreachable = 0;     ///< points of the trajectory that cannot be reached from this start
  double room = 0.0;       ///< smallest over all points, the start included
  double mean_room = 0.0;  ///< of all points
};

struct StartChoice {
  std::vector<StartCandidate> candidates;  ///< the best first; includes the given start
  bool cancelled = false;
};

struct StartOptions {
  FeasibilityOptions feasibility;
  int tries = 20;        ///< number of random references, each for one candidate
  int most_points = 25;  ///< longer trajectories are reduced to this number of points
  std::function<void(int tried, int tries)> progress;
};

/** Chooses    max_q0 min_k room(q_k)    over the starts q0 that have the tips of `given` and from which the
 * trajectory's points q_1 .. q_N follow by continuation; candidates with fewer unreachable points come first.
 * Candidates are the joints that reach those tips nearest to random references, so the result is the best of `tries`
 * candidates, not a global optimum. */
StartChoice chooseStart(const Arms& arms,
                        const TrajectorySpec& spec,
                        const safety::RobotVector& given,
                        const StartOptions& options);

}  // namespace tandem::planning
