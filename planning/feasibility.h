// SPDX-License-Identifier: Apache-2.0
/** @file Feasibility check of a trajectory from a given start configuration, and its nearest feasible version. */
#pragma once

#include <functional>
#include <vector>

#include "planning/inverse_kinematics.h"
#include "planning/trajectory.h"

namespace tandem::planning {

/** How one point of a trajectory can be had. */
struct PointReport {
  int point = 0;  ///< counts from 1; 0: the start
  TrajectoryPoint wanted;
  Reach reach = Reach::kReached;
  std::string words;      ///< why not
  safety::RobotVector q;  ///< joints at the point, or at the nearest one that can be had
  Eigen::Vector3d tip = Eigen::Vector3d::Zero(), actual_relative = Eigen::Vector3d::Zero();  ///< there, m
  double error = 0.0;                                                                        ///< of the tip, m
  double relative_error = 0.0;                                                               ///< m
  double stability = 1.0, clearance = safety::kUnlimited;                                    ///< as IkAnswer's
};

struct FeasibilityReport {
  std::vector<PointReport> points;  ///< all of them, or up to where it was cancelled or stopped
  bool feasible = false;
  bool cancelled = false;
  std::string start;  ///< what is wrong with the start itself; empty if nothing
  /// Second singular value of the rotations' columns of a tip's Jacobian, the smaller of both arms, m/rad. Zero where
  /// all tubes bend in one plane: at first order rotations then only move the tip across that plane.
  double rotation_conditioning = 0.0;
  bool planar_start = false;
  int unreachable() const;
  /// Joints at all points: postures for a Follower.
  std::vector<safety::RobotVector> path() const;
};

struct FeasibilityOptions {
  IkOptions ik;
  double accept = 1e-5;  ///< m: points nearer than this are reached
  /// Joints may move by this much from one point to the next, m and rad; farther is another configuration of the arm.
  double translation_jump = 0.02, rotation_jump = 1.5;
  /// Where they move by more than this, the way between two points is halved, at most so often, until they do not.
  double translation_step = 0.01, rotation_step = 0.3;
  int halvings = 4;
  int stop_after = 0;  ///< unreachable points, of which no more need be known; 0: all points are looked at
  std::function<void(int point, int points)> progress;  ///< may be empty
};

/** Follows a trajectory point by point, each inverse kinematics problem starting from the joints, and the equilibria,
 * of the point before:
 *
 *     q_k = argmin 1/2 |z - z_(k-1)|^2   s.t.  p_A(q) = x_A,k,   p_A(q) - p_B(q) = x_AB,k,   all limits and demands.
 *
 * Where joints move far between two points, the way is halved: what jumps however short the way is no way. A point that
 * cannot be had so is looked for from everywhere. If it is found, the arms would have to go to another
 * configuration (kReconfiguration); else the nearest point that keeps x_AB,k is answered, with the reason.
 * @param start  joints of all arms; the trajectory's offsets count from their tips */
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
 * place, are made smooth by
 *
 *     min_s  sum_k w_k |s_k - d_k|^2 + mu sum_k |s_(k-1) - 2 s_k + s_(k+1)|^2,   w_k = 100 at points that were moved,
 * else 1,
 *
 * and the moved trajectory is checked again. In the last rounds mu = 0, so that only what cannot be had is moved. The
 * relative position stays as it was asked for. */
RepairResult repairTrajectory(const Arms& arms,
                              const TrajectorySpec& spec,
                              const safety::RobotVector& start,
                              const FeasibilityOptions& options,
                              double smoothing = 3.0);

}  // namespace tandem::planning
