// SPDX-License-Identifier: Apache-2.0
/** @file Monte Carlo comparison of methods on random tasks, with model errors in the plant. */
#pragma once

#include <array>
#include <iosfwd>
#include <map>
#include <string>
#include <vector>

#include "experiments/proportions.h"
#include "experiments/random_task.h"

namespace tandem::experiments {

/** Conditions of one case: sizes of the sources of error, standard deviations unless they say otherwise, and how
 * targets are followed. 0: none. */
struct Conditions {
  double stiffness = 0.0;       ///< of bending and torsional stiffness of every tube, relative
  double curvature = 0.0;       ///< of every tube, relative
  double length = 0.0;          ///< of every tube, relative
  double tip_noise = 0.0;       ///< of a measured tip, per axis, m
  double encoder_counts = 0.0;  ///< per turn of a rotation and per mm of a translation; 0: exact
  double encoder_noise = 0.0;   ///< of a reading, per mm of a translation and 0.1 rad of a rotation, m
  double backlash = 0.0;        ///< of the actuators, full, per mm of a translation and 0.1 rad of a rotation, m
  double delay_steps = 0.0;     ///< from a setpoint to the motor, control periods
  double friction = 0.0;        ///< Coulomb coefficient between tubes
  double clearance = 0.0;       ///< diametral, between neighbouring tubes, m
  double ovality = 0.0;         ///< of the tubes' bores, m
  double residual = 0.0;        ///< precurvature of straight sections, 1/m
  double bias = 0.0;            ///< constant error of measured tips, along (1, 1, 1), m
  double distortion = 0.0;      ///< largest error of measured tips per axis that depends on the position, m
  double tip_delay = 0.0;       ///< largest delay of a measured tip, uniformly distributed, control periods
  double stop_within = 0.0;     ///< measured errors at which a run leaves a point, m; 0: the threshold of success
  double speed = 0.0;           ///< of references that move with time along the path, m/s; 0: point by point

  bool operator==(const Conditions&) const = default;
};

/// Encoders with noise of this standard deviation: translations, m; rotations 0.1 rad per mm.
sim::EncoderOptions withEncoderNoise(sim::EncoderOptions encoders, double noise);

/** A condition as people name it. */
struct Condition {
  const char* name;  ///< of the option --NAME and, with _ for -, of the column
  const char* what;
  double Conditions::*member;
  double unit;    ///< of the numbers that people write, in SI
  bool relative;  ///< may be written with %
  const char* group = "Sources of error";
};
inline constexpr std::array<Condition, 17> kConditions{{
    {"stiffness-error", "bending and torsional stiffness of every tube of the plant, standard deviation",
     &Conditions::stiffness, 1.0, true},
    {"curvature-error", "precurvature of every tube of the plant, standard deviation", &Conditions::curvature, 1.0,
     true},
    {"length-error", "length of every tube of the plant, standard deviation", &Conditions::length, 1.0, true},
    {"tip-noise-mm", "noise of measured tips per axis, standard deviation, mm", &Conditions::tip_noise, 1e-3, false},
    {"encoder-counts", "encoder counts per turn of a rotation and per mm of a translation; 0: exact",
     &Conditions::encoder_counts, 1.0, false},
    {"encoder-noise-mm", "noise of encoders, standard deviation: translations, mm; rotations 0.1 rad per mm",
     &Conditions::encoder_noise, 1e-3, false},
    {"play-mm", "full backlash between motor and tube: translations, mm; rotations 0.1 rad per mm",
     &Conditions::backlash, 1e-3, false},
    {"delay-steps", "delay from setpoint to motor, control periods", &Conditions::delay_steps, 1.0, false},
    {"tube-friction", "Coulomb coefficient of friction between tubes", &Conditions::friction, 1.0, false},
    {"tube-clearance-mm", "diametral clearance between neighbouring tubes, mm", &Conditions::clearance, 1e-3, false},
    {"tube-ovality-mm", "ovality of the tubes' bores, largest less smallest diameter, mm", &Conditions::ovality, 1e-3,
     false},
    {"residual-curvature-per-m", "precurvature of straight tube sections, standard deviation, 1/m",
     &Conditions::residual, 1.0, false},
    {"tip-bias-mm", "constant error of measured tips along (1, 1, 1), mm", &Conditions::bias, 1e-3, false},
    {"tip-distortion-mm", "largest error of measured tips per axis, smooth over the position, mm",
     &Conditions::distortion, 1e-3, false},
    {"tip-delay-steps", "largest delay of measured tips, uniformly distributed from 0, control periods",
     &Conditions::tip_delay, 1.0, false},
    {"stop-within-mm",
     "measured errors at which a run leaves a point, mm, at most the threshold of success; 0: the threshold",
     &Conditions::stop_within, 1e-3, false, "Protocol"},
    {"speed-mm-per-s", "timed tracking: speed of references along the path, mm/s; 0: point by point",
     &Conditions::speed, 1e-3, false, "Protocol"},
}};

/** Specification of a comparison: cases times tasks times methods. */
struct MonteCarlo {
  std::uint64_t seed = 1;
  int tasks = 1000;
  double infeasible = 0.2;  ///< share of tasks that are out of reach
  bool posture = false;     ///< references carry the joints of the path that shows a task to be feasible
  std::vector<control::Method> methods;
  planning::TaskKind further = planning::TaskKind::kNone;  ///< a further task in every task: see isRandomKind()
  std::vector<Conditions> cases;                           ///< the first one is what the others are compared with
};

enum class Outcome : std::uint8_t {
  kCompleted = 0,  ///< every point (timed: the end of the path) was measured within the tolerance of the run
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
  Conditions conditions;
  PathKind kind = PathKind::kLine;
  bool feasible = true;
  Outcome outcome = Outcome::kRefused;
  std::string reason;  ///< of a refusal, without commas
  int points = 0;      ///< timed: control periods in which the reference moved
  int converged = 0;   ///< points left with both true errors within the threshold of success
  int iterations = 0;
  ErrorStatistics ab, a;  ///< true errors, m, over each point's last iteration; timed: over the path
  int violations = 0;     ///< iterations after which a setpoint stood outside equation (1)
  int held = 0;           ///< iterations in which control held still, as tips were unknown
  std::uint64_t gate_actions = 0;
  double stability = 1.0;      ///< least of the plant on the way
  int snaps = 0;               ///< of the plant
  double snap_energy = 0.0;    ///< released by them, J
  double snap_distance = 0.0;  ///< longest way of a tip in one, m
  int contacts = 0;            ///< points after whose first iteration bodies of arms overlapped
  double steady_ab = 0.0;      ///< timed: RMS of the true error while the reference stands still at the end, m
  double steady_a = 0.0;
  planning::TaskKind further = planning::TaskKind::kNone;  ///< kind of the further task
  ErrorStatistics further_error;  ///< true errors of it, m or rad, over each point's last iteration

  /// Whether the run says that it reached every point, and every point was reached in truth.
  bool reached() const { return outcome == Outcome::kCompleted && converged == points; }
  /// The same without harm: no arm snapped, no bodies touched.
  bool succeeded() const { return reached() && snaps == 0 && contacts == 0; }
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
  Conditions conditions;
  control::Method method = control::Method::kNspqp;
  int feasible = 0, succeeded = 0;
  int infeasible = 0, reported = 0;    ///< reported: the run itself said that it did not converge, or was refused
  std::array<double, 3> iterations{};  ///< a point, 50th, 90th and 99th percentile of runs that succeeded
  bool relative = false;               ///< the tasks have a relative position; else the numbers of ab are 0
  std::array<double, 3> ab{}, a{};     ///< RMS of a run's true errors, m, percentiles of all feasible ones
  int violations = 0;
  std::uint64_t gate_actions = 0;
  std::map<std::string, int> refusals;  ///< runs by the reason of their refusal
  double stability = 1.0;               ///< least of all
  int snaps = 0;
  double snap_energy = 0.0, snap_distance = 0.0;  ///< of all of them, J; longest way of a tip in one, m
  int contacts = 0;                               ///< runs on feasible tasks in which bodies touched
  /// Timed: largest true error on the path and RMS in the steady state, m, percentiles as above.
  std::array<double, 3> max_ab{}, max_a{}, steady_ab{}, steady_a{};
  planning::TaskKind further = planning::TaskKind::kNone;
  std::array<double, 3> further_error{};  ///< RMS of a run's true errors of the further task, m or rad, percentiles

  double rate() const { return feasible > 0 ? static_cast<double>(succeeded) / feasible : 0.0; }
  /// 95 % confidence interval of the rate.
  Interval interval() const { return wilson(succeeded, feasible); }
};

/** Two methods on the same feasible tasks of one case. */
struct MethodPair {
  Conditions conditions;
  control::Method method = control::Method::kNspqp, other = control::Method::kNspqp;
  int method_alone = 0, other_alone = 0;  ///< tasks in which one succeeded and the other did not

  double p() const { return mcnemar(method_alone, other_alone); }
};

/// Cases and methods in the order in which they first appear.
std::vector<MethodSummary> summarise(const std::vector<TaskResult>& results);

/// The last method of each case against every other one.
std::vector<MethodPair> pairMethods(const std::vector<TaskResult>& results);

/// For people: a table a case.
std::string formatTable(const std::vector<MethodSummary>& rows, const std::vector<MethodPair>& pairs);
/// "curvature-error 5%, tip-noise-mm 0.1"; "no errors".
std::string describe(const Conditions& conditions);

/// A row a result, SI. Numbers read back to the same values.
void writeResults(std::ostream& out, const std::vector<TaskResult>& results);
/// Columns are found by name; those that earlier versions did not write are 0.
/// @throw std::invalid_argument that says which line of `origin` is wrong, and how.
std::vector<TaskResult> readResults(std::istream& in, const std::string& origin);

/** Shards of one run in the order of that run.
 * @throw std::invalid_argument where they are of different runs, have a row twice, or tasks are missing. */
std::vector<TaskResult> merge(std::vector<TaskResult> results);

}  // namespace tandem::experiments
