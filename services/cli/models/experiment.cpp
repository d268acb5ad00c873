// SPDX-License-Identifier: Apache-2.0
/** @file tandem experiment: published experiments, with our figures beside the paper's. */
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "config/arm_names.h"
#include "config/robot_files.h"
#include "experiments/comparison.h"
#include "experiments/csv.h"
#include "experiments/montecarlo.h"
#include "planning/report_unit.h"
#include "robots/capability.h"
#include "services/cli/deployment/domain.h"
#include "services/cli/deployment/supervisor.h"
#include "services/cli/legend.h"
#include "services/cli/models/figure.h"
#include "services/cli/models/trajectory_experiment.h"
#include "services/cli/subcommand.h"
#include "services/runtime/method_library.h"
#include "services/runtime/process.h"

namespace tandem::cli {
namespace {

namespace fs = std::filesystem;

struct ExperimentCommand {
  std::string experiment = "table3", deployment = "lockstep", robot, csv, only, log = "warn", gate = "on";
  bool offline = false, json = false, by_configuration = false;
  FigureOptions figures;
  double encoder_noise = 0.0;  ///< standard deviation of a translation, mm

  bool gateOn() const { return gate == "on"; }
};

/** One line on a terminal, rewritten in place; one line per run elsewhere. */
class ProgressBar {
 public:
  explicit ProgressBar(std::size_t runs) : runs_(runs), terminal_(isatty(STDERR_FILENO) != 0) {}

  void show(const std::string& run, int point, int points) {
    const auto now = std::chrono::steady_clock::now();
    if (!terminal_ || now - shown_ < std::chrono::milliseconds(50))
      return;
    shown_ = now;
    const double done =
        (static_cast<double>(finished_) + static_cast<double>(point) / points) / static_cast<double>(runs_);
    const int width = static_cast<int>(done * 30.0);
    std::fprintf(stderr, "\r[%-30s] %3.0f %%  %-28s", std::string(static_cast<std::size_t>(width), '#').c_str(),
                 100.0 * done, run.c_str());
  }
  void finish(const experiments::RunSummary& s) {
    ++finished_;
    if (terminal_)
      return;
    std::fprintf(stderr, "%2zu/%zu %-30s %4d iterations, %d/%d points\n", finished_, runs_, s.key.name().c_str(),
                 s.iterations, s.converged, s.points);
  }
  void end() const {
    if (terminal_)
      std::fprintf(stderr, "\r%-70s\r", "");
  }

 private:
  std::size_t runs_, finished_ = 0;
  bool terminal_;
  std::chrono::steady_clock::time_point shown_{};
};

using RunOne = std::function<experiments::RunRecord(const experiments::RunPlan&, const std::function<void(int, int)>&)>;

std::vector<experiments::RunSummary> runPlans(const ExperimentCommand& options,
                                              const config::Robot& robot,
                                              const std::vector<experiments::RunPlan>& plans,
                                              const RunOne& run_one) {
  if (!options.csv.empty())
    fs::create_directories(options.csv);
  ProgressBar bar(plans.size());
  std::vector<experiments::RunSummary> summaries;
  for (const experiments::RunPlan& plan : plans) {
    const auto record = run_one(plan, [&](int point, int points) { bar.show(plan.key.name(), point, points); });
    summaries.push_back(record.summary());
    bar.finish(summaries.back());
    if (options.csv.empty())
      continue;
    std::ofstream out(fs::path(options.csv) / (plan.key.name() + ".csv"));
    experiments::writeRun(out, record, robot);
    if (!out.flush())
      client::failToWrite(kFailure, options.csv);
  }
  bar.end();
  if (!options.csv.empty()) {
    std::ofstream out(fs::path(options.csv) / "summary.csv");
    experiments::writeSummary(out, summaries, options.gateOn());
  }
  return summaries;
}

/// As the paper prints them: without the mean.
nlohmann::ordered_json publishedJson(double rms, double deviation, double max) {
  return {{"rms_mm", 1e3 * rms}, {"std_mm", 1e3 * deviation}, {"max_mm", 1e3 * max}};
}

/// Adds the results that a single run and a mean over runs both have.
template <class Results>
void addResults(const Results& r, nlohmann::ordered_json& line) {
  const auto errors = [](const experiments::ErrorStatistics& e) -> nlohmann::ordered_json {
    if (e.count == 0)
      return nullptr;
    nlohmann::ordered_json json = publishedJson(e.rms, e.deviation, e.max);
    json["mean_mm"] = 1e3 * e.mean;
    return json;
  };
  line["iterations"] = r.iterations;
  line["epsilon_ab"] = errors(r.ab);
  line["epsilon_a"] = errors(r.a);
  line["points"] = r.points;
  line["converged"] = r.converged;
  line["limit_violations"] = r.limit_violations;
  line["gate_actions"] = r.gate_actions;
  line["largest_excess_mm"] = 1e3 * r.largest_excess;
}

nlohmann::ordered_json furtherJson(const std::vector<experiments::RunSummary>& runs, const config::Robot& robot) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const experiments::RunSummary& run : runs) {
    for (const auto& [task, errors] : run.further) {
      const auto [per_si, unit] = planning::reportUnit(task.kind);
      json.push_back({{"run", run.key.name()},
                      {"task", describe(task, config::shortArmNames(robot))},
                      {std::string("mean_") + unit, per_si * errors.mean},
                      {std::string("rms_") + unit, per_si * errors.rms},
                      {std::string("max_") + unit, per_si * errors.max}});
    }
  }
  return json;
}

nlohmann::ordered_json tableJson(const std::vector<experiments::ComparisonRow>& rows,
                                 const std::vector<experiments::RunSummary>& runs,
                                 double seconds,
                                 const ExperimentCommand& options,
                                 const config::Robot& robot) {
  nlohmann::ordered_json json{{"seconds", seconds}, {"gate", options.gate}, {"rows", nlohmann::ordered_json::array()}};
  json["failures"] = nlohmann::ordered_json::array();
  for (const experiments::RunSummary& run : runs) {
    if (!run.failure.empty())
      json["failures"].push_back({{"run", run.key.name()}, {"iterations", run.iterations}, {"why", run.failure}});
  }
  json["further"] = furtherJson(runs, robot);
  json["snaps"] = nlohmann::ordered_json::array();
  for (const experiments::RunSummary& run : runs) {
    if (run.snaps.count > 0)
      json["snaps"].push_back({{"run", run.key.name()},
                               {"count", run.snaps.count},
                               {"energy_mJ", 1e3 * run.snaps.energy},
                               {"longest_distance_mm", 1e3 * run.snaps.distance}});
  }
  for (const experiments::ComparisonRow& row : rows) {
    nlohmann::ordered_json line{{"trajectory", row.trajectory}, {"method", control::name(row.method)}};
    addResults(row, line);
    if (row.published != nullptr) {
      const config::PublishedRow& p = *row.published;
      line["published"] = {{"iterations", p.iterations},
                           {"epsilon_ab", publishedJson(p.rms_ab, p.std_ab, p.max_ab)},
                           {"epsilon_a", publishedJson(p.rms_a, p.std_a, p.max_a)}};
    }
    for (std::size_t i = 0; options.by_configuration && i < row.configurations.size(); ++i) {
      nlohmann::ordered_json run{{"configuration", row.configurations[i].key.configuration}};
      addResults(row.configurations[i], run);
      line["configurations"].push_back(run);
    }
    json["rows"].push_back(line);
  }
  return json;
}

std::vector<experiments::RunPlan> selected(const ExperimentCommand& options, const config::Experiment& experiment) {
  std::vector<experiments::RunPlan> plans = experiments::plan(experiment);
  if (options.only.empty())
    return plans;
  std::string names;
  for (const auto& plan : plans)
    names += " " + plan.key.name();
  std::erase_if(plans, [&](const auto& plan) { return plan.key.name().find(options.only) == std::string::npos; });
  if (plans.empty())
    throw Failure(kUsage, "--only " + options.only + ": unknown run; expected one of:" + names);
  return plans;
}

int runExperiment(ExperimentCommand options) {
  const config::Experiment experiment = config::loadExperiment(config::findFile(options.experiment, "experiment"));
  config::Deployment deployment = runtime::loadDeployment(options.deployment);
  config::Robot robot = config::loadAnyRobot(experiment.robot);
  if (const std::string why = refusal(robot, robots::Capability::kTips); !why.empty())
    throw Failure(kUsage, why);
  if (options.offline) {
    if (const std::string found = runtime::loadMethod(experiment.method_library, 0.0, robot); !found.empty())
      std::cerr << found << '\n';
  }
  if (options.encoder_noise > 0.0 && !options.offline)
    throw Failure(kUsage, "--encoder-noise-mm: expected --offline; over DDS set plant.encoders in the deployment");
  if (options.encoder_noise > 0.0)
    deployment.plant.encoders = experiments::withEncoderNoise(deployment.plant.encoders, 1e-3 * options.encoder_noise);
  config::setReadingErrors(deployment.plant.encoders, robot);
  if (!options.gateOn() && !options.offline)
    throw Failure(kUsage, "--gate off: expected --offline; the gate of a process cannot be switched off");
  const config::Robot plant = options.gateOn() ? robot : experiments::withoutGate(robot);
  const robots::RobotModel model(robot, deployment.model);
  const std::vector<experiments::RunPlan> plans = selected(options, experiment);
  if (options.figures.wanted() && options.csv.empty())
    options.csv = (fs::path(options.figures.path) / "csv").string();

  const auto start = std::chrono::steady_clock::now();
  std::vector<experiments::RunSummary> summaries;
  if (options.offline) {
    const experiments::LoopOptions loop = experiments::loopOptions(deployment, experiment);
    summaries = runPlans(options, robot, plans, [&](const auto& plan, const auto& progress) {
      return experiments::runOffline(plant, model, plan, loop, progress);
    });
  } else {
    if (!fs::equivalent(deployment.robot, experiment.robot)) {
      throw Failure(kUsage, "robot: found " + deployment.robot.string() + " in " + deployment.file.string() + " and " +
                                experiment.robot.string() + " in the experiment; use the same robot in both files");
    }
    if (deployment.relative_gain != experiment.relative_gain || deployment.tip_gain != experiment.tip_gain) {
      throw Failure(kUsage,
                    fmt::format("relative_gain and tip_gain: found {} and {} in {}, {} and {} in the experiment; "
                                "use the same values in both files",
                                deployment.relative_gain, deployment.tip_gain, deployment.file.string(),
                                experiment.relative_gain, experiment.tip_gain));
    }
    if (deployment.method_library != experiment.method_library)
      throw Failure(kUsage, "method_library: found '" + deployment.method_library.string() + "' and '" +
                                experiment.method_library.string() +
                                "', in the deployment and in the experiment; use the same file in both");
    useOwnDomain(deployment);
    withProcesses(deployment, options.log, [&](const std::function<bool()>& interrupted) {
      ExperimentRunner runner(deployment, interrupted, true);
      TrajectoryExperiment trajectories(runner, robot, model);
      summaries = runPlans(options, robot, plans,
                           [&](const auto& plan, const auto& progress) { return trajectories.run(plan, progress); });
    });
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (options.figures.wanted())
    drawFigures("figures.py", {options.csv, options.figures.path, "--format", options.figures.format}, options.figures);
  const auto rows = experiments::compare(summaries, experiment.published);
  bool good = true;
  for (const auto& row : rows)
    good = good && row.converged == row.points && row.limit_violations == 0;
  for (const auto& run : summaries)
    good = good && run.failure.empty();
  if (options.json) {
    std::cout << tableJson(rows, summaries, seconds, options, robot).dump(2) << '\n';
  } else {
    std::cout << experiments::formatTable(rows, options.by_configuration, options.gateOn())
              << experiments::formatFurther(summaries, robot) << experiments::formatSnaps(summaries)
              << experiments::formatFailures(summaries);
    std::printf("%zu runs in %.1f s, %s\n", plans.size(), seconds,
                !options.gateOn()                                  ? "in one process, without the gate"
                : options.offline                                  ? "in one process"
                : deployment.clock == config::ClockMode::kLockStep ? "over DDS in lock-step"
                                                                   : "over DDS in real time");
    if (!options.csv.empty())
      std::cout << "rows and summary: " << options.csv << '\n';
    if (options.figures.wanted())
      std::cout << "figures: " << options.figures.path << '\n';
  }
  return good ? kOk : kFailure;
}

}  // namespace

void registerExperiment(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ExperimentCommand>();
  CLI::App* command =
      app.add_subcommand("experiment", "run an experiment, print the results together with the published ones");
  command->add_option("experiment", options->experiment, "experiment file or preset: table3, table3-large")
      ->capture_default_str();
  command->add_flag("--offline", options->offline, "run in one process, without DDS; the results are identical");
  command
      ->add_option("-d,--deployment", options->deployment,
                   "deployment to start for the run; with `hosts`, only this host's part; in real time the arms first "
                   "move to each start")
      ->capture_default_str();
  command
      ->add_option("--encoder-noise-mm,--encoder-noise", options->encoder_noise,
                   "noise of encoders, standard deviation: translations, mm; rotations 0.1 rad per mm; with --offline")
      ->check(CLI::Range(0.0, 1000.0));
  command
      ->add_option("--gate", options->gate,
                   "off: without the setpoint gate, to see which limits a method leaves; with --offline")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  command->add_option("--csv", options->csv,
                      "folder for a file per run (one row per iteration, SI) and summary.csv (mm)");
  addFiguresOption(*command, options->figures,
                   "folder for figures of paths, translations, gaps to limits, velocities and errors");
  command->add_option("--only", options->only, "only runs whose name contains this text, e.g. lissajous-1 or nspqp");
  command->add_option("--log", options->log, "log level of the services")->capture_default_str();
  command->add_flag("--by-configuration", options->by_configuration,
                    "also a line for each start configuration, below the mean over all of them");
  command->add_flag("--json", options->json, "JSON instead of the table");
  command->footer(legend({"converged", "outside", "gate"}) +
                  "Exit code 1: a point did not converge or a setpoint left its limits.");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return runExperiment(*options); }); });
}

}  // namespace tandem::cli
