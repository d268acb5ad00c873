// SPDX-License-Identifier: Apache-2.0
/** @file Closed-loop tracking of a path by a mechanism, in one process. */
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "control/resolver.h"
#include "robots/mechanism.h"

namespace tandem::robots {

using planning::difference;
using planning::displaced;
using planning::Kept;
using planning::ObjectPath;
using planning::PathShape;

/// A path starts when the residual of the contact constraints is below this fraction of its limit.
inline constexpr double kPrepared = 0.02;
/// Reason of a run whose residual stays above it.
inline const std::string kContactsNotReady = "contact constraints are not satisfied at the start";

struct TrackOptions {
  control::Method method = control::Method::kNspqp;
  control::MethodParameters parameters;
  double gain = 5.0;               ///< 1/s, on all errors
  double preparation_time = 20.0;  ///< s, to satisfy the contact constraints before the path starts
  double residual_limit = 1e-4;    ///< m: a run with a larger residual of the contact constraints fails
  double most_error = 1e-3;  ///< m: a run with a larger error of the tracked components fails (radians times length())
};

/** State of one period. */
struct TrackStep {
  double time = 0.0;            ///< s; negative before the path starts
  RobotVector joints;           ///< m, rad
  Eigen::Isometry3d pose;       ///< of the object
  double error = 0.0;           ///< of the tracked components, m; radians times length()
  double residual = 0.0;        ///< see Mechanism::residual(), m
  std::vector<double> columns;  ///< see Mechanism::columns()
  int active_limits = 0;        ///< number of active limits of the joint velocities
  control::SolveStatus status = control::SolveStatus::kSolved;
};

/// Record of a period at its start, without error, limits and status. @param mechanism  in equilibrium at the joints
TrackStep noteStep(const Mechanism& mechanism, const RobotVector& joints, double time);

/** Record of a run. */
struct TrackRecord {
  std::string refused;             ///< why the run did not start; empty: it started
  std::string stopped;             ///< why the run failed; empty: no failure
  std::vector<std::string> names;  ///< of columns
  std::vector<TrackStep> steps;
  double rms_error = 0.0, max_error = 0.0, max_residual = 0.0;        ///< along the path, m
  std::vector<std::vector<Eigen::Vector3d>> first_shape, last_shape;  ///< see Mechanism::shapes()

  bool good() const { return refused.empty() && stopped.empty(); }
};

/// Computes the errors of a run from its steps, and sets `stopped` if they are too large.
void judge(const TrackOptions& options, TrackRecord& record);

/** Tracked directions in which the object can and cannot move while higherTasks() is satisfied; columns are twists. */
struct MotionSpace {
  Eigen::Matrix<double, 6, Eigen::Dynamic> movable, missing;
};
MotionSpace motionSpace(const Mechanism& mechanism, const std::vector<int>& tracked);

/// Speed of the object along a direction (0 to 5: x to rz) at which the first joint reaches its velocity limit, while
/// higherTasks() is satisfied and joint velocities have the least norm in units of their limits. m/s; for rotations
/// multiplied by length().
double attainableSpeed(const Mechanism& mechanism, int direction);

/// Reason why a mechanism cannot follow a path from its equilibrium; empty: it can.
std::string refusal(const Mechanism& mechanism, const ObjectPath& path);

/** Moves the arms until higherTasks() is satisfied, with the object kept at its pose of home.
 * @param joints  result, m and rad  @return empty, or why higherTasks() is not satisfied */
std::string prepare(Mechanism& mechanism, const TrackOptions& options, RobotVector& joints);

/** Follows a path. Each period computes the equilibrium, solves the hierarchy higherTasks() > path > lowerTasks() >
 * posture at home with limits, and takes a step. The path starts after prepare(), if refusal() is empty.
 * @param progress  called with a time and the duration, s
 * @throw std::invalid_argument as ObjectPath::check() and control::makeResolver() do, or for more tasks or rows than
 * control/ accepts. */
TrackRecord track(Mechanism& mechanism,
                  const ObjectPath& path,
                  const TrackOptions& options,
                  const std::function<void(double, double)>& progress = {});

}  // namespace tandem::robots
