// SPDX-License-Identifier: Apache-2.0
/** @file Monte Carlo comparison of methods on random tasks, with model errors in the plant. */
#pragma once

#include <array>
#include <iosfwd>
#include <string>
#include <vector>

#include "experiments/random_task.h"

namespace tandem::experiments {

/** Sizes of the sources of error of one case. All are standard deviations unless they say otherwise; 0: none. */
struct ErrorSizes {
  double stiffness = 0.0;       ///< of bending and torsional stiffness of every tube, relative
  double curvature = 0.0;       ///< of every tube, relative
  double length = 0.0;          ///< of every tube, relative
  double tip_noise = 0.0;       ///< of a measured tip, per axis, m
  double encoder_counts = 0.0;  ///< per turn of a rotation and per mm of a translation; 0: exact
  double encoder_noise = 0.0;   ///< of a reading, per mm of a translation and 0.1 rad of a rotation, m
  double play = 0.0;            ///< of the actuators, full, per mm of a translation and 0.1 rad of a rotation, m
  double delay_steps = 0.0;     ///< from a setpoint to the motor, control periods

  bool operator==(const ErrorSizes&) const = default;
};

/// Encoders with noise of this standard deviation: translations, m; rotations 0.1 rad per mm.
sim::EncoderOptions withEncoderNoise(sim::EncoderOptions encoders, double noise);

/** A source of error as people name it. */
struct ErrorSource {
  const char* name;  ///< of the option --NAME and, with _ for -, of the column
  const char* what;
  double ErrorSizes::*member;
  double unit;    ///< of the numbers that people write, in SI
  bool relative;  ///< may be written with %
};
inline constexpr std::array<ErrorSource, 8> kErrorSources{{
    {"stiffness-error", "bending and torsional stiffness of every tube of the plant, standard deviation",
     &ErrorSizes::stiffness, 1.0, true},
    {"curvature-error", "precurvature of every tube of the plant, standard deviation", &ErrorSizes::curvature, 1.0,
     true},
    {"length-error", "length of every tube of the plant, standard deviation", &ErrorSizes::length, 1.0, true},
    {"tip-noise-mm", "noise of measured tips per axis, standard deviation, mm", &ErrorSizes::tip_noise, 1e-3, false},
    {"encoder-counts", "encoder counts per turn of a rotation and per mm of a translation; 0: exact",
     &ErrorSizes::encoder_counts, 1.0, false},
    {"encoder-noise-mm", "noise of encoders, standard deviation: translations, mm; rotations 0.1 rad per mm",
     &ErrorSizes::encoder_noise, 1e-3, false},
    {"play-mm", "full backlash between motor and tube: translations, mm; rotations 0.1 rad per mm", &ErrorSizes::play,
     1e-3, false},
    {"delay-steps", "delay from setpoint to motor, control periods", &ErrorSizes::delay_steps, 1.0, false},
}};

/** What is to be run. Cases times tasks times methods. */
struct MonteCarlo {
  std::uint64_t seed = 1;
  int tasks = 1000;
  double infeasible = 0.2;  ///< share of tasks that are out of reach
  bool posture = false;     ///< references carry the joints of the path that shows a task to be feasible
  std::vector<control::Method> methods;
  std::vector<ErrorSizes> cases;  ///< the first one is what the others are compared with
};

enum class Outcome : std::uint8_t {
  kCompleted = 0,  ///< every point was seen within the tolerance
  kNotConverged,   ///< the run ended as failed: it says so itself
  kRefused,        ///< the gate, or a model that cannot answer, ended it
};
std::string_view name(Outcome outcome);

/** One method on one task: a row of the CSV. */
struct TaskResult {
  std::uint64_t seed = 0;
  int tasks = 0;  ///< of the whole run
  int task = 0;
  control::Method method = control::Method::kNspqp;
  ErrorSizes errors;
  PathKind kind = PathKind::kLine;
  bool feasible = true;
  Outcome outcome = Outcome::kRefused;
  int points = 0;
  int converged = 0;  ///< points left with both true errors within the tolerance
  int iterations = 0;
  ErrorStatistics ab, a;  ///< true errors, m, over each point's last iteration
  int violations = 0;     ///< iterations after which a setpoint stood outside equation (1)
  int held = 0;           ///< iterations in which control held still, as tips were unknown
  std::uint64_t gate_actions = 0;
  double stability = 1.0;  ///< least of the plant on the way
  int snaps = 0;           ///< of the plant

  /// Ended as it should: every point really reached.
  bool succeeded() const { return outcome == Outcome::kCompleted && converged == points; }
};

/// The largest resolution and noise of any case: what control has to expect of readings.
sim::EncoderOptions worstEncoders(const MonteCarlo& run, const sim::EncoderOptions& otherwise);

/// Whether task `index` is one of those out of reach: evenly spread.
bool outOfReach(const MonteCarlo& run, int index);

/** All methods on one task of one case, in the order of `run.methods`.
 * @param options  of the ideal loop: what the case adds is put on top
 * @throw as randomTask() does. */
std::vector<TaskResult> runTask(const config::Robot& robot,
                                const RobotModel& model,
                                const LoopOptions& options,
                                const MonteCarlo& run,
                                std::size_t error_case,
                                int index);

/** Results of one method in one case. */
struct MethodSummary {
  ErrorSizes errors;
  control::Method method = control::Method::kNspqp;
  int feasible = 0, succeeded = 0;
  int infeasible = 0, reported = 0;    ///< reported: the run itself said that it did not converge, or was refused
  std::array<double, 3> iterations{};  ///< a point, 50th, 90th and 99th percentile of runs that succeeded
  std::array<double, 3> ab{}, a{};     ///< RMS of a run's true errors, m, percentiles of all feasible ones
  int violations = 0;
  std::uint64_t gate_actions = 0;
  double stability = 1.0;  ///< least of all
  int snaps = 0;

  double rate() const { return feasible > 0 ? static_cast<double>(succeeded) / feasible : 0.0; }
};

/// Cases and methods in the order in which they first appear.
std::vector<MethodSummary> summarise(const std::vector<TaskResult>& results);

/// For people.
std::string formatTable(const std::vector<MethodSummary>& rows);
/// "curvature-error 5%, tip-noise-mm 0.1"; "no errors".
std::string describe(const ErrorSizes& errors);

/// A row a result, SI. Numbers read back to the same values.
void writeResults(std::ostream& out, const std::vector<TaskResult>& results);
/// @throw std::invalid_argument that says which line of `origin` is wrong, and how.
std::vector<TaskResult> readResults(std::istream& in, const std::string& origin);

/** Shards of one run in the order of that run.
 * @throw std::invalid_argument where they are of different runs, have a row twice, or tasks are missing. */
std::vector<TaskResult> merge(std::vector<TaskResult> results);

}  // namespace tandem::experiments
