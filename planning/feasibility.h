// SPDX-License-Identifier: Apache-2.0
/** @file Feasibility check of a trajectory from a given start configuration, and its nearest feasible version. */
#pragma once

#include <functional>
#include <vector>

#include "planning/inverse_kinematics.h"
#include "planning/trajectory.h"

namespace tandem::planning {

/** Feasibility of one point of a trajectory. */
struct PointReport {
  int point = 0;  ///< counts from 1; 0: the start
  TrajectoryPoint wanted;
  Reach reach = Reach::kReached;
  std::string reason;     ///< reason if it is not reached
  safety::RobotVector q;  ///< joints at the point, or at the nearest feasible one
  Eigen::Vector3d tip = Eigen::Vector3d::Zero(), actual_relative = Eigen::Vector3d::Zero();  ///< at these joints, m
  double error = 0.0;                                                                        ///< of the tip, m
  double relative_error = 0.0;                                                               ///< m
  double stability = 1.0, clearance = safety::kUnlimited;                                    ///< as in IkAnswer
};

struct FeasibilityReport {
  std::vector<PointReport> points;  ///< all of them, or those before the check was cancelled or stopped
  bool feasible = false;
  bool cancelled = false;
  std::string start;  ///< error of the start itself; empty: none
  /// Second singular value of the rotations' columns of a tip's Jacobian, the smallest one of the trajectory's arms,
  /// m/rad. Zero if all tubes bend in one plane: to first order rotations then move the tip only perpendicular to that
  /// plane.
  double rotation_conditioning = 0.0;
  bool planar_start = false;
  int unreachable() const;
  /// Joints at all points: postures for a Follower.
  std::vector<safety::RobotVector> path() const;
  /// The same with the start before it, one column per point.
  Eigen::MatrixXd pathFrom(const safety::RobotVector& start_joints) const;
};

struct FeasibilityOptions {
  IkOptions ik;
  double accept = 1e-5;  ///< m: points with a smaller error count as reached
  /// Largest joint motion from one point to the next, m and rad; a larger one is another configuration of the arm.
  double translation_jump = 0.02, rotation_jump = 1.5;
  /// Joint motion, m and rad, above which the path between two points is halved, up to `halvings` times.
  double translation_step = 0.01, rotation_step = 0.3;
  int halvings = 4;
  int stop_after = 0;  ///< number of unreachable points after which the check stops; 0: it checks all points
  std::function<void(int point, int points)> progress;  ///< may be empty
};

/** Follows a trajectory point by point. Each inverse kinematics problem starts from the joints and equilibria of the
 * previous point:
 *
 *     q_k = argmin 1/2 |z - z_(k-1)|^2   s.t.  p_A(q) = x_A,k,   p_A(q) - p_B(q) = x_AB,k,   all limits and demands.
 *
 * If joints move far between two points, the path is halved; joints that jump at every path length are not continuous.
 * A point that is not reached so is searched for globally. If it is found, the arms would have to change their
 * configuration (kReconfiguration); else the result is the nearest point that keeps x_AB,k, with the reason. Further
 * tasks of the trajectory have no part in it.
 * @param start  joints of all arms; the trajectory's offsets are relative to their tips */
FeasibilityReport checkTrajectory(const Arms& arms,
                                  const TrajectorySpec& spec,
                                  const safety::RobotVector& start,
                                  const FeasibilityOptions& options);

struct RepairResult {
  TrajectorySpec spec;  ///< absolute waypoints
  FeasibilityReport before, after;
  int rounds = 0;
  double largest_change = 0.0, rms_change = 0.0;  ///< of the tip's points, m
};

/** The nearest feasible trajectory. In every round the points' corrections d_k, from the wanted to the nearest feasible
 * position, are smoothed by
 *
 *     min_s  sum_k w_k |s_k - d_k|^2 + mu sum_k |s_(k-1) - 2 s_k + s_(k+1)|^2,
 *
 * with w_k = 100 at points that were moved, else 1, and the moved trajectory is checked again. The last rounds use
 * mu = 0, so that only infeasible points move. The relative position keeps its original values. */
RepairResult repairTrajectory(const Arms& arms,
                              const TrajectorySpec& spec,
                              const safety::RobotVector& start,
                              const FeasibilityOptions& options,
                              double smoothing = 3.0);

}  // namespace tandem::planning
