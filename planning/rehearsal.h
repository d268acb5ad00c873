// SPDX-License-Identifier: Apache-2.0
/** @file Rehearsal: simulation of a method in closed loop with ideal joints, before a trajectory runs. */
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "idl/enumerations.h"
#include "planning/method_settings.h"
#include "planning/pose_problem.h"
#include "planning/trajectory.h"

namespace tandem::planning {

using idl::name;
using idl::RehearsalEnd;

struct RehearsalOptions {
  MethodSettings settings;
  std::vector<std::string> arms;                        ///< names for messages; empty: a, b, ...
  std::function<bool()> cancelled;                      ///< may be empty
  std::function<void(int point, int points)> progress;  ///< may be empty
};

/// Joints on the way, and the point of the trajectory that they go to, from 1; 0: none yet.
struct RehearsedJoints {
  safety::RobotVector q;
  int point = 0;
};

/// Joints of a run at equal distances of time. When there are too many, every second one goes and the distance doubles.
struct RehearsedPath {
  static constexpr std::size_t kMost = 128;

  std::vector<RehearsedJoints> joints;  ///< of the start, then one per `stride` control periods; last those of the end
  int stride = 1;                       ///< control periods

  /// @param period  counts from 0; called for each, in order
  void add(int period, const RehearsedJoints& joints);
  /// @param period  the last one
  void finish(int period, const RehearsedJoints& joints);
};

struct Rehearsal {
  RehearsalEnd end = RehearsalEnd::kInvalid;
  int points = 0;
  int converged = 0;                ///< points reached within the tolerance
  int point = 0;                    ///< the first unreached point, counts from 1; 0: none
  double tip_error = 0.0;           ///< at the end of that point, m
  double relative_error = 0.0;      ///< m
  std::vector<std::string> limits;  ///< active limits at that point, the largest multiplier first
  std::string reason;               ///< summary of all this; empty if the run completes
  int iterations = 0;
  double largest_violation = 0.0;  ///< of equation (1) and the boxes along the path, after the gate, m or rad
  double fastest_rotation = 0.0;   ///< rad/s
  /// Smallest distance of the bodies of any two arms at the joints of `path`, m; below zero they overlap; infinite for
  /// one arm, and where no model has a solution.
  double least_clearance = safety::kUnlimited;
  safety::RobotVector q;  ///< joints at the end
  RehearsedPath path;
};

/** Runs follower, tracker and gate with ideal joints that follow their setpoints exactly. A run continues after an
 * unreached point with the next one, as the follower does.
 * @param postures  planned joints, one vector per point (FeasibilityReport::path()); empty: none */
Rehearsal rehearse(const Arms& arms,
                   const TrajectorySpec& spec,
                   const safety::RobotVector& start,
                   const std::vector<safety::RobotVector>& postures,
                   const RehearsalOptions& options);

}  // namespace tandem::planning
