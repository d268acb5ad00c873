// SPDX-License-Identifier: Apache-2.0
/** @file tandem montecarlo: every method on thousands of random tasks, on all cores or over a cluster. */
#include <spdlog/fmt/fmt.h>

#include <charconv>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "config/robot_files.h"
#include "control/method_names.h"
#include "experiments/montecarlo.h"
#include "planning/report_unit.h"
#include "robots/capability.h"
#include "services/cli/legend.h"
#include "services/cli/models/figure.h"
#include "services/cli/models/parallel.h"
#include "services/cli/subcommand.h"
#include "services/runtime/process.h"

namespace tandem::cli {
namespace {

namespace ex = experiments;
namespace fs = std::filesystem;

struct MonteCarloCommand {
  std::string deployment = "lockstep", model, plant, feedback = "sensor", shard = "0/1", csv;
  FigureOptions figure;
  std::string further;
  std::vector<std::string> methods, set, shards;
  std::array<std::vector<std::string>, ex::kConditions.size()> conditions;
  int tasks = 1000, jobs = 0;
  std::uint64_t seed = 1;
  double infeasible = 0.2;
  bool posture = false, json = false;
};

/** Which of how many parts of the run this is. */
struct Shard {
  int index = 0, count = 1;
};

double numberOf(const std::string& option, const std::string& text, const std::string& expected) {
  double value = 0.0;
  const auto [rest, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || rest != text.data() + text.size() || !std::isfinite(value))
    throw Failure(kUsage, option + ": found '" + text + "', expected " + expected);
  return value;
}

Shard shardOf(const std::string& text) {
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto [slash, first] = std::from_chars(text.data(), end, shard.index);
  const bool number = first == std::errc() && slash != end && *slash == '/';
  const auto [rest, second] = std::from_chars(number ? slash + 1 : end, end, shard.count);
  if (!number || second != std::errc() || rest != end || shard.index < 0 || shard.index >= shard.count)
    throw Failure(kUsage, "--shard: found '" + text + "', expected i/n with i from 0 to n-1");
  return shard;
}

/// A size of a condition, SI.
double sizeOf(const ex::Condition& condition, std::string text) {
  const std::string option = std::string("--") + condition.name, whole = text;
  const std::string expected =
      condition.relative ? "a share such as 0.05 or 5%, not below zero" : "a number, not below zero";
  double unit = condition.unit;
  if (condition.relative && text.ends_with('%')) {
    text.pop_back();
    unit = 0.01;
  }
  const double size = unit * numberOf(option, text, expected);
  if (!(size >= 0.0))
    throw Failure(kUsage, option + ": found '" + whole + "', expected " + expected);
  return size;
}

/// The first case has the first size of every condition, the others one size of one condition changed.
std::vector<ex::Conditions> casesOf(const MonteCarloCommand& options) {
  std::vector<ex::Conditions> cases(1);
  for (std::size_t s = 0; s < ex::kConditions.size(); ++s) {
    if (!options.conditions[s].empty())
      cases.front().*ex::kConditions[s].member = sizeOf(ex::kConditions[s], options.conditions[s].front());
  }
  for (std::size_t s = 0; s < ex::kConditions.size(); ++s) {
    for (std::size_t i = 1; i < options.conditions[s].size(); ++i) {
      ex::Conditions next = cases.front();
      next.*ex::kConditions[s].member = sizeOf(ex::kConditions[s], options.conditions[s][i]);
      if (std::find(cases.begin(), cases.end(), next) != cases.end())
        throw Failure(kUsage, std::string("--") + ex::kConditions[s].name + ": found '" + options.conditions[s][i] +
                                  "' twice, expected different sizes");
      cases.push_back(next);
    }
  }
  const double threshold = planning::TrajectorySpec().tolerance;
  for (const ex::Conditions& conditions : cases) {
    if (conditions.stop_within > threshold + 1e-9)
      throw Failure(kUsage,
                    fmt::format("--stop-within-mm: found '{:g}', expected at most {:g}, the threshold of success",
                                1e3 * conditions.stop_within, 1e3 * threshold));
  }
  return cases;
}

std::vector<control::Method> methodsOf(const MonteCarloCommand& options) {
  std::vector<control::Method> methods;
  for (int m = 0; options.methods.empty() && m < control::kMethodCount; ++m)
    methods.push_back(static_cast<control::Method>(m));
  for (const std::string& text : options.methods) {
    const auto method = idl::fromName<control::Method>(text);
    if (!method || std::find(methods.begin(), methods.end(), *method) != methods.end())
      throw Failure(kUsage, "--methods: found '" + text + "', expected different ones of " + control::methodList());
    methods.push_back(*method);
  }
  return methods;
}

/// Method parameters for --set: those that can be changed while a method runs, and those that cannot.
std::vector<control::TunableParameter> settable() {
  std::vector<control::TunableParameter> all(control::kTunableParameters.begin(), control::kTunableParameters.end());
  all.push_back({"least_stability", &control::MethodParameters::least_stability});
  all.push_back({"least_distance", &control::MethodParameters::least_distance});
  return all;
}

/// The kind of the further tasks; kNone: none.
planning::TaskKind furtherOf(const MonteCarloCommand& options, std::size_t arms) {
  if (options.further.empty())
    return planning::TaskKind::kNone;
  const kinematics::TaskKindEntry* kind = kinematics::findTaskKind(options.further);
  if (kind == nullptr || !ex::isRandomKind(kind->kind))
    throw Failure(
        kUsage, "--further: found '" + options.further +
                    "', expected axis, orientation, relative_orientation, look_at, remote_centre, pose, relative_pose, "
                    "joint_limits or elastic_stability");
  if (kind->relative() && arms < 2)
    throw Failure(kUsage,
                  "--further: found '" + options.further + "', expected a kind of one tip: the robot has one arm");
  return kind->kind;
}

void setParameters(const MonteCarloCommand& options, control::MethodParameters& parameters) {
  const std::vector<control::TunableParameter> all = settable();
  std::string names;
  for (const control::TunableParameter& parameter : all)
    names += (names.empty() ? "" : ", ") + std::string(parameter.name);
  for (const std::string& text : options.set) {
    const std::size_t sign = text.find('=');
    const auto found = std::find_if(all.begin(), all.end(),
                                    [&](const auto& parameter) { return parameter.name == text.substr(0, sign); });
    if (sign == std::string::npos || found == all.end())
      throw Failure(kUsage, "--set: found '" + text + "', expected NAME=VALUE with one of " + names);
    parameters.*found->member = numberOf("--set " + text.substr(0, sign), text.substr(sign + 1), "a number, in SI");
  }
}

ex::LoopOptions loopOf(const MonteCarloCommand& options, const config::Deployment& deployment) {
  ex::LoopOptions loop{deployment.control_period, {deployment.relative_gain, deployment.tip_gain},
                       deployment.feedback,       deployment.orientation_feedback,
                       deployment.plant,          deployment.budgets};
  if (!options.plant.empty())
    loop.plant.model = options.plant;
  const auto feedback = idl::fromName<planning::Feedback>(options.feedback);
  if (!feedback)
    throw Failure(kUsage, "--feedback: found '" + options.feedback + "', expected model or sensor");
  loop.feedback = *feedback;
  if (loop.feedback == planning::Feedback::kModel)
    loop.orientation_feedback = planning::Feedback::kModel;
  return loop;
}

std::vector<ex::TaskResult> runShards(const MonteCarloCommand& options) {
  const config::Deployment deployment = runtime::loadDeployment(options.deployment);
  config::Robot robot = config::loadAnyRobot(deployment.robot);
  if (const std::string why = refusal(robot, robots::Capability::kComputation); !why.empty())
    throw Failure(kUsage, why);
  setParameters(options, robot.parameters);
  const ex::MonteCarlo run{options.seed,    options.tasks,      options.infeasible,
                           options.posture, methodsOf(options), furtherOf(options, robot.arms.size()),
                           casesOf(options)};
  config::setReadingErrors(ex::worstEncoders(run, deployment.plant.encoders), robot);
  const std::string model_name = options.model.empty() ? deployment.model : options.model;
  const ex::RobotModel model(robot, model_name);
  const ex::LoopOptions loop = loopOf(options, deployment);
  const Shard shard = shardOf(options.shard);
  std::vector<int> tasks;
  for (int i = shard.index; i < run.tasks; i += shard.count)
    tasks.push_back(i);
  std::vector<std::vector<ex::TaskResult>> parts(run.cases.size() * tasks.size());
  parallelFor(parts.size(), options.jobs, "montecarlo", [&](std::size_t i) {
    parts[i] = ex::runTask(robot, model, loop, run, i / tasks.size(), tasks[i % tasks.size()]);
  });
  std::vector<ex::TaskResult> results;
  for (const auto& part : parts)
    results.insert(results.end(), part.begin(), part.end());
  return results;
}

nlohmann::ordered_json monteCarloJson(const std::vector<ex::MethodSummary>& rows,
                                      const std::vector<ex::MethodPair>& pairs) {
  auto json = nlohmann::ordered_json::array();
  const auto percentiles = [](const std::array<double, 3>& values, double unit) {
    return nlohmann::ordered_json{{"p50", unit * values[0]}, {"p90", unit * values[1]}, {"p99", unit * values[2]}};
  };
  for (const ex::MethodSummary& row : rows) {
    nlohmann::ordered_json line{{"method", control::name(row.method)}};
    for (const ex::Condition& condition : ex::kConditions)
      line["errors"][condition.name] = row.conditions.*condition.member / condition.unit;
    line["feasible"] = row.feasible;
    line["succeeded"] = row.succeeded;
    line["success_interval_95"] = {row.interval().lower, row.interval().upper};
    line["infeasible"] = row.infeasible;
    line["infeasible_reported"] = row.reported;
    line["iterations_per_point"] = percentiles(row.iterations, 1.0);
    line["rms_ab_mm"] = percentiles(row.ab, 1e3);
    line["rms_a_mm"] = percentiles(row.a, 1e3);
    line["limit_violations"] = row.violations;
    line["gate_actions"] = row.gate_actions;
    line["refusals"] = row.refusals;
    line["least_stability"] = row.stability;
    line["snaps"] = row.snaps;
    line["snap_energy_mJ"] = 1e3 * row.snap_energy;
    line["snap_distance_mm"] = 1e3 * row.snap_distance;
    line["runs_with_contact"] = row.contacts;
    if (row.further != planning::TaskKind::kNone) {
      const auto [per_si, unit] = planning::reportUnit(row.further);
      line["further"] = kinematics::findTaskKind(row.further)->name;
      line[std::string("rms_further_") + unit] = percentiles(row.further_error, per_si);
    }
    if (row.conditions.speed > 0.0) {
      line["max_ab_mm"] = percentiles(row.max_ab, 1e3);
      line["max_a_mm"] = percentiles(row.max_a, 1e3);
      line["rest_ab_mm"] = percentiles(row.steady_ab, 1e3);
      line["rest_a_mm"] = percentiles(row.steady_a, 1e3);
    }
    for (const ex::MethodPair& pair : pairs) {
      if (pair.conditions == row.conditions && pair.other == row.method)
        line["against"] = {{"method", control::name(pair.method)},
                           {"this_alone", pair.other_alone},
                           {"other_alone", pair.method_alone},
                           {"p", pair.p()}};
    }
    json.push_back(line);
  }
  return json;
}

/// Prints, writes and draws. @return the exit code: kFailure where a setpoint left its limits or a task that is out of
/// reach was not reported.
int finish(const MonteCarloCommand& options, const std::vector<ex::TaskResult>& results) {
  std::string csv = options.csv;
  if (csv.empty() && options.figure.wanted())
    csv = fs::path(options.figure.path).replace_extension(".csv").string();
  if (!csv.empty()) {
    if (const fs::path folder = fs::path(csv).parent_path(); !folder.empty())
      fs::create_directories(folder);
    std::ofstream out(csv);
    ex::writeResults(out, results);
    if (!out.flush())
      client::failToWrite(kFailure, csv);
  }
  if (options.figure.wanted())
    drawFigures("montecarlo.py", {csv, options.figure.path}, options.figure);
  const std::vector<ex::MethodSummary> rows = ex::summarise(results);
  const std::vector<ex::MethodPair> pairs = ex::pairMethods(results);
  if (options.json)
    std::cout << monteCarloJson(rows, pairs).dump(2) << '\n';
  else
    std::cout << ex::formatTable(rows, pairs);
  const bool good = std::all_of(rows.begin(), rows.end(), [](const ex::MethodSummary& row) {
    return row.violations == 0 && row.reported == row.infeasible;
  });
  return good ? kOk : kFailure;
}

int runMerge(const MonteCarloCommand& options) {
  std::vector<ex::TaskResult> results;
  try {
    for (const std::string& file : options.shards) {
      const std::vector<ex::TaskResult> more = ex::readResults(*openInput(file), file);
      results.insert(results.end(), more.begin(), more.end());
    }
    return finish(options, ex::merge(std::move(results)));
  } catch (const std::invalid_argument& error) {
    throw Failure(kUsage, error.what());
  }
}

int runMonteCarlo(const MonteCarloCommand& options) {
  const auto start = std::chrono::steady_clock::now();
  const std::vector<ex::TaskResult> results = runShards(options);
  const int code = finish(options, results);
  if (!options.json) {
    std::fprintf(stderr, "%zu runs in %.1f s\n", results.size(),
                 std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return code;
}

void addOutputs(CLI::App& command, MonteCarloCommand& options) {
  command.add_option("--csv", options.csv, "CSV file, one row per task and method, SI");
  addFigureOption(command, options.figure, "errors, iterations and sweeps; tables as CSV and LaTeX files beside it");
  command.add_flag("--json", options.json, "JSON instead of the table");
}

}  // namespace

void registerMonteCarlo(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<MonteCarloCommand>();
  CLI::App* command =
      app.add_subcommand("montecarlo", "compare all methods on random tasks, with model errors in the plant");
  command
      ->add_option("-d,--deployment", options->deployment,
                   "deployment: robot, gains, models, and the plant that errors are added to")
      ->capture_default_str();
  command->add_option("--tasks", options->tasks, "number of random tasks, the same for every method")
      ->check(client::kPositive)
      ->capture_default_str();
  command->add_option("--methods", options->methods, "methods, separated by commas (default: all)")->delimiter(',');
  command->add_option("--seed", options->seed, "seed of all random numbers")->capture_default_str();
  command->add_option("--infeasible", options->infeasible, "share of tasks whose last targets are out of reach")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->add_option("--further", options->further,
                      "kind of a further task in every task: axis, orientation, relative_orientation, look_at, "
                      "remote_centre, pose, relative_pose, joint_limits or elastic_stability (default: none)");
  command->add_flag("--posture", options->posture, "give the methods the joint path of each task as a posture");
  command->add_option("--set", options->set, "parameter of the methods, NAME=VALUE in SI; may be repeated");
  command
      ->add_option("--model", options->model,
                   "kinematic model of control: rigid or compliant (default: the deployment's)")
      ->check(CLI::IsMember({"rigid", "compliant"}));
  command->add_option("--plant", options->plant, "kinematic model of the plant (default: the deployment's)")
      ->check(CLI::IsMember({"rigid", "compliant"}));
  command
      ->add_option("--feedback", options->feedback,
                   "source of tip poses for errors: tip tracker (sensor) or kinematic model (model)")
      ->capture_default_str();
  for (std::size_t s = 0; s < ex::kConditions.size(); ++s) {
    const ex::Condition& condition = ex::kConditions[s];
    command
        ->add_option(std::string("--") + condition.name, options->conditions[s],
                     std::string(condition.what) + "; comma-separated values make a sweep")
        ->delimiter(',')
        ->group(condition.group);
  }
  command->add_option("--shard", options->shard, "part i of n of the tasks, i from 0")->capture_default_str();
  command->add_option("-j,--jobs", options->jobs, "threads; 0: one per core")->check(client::kNonNegative);
  addOutputs(*command, *options);
  command->footer(
      legend({"outside", "gate", "margin", "no reach", "snaps", "contact"}) +
      "The same seed gives the same rows, whatever --jobs and --shard are (docs/montecarlo.md). Exit code 1: a "
      "setpoint\n"
      "left its limits or a task out of reach was reported as done.");
  CLI::App* merging = command->add_subcommand("merge", "merge the CSV files of all shards into one result");
  merging->add_option("files", options->shards, "CSV files of the shards")->required();
  addOutputs(*merging, *options);
  merging->callback([options, &exit_code] { guarded(exit_code, [&] { return runMerge(*options); }); });
  command->callback([options, command, &exit_code] {
    if (command->get_subcommands().empty())
      guarded(exit_code, [&] { return runMonteCarlo(*options); });
  });
}

}  // namespace tandem::cli
