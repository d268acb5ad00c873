// SPDX-License-Identifier: Apache-2.0
/** @file Trajectory follower: selects the reference for each measured state. */
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "idl/enumerations.h"
#include "planning/error_statistics.h"
#include "planning/leader_path.h"
#include "planning/reference.h"
#include "planning/trajectory.h"

namespace tandem::planning {

using idl::name;
using idl::Phase;

/** Progress of a run. */
struct Progress {
  Phase phase = Phase::kIdle;
  int point = 0;  ///< counts from 1
  int point_count = 0;
  int iteration = 0;  ///< within the point, counts from 1
  int total_iterations = 0;
  int converged_points = 0;  ///< reached within the tolerance
  int missed_points = 0;     ///< left without being reached
  /// m, of worst_point: the largest error of tip and relative position at its least; those of further tasks with a
  /// tolerance count in proportion: error / their tolerance = worst_error / the tolerance of positions.
  double worst_error = 0.0;
  int worst_point = 0;                              ///< counts from 1; 0: none
  double tip_error = 0.0;                           ///< m, at the last update, relative to the previous reference
  double relative_error = 0.0;                      ///< m
  std::array<double, kMaxFurther> further_error{};  ///< m or rad, in the order of TrajectorySpec::further
  double tolerance = 0.0;  ///< m; above zero where further tasks decide too: worst_error then counts in tolerances
};

/// "missed 8 of 12 points, worst 46.3 mm at point 7", or "worst 3.1 times the tolerance at point 7" where further tasks
/// have a tolerance; empty if no point was missed.
std::string describeMisses(const Progress& progress);

/** Follower of a trajectory, one update per control period.
 *
 * kPointByPoint (Alsaka et al. 2024, section 3): a point ends when all errors are within their tolerances, or after
 * max_iterations; the next one follows. The feed-forward, spacing / point_duration along the path, acts in the first
 * iteration of a point only: constant feed-forward would offset the tip by feed_forward / lambda_A. kTimed: the
 * reference moves along the polyline with trapezoidal speed, with its velocity as feed-forward. A point is reached if
 * all errors relative to it are within their tolerances at an update between the time at which the reference passes it
 * and max_iterations periods later; the run ends when this is decided for the last point. A run that missed a point
 * ends as kFailed, after all points. */
class Follower {
 public:
  /// @param period  control period, s.
  explicit Follower(double period) : period_(period) {}

  /// Starts at the measured place of the tips: pointAt().
  /// @param postures  planned joints of all arms, one vector per point (FeasibilityReport::path()); empty: those of an
  /// insertion, references of other shapes have no posture. @throw std::invalid_argument as sample() does, or for
  /// another number of postures.
  void start(const TrajectorySpec& spec,
             const TrajectoryPoint& measured,
             std::vector<safety::RobotVector> postures = {});
  /// Starts likewise, with `spec.point_count` given points instead of those of its shape.
  void startAt(const TrajectorySpec& spec,
               const TrajectoryPoint& measured,
               std::vector<TrajectoryPoint> points,
               std::vector<safety::RobotVector> postures = {});
  void stop();
  void fail();  ///< ends a run that cannot continue, as kFailed
  void pause();
  void resume();

  /// Compares the measured state with the last reference and writes the next one. @return true with a new reference
  /// while running; while paused the last reference is kept without feed-forward.
  bool update(const TrajectoryPoint& measured, Reference& reference) noexcept;
  /// The same at the place of tips, with the path of the leader in view where a task follows it. Allocates then.
  bool update(const TipFollower& tips, const MeasuredTips* measured, Reference& reference) noexcept;

  const Progress& progress() const { return progress_; }
  /// Errors of the tasks in the reference's order, m, rad for axes and orientations: kPointByPoint at the end of each
  /// point; kTimed at each update, relative to the reference of the previous one.
  std::span<const ErrorStatistics> errors() const {
    return std::span(errors_).first(static_cast<std::size_t>(spec_.taskCount()));
  }
  const TrajectorySpec& spec() const { return spec_; }
  const std::vector<TrajectoryPoint>& points() const { return points_; }

 private:
  bool nextPoint() noexcept;
  bool nextInstant(const TrajectoryPoint& measured) noexcept;
  /// Largest error of a measured place relative to a wanted one, as Progress::worst_error.
  double errorOf(const TrajectoryPoint& wanted, const TrajectoryPoint& measured) const noexcept;
  void addErrors() noexcept;
  /// The point is decided. @param error  m, as Progress::worst_error
  void leave(int point, double error) noexcept;
  void finish() noexcept;
  void judgePassed(const TrajectoryPoint& measured) noexcept;
  void ask(const TrajectoryPoint& at, const Reference& reference) noexcept;
  /// Writes the present target of a task that follows the leader into the reference.
  void aimAtLeader() noexcept;
  /// Segment of the path at arc length s, by the index of its end, and the fraction of it that is complete.
  std::pair<std::size_t, double> pieceAt(double s) const noexcept;
  TrajectoryPoint along(double s) const noexcept;

  double period_;
  TrajectorySpec spec_;
  std::vector<TrajectoryPoint> points_;  ///< including the start as first point
  std::vector<double> arc_length_;       ///< of the tip at each point, m
  std::vector<safety::RobotVector> postures_;
  double path_time_ = 0.0;  ///< s, timed following
  /** Record of a point that the reference has passed, for timed following. */
  struct Passed {
    double nearest = 0.0;  ///< m, least error since then
    int periods = 0;       ///< since then; below zero: decided
  };
  std::vector<Passed> passed_;  ///< the first ones of points_, without the start; reserved for all
  Progress progress_;
  std::array<ErrorStatistics, kMaxTasks> errors_;
  LeaderPath leader_;
  TrajectoryPoint wanted_;  ///< of the last reference
  double error_ = 0.0;      ///< errorOf() of the last update
  Reference reference_;
};

}  // namespace tandem::planning
