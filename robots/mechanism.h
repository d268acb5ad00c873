// SPDX-License-Identifier: Apache-2.0
/** @file Mechanism: interface of arms that move a common object, for the methods of control/. docs/own-robot-type.md
 * describes how to add one. */
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "control/step_problem.h"
#include "planning/object_path.h"

namespace tandem::robots {

using planning::Twist;
using safety::RobotVector;
using MotionJacobian = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/** Arms and their common object in equilibrium. solveEquilibrium() computes an equilibrium; all other members refer to
 * the last one. */
class Mechanism {
 public:
  virtual ~Mechanism() = default;

  /// Limits of the arms, in the order of their joints in joint vectors.
  virtual const std::vector<const safety::ArmLimits*>& limits() const = 0;
  virtual RobotVector home() const = 0;

  /// Computes the equilibrium at joints (m, rad). @return empty, or why there is none; the last one then stays valid
  virtual std::string solveEquilibrium(const RobotVector& q) = 0;

  /// robot base frame <- object frame
  virtual const Eigen::Isometry3d& pose() const = 0;
  /// Twist of the object per joint velocity (linear rows first), for joint velocities that satisfy higherTasks().
  virtual const MotionJacobian& jacobian() const = 0;
  /// Length that converts radians to metres, m.
  virtual double length() const = 0;

  /// Tasks with a higher priority than the motion, highest first: contact constraints. @param gain  on errors, 1/s
  virtual std::vector<control::Task> higherTasks(double gain) const {
    static_cast<void>(gain);
    return {};
  }
  /// Tasks with a lower priority than the motion: regulation of contact forces.
  virtual std::vector<control::Task> lowerTasks(double gain) const {
    static_cast<void>(gain);
    return {};
  }

  /// Reason why the specified contact forces cannot hold the object, for example because contacts would slip; empty:
  /// they can. Checked before the arms move.
  virtual std::string infeasibility() const { return {}; }
  /// Reason why this equilibrium cannot be used, for example because a contact slips; empty: it can.
  virtual std::string error() const { return {}; }
  /// Residual of higherTasks(), m; 0 without such tasks.
  virtual double residual() const { return 0.0; }
  /// Further values of this equilibrium, for the columns of the table: name with unit, and value.
  virtual std::vector<std::pair<std::string, double>> columns() const { return {}; }
  /// Poses of the tool tips, robot base frame; empty if unknown.
  virtual std::vector<Eigen::Isometry3d> tips() const { return {}; }
  /// Wrench on each of them by what the arm holds or pushes: force N, moment N m about the tip, robot base frame; none
  /// where it is not known or another place of the arm is touched. Empty: of no tip.
  virtual std::vector<std::optional<Twist>> tipWrenches() const { return {}; }
  /// Points along each arm for drawings, m, robot base frame.
  virtual std::vector<std::vector<Eigen::Vector3d>> shapes() const { return {}; }
};

}  // namespace tandem::robots
