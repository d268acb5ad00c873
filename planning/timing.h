// SPDX-License-Identifier: Apache-2.0
/** @file Time-optimal timing of a joint path under velocity and acceleration limits. */
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "idl/enumerations.h"
#include "safety/limits.h"

namespace tandem::planning {

struct TimingProblem {
  Eigen::MatrixXd path;          ///< one column per point, joints in m and rad; at least two
  Eigen::VectorXd velocity;      ///< largest speed of each joint, m/s and rad/s; infinite: none
  Eigen::VectorXd acceleration;  ///< m/s^2 and rad/s^2; infinite: none
};

/** Limits instead of those of the joints; 0: the joint's. */
struct TimingLimits {
  double translation_acceleration = 0.0;  ///< m/s^2
  double rotation_velocity = 0.0;         ///< rad/s
  double rotation_acceleration = 0.0;     ///< rad/s^2
  double free_rotation_velocity = 0.0;    ///< of rotations without a limit, rad/s
};

/// The problem of a path of all arms' joints, with the velocity and slew limits of the arms.
TimingProblem timingProblem(const std::vector<const safety::ArmLimits*>& arms,
                            Eigen::MatrixXd path,
                            const TimingLimits& wanted);

using idl::TimingStatus;

struct Timing {
  TimingStatus status = TimingStatus::kInvalid;
  std::vector<double> time;  ///< of each point, s; the first is 0
  /// Joint that limits each segment of the path: the one nearest to its velocity limit; -1: an acceleration limit.
  std::vector<int> limiting;
  double total() const { return time.empty() ? 0.0 : time.back(); }
};

/** Time-optimal timing (Verscheure et al. 2009). With the path parameter s = k at point k and x_k = s'(t)^2 there,
 *
 *     min_x  sum_k 2 / (sqrt x_k + sqrt x_(k+1))
 *     s.t.   x_k <= (V_j / |q_j,k+1 - q_j,k|)^2  for both segments at k and all joints j,
 *            |q'_j,k u_k + q''_j,k x_k| <= A_j,
 *            |q'_j,k+1 u_k + q''_j,k+1 x_(k+1)| <= A_j,   u_k = (x_(k+1) - x_k) / 2,
 *            x_0 = x_N = 0 if a joint has an acceleration limit: the path begins and ends at standstill,
 *
 * with q' and q'' by central differences, one-sided at the ends. The problem is convex and solved with Ipopt. Without
 * acceleration limits every segment takes max_j |q_j,k+1 - q_j,k| / V_j.
 * kUnlimited: a segment moves only joints without velocity limit. kInvalid: fewer than two points, sizes that differ, a
 * value that is not finite, a limit that is not above zero. */
Timing timeOptimal(const TimingProblem& problem, const std::function<bool()>& cancelled = {});

}  // namespace tandem::planning
