// SPDX-License-Identifier: Apache-2.0
/** @file Joint path between two points of a trajectory, by simulated control steps. */
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "planning/pose_problem.h"
#include "planning/reference.h"
#include "planning/trajectory.h"

namespace tandem::planning {

/** Joints come from q to a point in steps of at most 1 mm and 0.2 rad, shorter ones where these do not arrive, with the
 * method nspqp under the limits of the joints' positions, while the tips go along the straight way. Where that arrives
 * there is a way, however far the joints have gone: a witness against kReconfiguration that a programme over one point
 * cannot be. */
class StepPath {
 public:
  /// @param arm, other_arm  whose tip goes, and to which the relative position counts
  StepPath(const Arms& arms, int arm, int other_arm);

  /// @param accept  m. @return joints at the point, or less than 1 mm away where it comes no nearer; else nothing.
  std::optional<safety::RobotVector> go(const TrajectoryPoint& from,
                                        const TrajectoryPoint& to,
                                        const safety::RobotVector& q,
                                        double accept,
                                        const std::function<bool()>& cancelled) const;

  /// Where steps towards a point end that cannot be had.
  struct End {
    safety::RobotVector q;
    double error = 0.0;               ///< the larger one of the tip's and the relative position's, m
    std::vector<std::string> limits;  ///< that hold it there, in words, the heaviest first; empty: none does
  };
  End converge(const TrajectoryPoint& point,
               const safety::RobotVector& q,
               const std::function<bool()>& cancelled) const;

 private:
  Reference referenceTo(const TrajectoryPoint& point) const;
  /// @return how far the tips are, m; infinite where a step cannot be made.
  double approach(const TrajectoryPoint& point,
                  double accept,
                  bool finely,
                  safety::RobotVector& joints,
                  const std::function<bool()>& cancelled) const;

  Arms arms_;
  std::vector<safety::ArmLimits> limits_;  ///< without velocities
  int arm_, other_arm_;
};

}  // namespace tandem::planning
