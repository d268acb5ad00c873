// SPDX-License-Identifier: Apache-2.0
/** @file Optimisation problems of inverse kinematics: objective, constraints, solution. */
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "kinematics/clearance.h"
#include "safety/limits.h"

namespace tandem::planning {

/** The arms of a robot for planning; the objects that it points to must outlive it. */
struct Arms {
  std::vector<const kinematics::ArmModel*> models;
  std::vector<const safety::ArmLimits*> limits;
  std::vector<std::string> names = {};  ///< for texts; of arms without one: a, b, ...

  int count() const { return static_cast<int>(models.size()); }
  int size(int arm) const { return models[static_cast<std::size_t>(arm)]->jointCount(); }
  int offset(int arm) const;  ///< of the arm's first joint in the stacked vector
  int jointCount() const { return offset(count()); }
  std::string label(int arm) const;  ///< "arm left"
};

/// Unit of residuals and constraints that are distances, m.
inline constexpr double kLengthUnit = 0.01;

/** Desired position of a tip, and optionally its direction or its orientation. */
struct TipTarget {
  int arm = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, robot base frame
  std::optional<Eigen::Vector3d> direction = {};       ///< of the tool's z axis, unit vector, robot base frame
  std::optional<Eigen::Quaterniond> orientation = {};  ///< robot base frame <- tool, unit; includes the direction

  /** A desired axis of the tool. */
  struct Axis {
    int column = 2;                                      ///< of the tool's rotation matrix
    Eigen::Vector3d desired = Eigen::Vector3d::UnitZ();  ///< unit vector, robot base frame
    /// E' and then d': products with the axis that are zero where it is the desired one, and one that is then positive.
    Eigen::Matrix<double, Eigen::Dynamic, 3, 0, 3, 3> rows;
  };
  /// None; z of a direction; z and x of an orientation.
  std::vector<Axis> axes() const;
  /// Angle of the smallest rotation to the direction or orientation, rad; 0 of a position. @param tool  pose of the
  /// tool
  double turned(const Eigen::Isometry3d& tool) const;
};

/** Demands on a pose in addition to the limits of the joints; absent ones are not checked. */
struct Demands {
  std::optional<double> stability;       ///< smallest Tip::stability of every arm
  std::optional<double> clearance;       ///< smallest distance between any two arms, m
  std::optional<kinematics::Port> port;  ///< port that no arm may touch
  double port_clearance = 0.0;           ///< smallest distance to it, m
};

/** One inverse kinematics problem over the joints q of all arms, with z_j = q_j / u_j, u = 0.1 m or 1 rad.
 *
 * Residuals of target k: r_k = [(p_k(q) - t_k) / 10 mm; 5 (a_k(q) - d_k)], the second part for the z axis a_k of a
 * direction, and for z and x of an orientation.
 *
 *     reach:    min  1/2 |z - z_ref|^2                        s.t.  p_k(q) = t_k,  E_k' a_k(q) = 0,  d_k' a_k(q) >= 0
 *     nearest:  min  1/2 sum_k |r_k|^2 + 1/2 rho |z - z_ref|^2
 *     nearest, relative kept:  min 1/2 |r_1|^2 + ...          s.t.  p_1(q) - p_2(q) = t_1 - t_2
 *
 * and all of them  lower <= q <= upper,  |q - q_ref| <= trust,  A q <= b  (equation (1) of Alsaka et al. 2024),
 * stability_i(q) >= sigma, clearance_ij(q) >= c,  port_i(q) >= c_port; E_k spans the plane across d_k, for x of an
 * orientation the part of it across z; rho = 1e-8 makes the minimum unique. */
struct PoseProblem {
  const Arms* arms = nullptr;
  std::vector<TipTarget> targets;
  safety::RobotVector reference;             ///< q_ref
  std::vector<kinematics::Branch> branches;  ///< one per arm, from which equilibria are followed; unknown: cold
  bool nearest = false;
  bool keep_relative = false;  ///< of the first two targets
  Demands demands;
  /// Largest |q - q_ref| of translations and rotations, m and rad: for continuation. Infinite: unbounded.
  double translation_trust = safety::kUnlimited, rotation_trust = safety::kUnlimited;

  /// Box of a joint of the stacked vector: the intersection of its limits with the trust region around q_ref.
  safety::Interval box(int joint) const;
  static double unit(const Arms& arms, int joint);  ///< u_j, m or rad
};

/** Meaning of a constraint row. */
struct ConstraintName {
  enum class Kind { kTarget, kRelative, kRow, kStability, kClearance, kPort } kind;
  int arm = 0;
  int index = 0;  ///< row of the arm's limits, or the other arm
};

/** Objective, constraints and exact first derivatives at one q, in the units of the problem. */
struct PosePoint {
  bool answered = false;  ///< every model has a solution
  kinematics::ModelStatus status = kinematics::ModelStatus::kOk;
  std::vector<kinematics::Tip> tips;
  std::vector<kinematics::Branch> branches;
  double objective = 0.0;
  Eigen::VectorXd gradient;     ///< of the objective with respect to z
  Eigen::VectorXd constraints;  ///< g
  Eigen::MatrixXd jacobian;     ///< dg / dz
  Eigen::VectorXd lower, upper;
  std::vector<ConstraintName> names;
};

PosePoint evaluate(const PoseProblem& problem, const safety::RobotVector& q);

/// Hessian of the Lagrangian, the targets' part: d / dz of sum_k R_k(q)' w_k over the targets, R_k = d r_k / dz, and of
/// 1/2 factor sum |r_k|^2, by central differences of exact gradients. @param multipliers  of the constraints
Eigen::MatrixXd curvature(const PoseProblem& problem,
                          const safety::RobotVector& q,
                          double factor,
                          const Eigen::VectorXd& multipliers);

struct PoseSolution {
  bool solved = false;     ///< the tolerances are reached
  bool cancelled = false;  ///< requested by the caller
  bool iteration_limit = false;
  safety::RobotVector q;
  Eigen::VectorXd multipliers;        ///< of the constraints; positive: active at the upper bound
  Eigen::VectorXd joint_multipliers;  ///< of the boxes, upper minus lower
  int iterations = 0;
};

/// Solves from `start`, which must be inside the limits: by steps where that converges, otherwise with Ipopt.
PoseSolution solve(const PoseProblem& problem,
                   const safety::RobotVector& start,
                   int max_iterations,
                   const std::function<bool()>& cancelled);

}  // namespace tandem::planning
