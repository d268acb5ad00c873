// SPDX-License-Identifier: Apache-2.0
/** @file Mechanism: interface of robots whose arms move one thing together, for the methods of control/.
 * docs/own-robot-type.md adds one. */
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <utility>
#include <vector>

#include "control/step_problem.h"
#include "planning/object_path.h"

namespace tandem::robots {

using planning::Twist;
using safety::RobotVector;
using MotionJacobian = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/** A robot at rest at some joints. settle() is called first, and all else is about the joints that it was called with.
 */
class Mechanism {
 public:
  virtual ~Mechanism() = default;

  /// Of the arms in the order in which their joints stand in joint vectors.
  virtual const std::vector<const safety::ArmLimits*>& limits() const = 0;
  virtual RobotVector home() const = 0;

  /// Comes to rest at joints (m, rad). @return empty, or why there is no rest there; the last rest then stays
  virtual std::string settle(const RobotVector& q) = 0;

  /// robot base frame <- frame of what is to be moved: a tip, an object
  virtual const Eigen::Isometry3d& pose() const = 0;
  /// Twist of that frame by joint velocity, for joint velocities that do what above() wants.
  virtual const MotionJacobian& jacobian() const = 0;
  /// m: makes a radian as large as this many metres where directions are judged.
  virtual double length() const = 0;

  /// What comes before the motion, highest priority first: contacts that may not slip. @param gain  1/s, of errors
  virtual std::vector<control::Task> above(double gain) const {
    static_cast<void>(gain);
    return {};
  }
  /// What comes after it: forces that shall stay as they are.
  virtual std::vector<control::Task> below(double gain) const {
    static_cast<void>(gain);
    return {};
  }

  /// Why what above() wants would not do even if it came true, in words: contacts that slip under the forces that they
  /// are to be held at. Asked before anything moves. Empty: nothing.
  virtual std::string impossible() const { return {}; }
  /// What is wrong with this rest although it is one, in words: a contact that slips. Empty: nothing.
  virtual std::string trouble() const { return {}; }
  /// By how much what above() wants is not so, m: 0 where it wants nothing.
  virtual double drift() const { return 0.0; }
  /// Further numbers of this rest, a name with its unit and a value: columns of the table.
  virtual std::vector<std::pair<std::string, double>> facts() const { return {}; }
  /// Where the tool tips of the arms are, robot base frame; empty where that is not known.
  virtual std::vector<Eigen::Isometry3d> tips() const { return {}; }
  /// Points of the arms, for a figure: a list of places, m, robot base frame, for each arm.
  virtual std::vector<std::vector<Eigen::Vector3d>> shapes() const { return {}; }
};

}  // namespace tandem::robots
