// SPDX-License-Identifier: Apache-2.0
/** @file Joint path between two points of a trajectory, by simulated control steps. */
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "planning/pose_problem.h"
#include "planning/reference_tracker.h"
#include "planning/trajectory.h"

namespace tandem::planning {

/** Simulated joint motion from q to a point in steps of at most 1 mm and 0.2 rad, shorter ones if these do not arrive,
 * with the method nspqp under the joints' position limits, while the tips move along the straight line. Arrival proves
 * a continuous path, however far the joints have moved: a counterexample to kReconfiguration that an optimisation over
 * one point cannot give. */
class StepPath {
 public:
  StepPath(const Arms& arms, const TrajectorySpec& spec);

  /// @param accept  m. @return joints at the point, or less than 1 mm away if there is no further progress; else
  /// nothing.
  std::optional<safety::RobotVector> go(const TrajectoryPoint& from,
                                        const TrajectoryPoint& to,
                                        const safety::RobotVector& q,
                                        double accept,
                                        const std::function<bool()>& cancelled) const;

  /// End of steps towards an unreachable point.
  struct End {
    safety::RobotVector q;
    double error = 0.0;               ///< the larger of tip error and relative error, m
    std::vector<std::string> limits;  ///< active limits there, in words, the largest multiplier first; empty: none
  };
  End converge(const TrajectoryPoint& point,
               const safety::RobotVector& q,
               const std::function<bool()>& cancelled) const;

 private:
  /// Errors of relative position and tip after a step, m.
  std::pair<double, double> errorsOf(const TrackResult& result) const;
  /// @return distance of the tips from the point, m; infinite if a step fails.
  double approach(const TrajectoryPoint& point,
                  double accept,
                  bool finely,
                  safety::RobotVector& joints,
                  const std::function<bool()>& cancelled) const;

  Arms arms_;
  std::vector<safety::ArmLimits> limits_;  ///< without velocities
  TrajectorySpec spec_;
};

}  // namespace tandem::planning
