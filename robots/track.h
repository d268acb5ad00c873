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
using planning::Hold;
using planning::ObjectPath;
using planning::PathShape;

/// Of the drift that is allowed, where a path may begin.
inline constexpr double kPrepared = 0.02;
/// What is said where it does not come to that.
inline const std::string kUnprepared = "contact constraints are not satisfied at the start";

struct TrackOptions {
  control::Method method = control::Method::kNspqp;
  control::MethodParameters parameters;
  double gain = 5.0;         ///< 1/s, of all errors
  double patience = 20.0;    ///< s, for above() to come true before the path begins
  double most_drift = 1e-4;  ///< m: a run that drifts farther fails
  double most_error = 1e-3;  ///< m: a run whose tracked components are farther off (radians by length()) fails
};

/** One period. */
struct TrackStep {
  double time = 0.0;          ///< s; below zero before the path begins
  RobotVector joints;         ///< m, rad
  Eigen::Isometry3d pose;     ///< of what is moved
  double error = 0.0;         ///< of the tracked components, m; radians count length() each
  double drift = 0.0;         ///< see Mechanism::drift(), m
  std::vector<double> facts;  ///< see Mechanism::facts()
  int active_limits = 0;      ///< at which the joint velocities stand
  control::SolveStatus status = control::SolveStatus::kSolved;
};

/// What is known of a period at its beginning, without error, limits and status. @param mechanism  at rest at the
/// joints
TrackStep noteStep(const Mechanism& mechanism, const RobotVector& joints, double time);

/** What a run leaves behind. */
struct TrackRecord {
  std::string refused;             ///< why nothing has moved; empty where it has
  std::string stopped;             ///< why the run ended before its path did, or is none that counts
  std::vector<std::string> names;  ///< of facts
  std::vector<TrackStep> steps;
  double rms_error = 0.0, max_error = 0.0, max_drift = 0.0;           ///< along the path, m
  std::vector<std::vector<Eigen::Vector3d>> first_shape, last_shape;  ///< see Mechanism::shapes()

  bool good() const { return refused.empty() && stopped.empty(); }
};

/// Fills in the errors of a run from its steps, and says what is wrong with them where nothing stopped it.
void judge(const TrackOptions& options, TrackRecord& record);

/** Tracked directions in which a mechanism at rest can and cannot be moved while above() holds; columns are twists. */
struct Movability {
  Eigen::Matrix<double, 6, Eigen::Dynamic> movable, missing;
};
Movability movability(const Mechanism& mechanism, const std::vector<int>& tracked);

/// Why a mechanism at rest cannot follow a path, in words; empty where it can.
std::string refusal(const Mechanism& mechanism, const ObjectPath& path);

/** Brings what above() wants true, what is moved held where it is at home.
 * @param joints  where that is  @return empty, or why it does not come true */
std::string prepare(Mechanism& mechanism, const TrackOptions& options, RobotVector& joints);

/** Each period: settle, then the hierarchy above() > path > below() > posture at home, solved with limits, and a step.
 *
 * First above() comes true with what is moved held in place, then the path is begun if refusal() has nothing to say.
 * @param progress  called with a time and the duration, s
 * @throw std::invalid_argument as ObjectPath::check() and control::makeResolver() do, or for more tasks or rows than
 * control/ takes. */
TrackRecord track(Mechanism& mechanism,
                  const ObjectPath& path,
                  const TrackOptions& options,
                  const std::function<void(double, double)>& progress = {});

}  // namespace tandem::robots
