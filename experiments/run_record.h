// SPDX-License-Identifier: Apache-2.0
/** @file Run record: per-iteration samples of one experiment run, with summary statistics. */
#pragma once

#include <string>
#include <vector>

#include "config/config.h"
#include "control/step_problem.h"
#include "planning/reference.h"
#include "planning/tips.h"
#include "robots/robot_model.h"
#include "sim/plant_tips.h"

namespace tandem::experiments {

using robots::RobotModel;

/** Which run. */
struct RunKey {
  std::string trajectory;
  std::string configuration;
  control::Method method = control::Method::kNspqp;

  /// "rectangle-1-nspqp"
  std::string name() const;
};

/** Statistics of errors, m, or rad of an axis or orientation: rms^2 = mean^2 + deviation^2, so no deviation is larger
 * than its RMS. */
struct ErrorStatistics {
  double rms = 0.0;
  double deviation = 0.0;
  double max = 0.0;
  double mean = 0.0;
  std::size_t count = 0;  ///< of errors; 0: all else is 0
};

/// Sums in the order given, so that the digits do not depend on the source of the errors. Zeros for none.
ErrorStatistics statisticsOf(const std::vector<double>& errors);

/// Positions by arm, m, robot base frame.
using Tips = std::array<Eigen::Vector3d, safety::kMaxArms>;

/// Orientations by arm, robot base frame <- tip.
using TipOrientations = std::array<Eigen::Quaterniond, safety::kMaxArms>;
inline TipOrientations unturned() {
  TipOrientations orientations;
  orientations.fill(Eigen::Quaterniond::Identity());
  return orientations;
}

/// Errors of the relative position (0 without one) and of the tip that follows the shape, m.
std::pair<double, double> errorsOf(const planning::Reference& reference, const Tips& tips);

/// The first task of a kind in a reference; null: none.
const planning::TaskReference* taskOf(const planning::Reference& reference, planning::TaskKind kind);
/// The task whose tip follows the shape: the tip, or the first pose without one; null: none.
const planning::TaskReference* shapeTask(const planning::Reference& reference);

/** A task beside the tip and the relative position, and its errors. */
struct FurtherErrors {
  planning::TaskReference task;  ///< with the last wanted place
  ErrorStatistics errors;        ///< over each point's last iteration, m or rad
};

/** Data of one control period: the reference, the answer of control, and the robot after its motion. */
struct StepData {
  int point = 0;
  int iteration = 0;
  planning::Reference reference;                    ///< the one that was answered
  safety::RobotVector position;                     ///< of all joints after the step, as measured, m and rad
  safety::RobotVector setpoint;                     ///< past the gate
  Tips tip;                                         ///< where the tips really are after the step, m, robot base frame
  TipOrientations orientation = unturned();         ///< likewise
  std::array<double, planning::kMaxTasks> scale{};  ///< task scales of the solution, in the order of the reference
  std::uint32_t solver_iterations = 0;
  std::uint32_t active_limits = 0;
  std::uint64_t gate_actions = 0;  ///< interventions of the gate in this step
};

/// Whether a kind is neither the tip nor the relative position.
bool isFurther(planning::TaskKind kind);

/** One row: the data and what follows from them. */
struct Row {
  StepData data;
  bool relative = false;  ///< the trajectory has a relative position; else error_ab is 0
  double error_ab = 0.0;  ///< m, after the step, of the tips as they really are
  double error_a = 0.0;   ///< m, after the step, of the tip as it really is
  std::array<double, planning::kMaxTasks>
      error_further{};     ///< m or rad, likewise, of further tasks; by task of the reference. Of a shaft: of the
                           ///< record's model at the measured joints
  double violation = 0.0;  ///< largest excess of the setpoint over boxes and rows, m or rad; not above zero inside
  double excess = 0.0;     ///< likewise of translations and rows alone, m
  safety::RobotVector lower, upper;  ///< moving limits of every joint after the step
};

/** A line of summary.csv. */
struct RunSummary {
  RunKey key;
  int points = 0;
  int converged = 0;
  int iterations = 0;
  std::vector<FurtherErrors> further;
  ErrorStatistics ab, a;        ///< over each point's last iteration; ab without errors: no relative position
  int limit_violations = 0;     ///< iterations after which a setpoint was outside its limits by more than kViolation
  double largest_excess = 0.0;  ///< of a setpoint's translations and rows over their limits, m; 0: it kept them
  std::uint64_t gate_actions = 0;
  sim::Snaps snaps;     ///< of the plant; none where the run does not know it (over DDS)
  std::string failure;  ///< what ended the run before its last point; empty: nothing
};

/// Excess over a limit that counts as violation: rounding is below it, m or rad.
inline constexpr double kViolation = 1e-9;

/** Collects the rows of one run. */
class RunRecord {
 public:
  RunRecord(RunKey key, const RobotModel& robot, int point_count, double tolerance);

  /// The run has ended before its last point. @param why  for people
  void fail(const std::string& why) { failure_ = why; }

  /// Snaps of the plant until now.
  void setSnaps(const sim::Snaps& snaps) { snaps_ = snaps; }

  /// Adds a row; errors, violation and moving limits are computed here, so that every source of data gives the same
  /// digits.
  void add(const StepData& data);

  const RunKey& key() const { return key_; }
  const std::vector<Row>& rows() const { return rows_; }
  RunSummary summary() const;

 private:
  bool lastOfPoint(std::size_t row) const;
  std::vector<FurtherErrors> furtherErrors() const;

  RunKey key_;
  const RobotModel& robot_;
  control::StepProblem limits_;
  int point_count_;
  double tolerance_;
  std::string failure_;
  sim::Snaps snaps_;
  planning::TipFollower tips_;  ///< of the record's models, for tasks of shafts
  std::vector<Row> rows_;
};

}  // namespace tandem::experiments
