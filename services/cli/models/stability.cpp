// SPDX-License-Identifier: Apache-2.0
/** @file tandem stability: distance of an arm from snapping, at joint vectors or over a map of relative rotations. */
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <numbers>

#include "config/robot_files.h"
#include "kinematics/compliant_model.h"
#include "robots/capability.h"
#include "services/cli/models/arm_options.h"
#include "services/cli/models/figure.h"
#include "services/cli/models/parallel.h"
#include "services/cli/models/stability_report.h"
#include "services/cli/models/table.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {
namespace {

namespace fs = std::filesystem;
using kinematics::CompliantModel;
using kinematics::ModelStatus;

struct StabilityCommand {
  std::string robot = "ark2024", arm = "a", joints, beta, csv, tubes, output = "-";
  FigureOptions figure;
  bool map = false, end_angles = false, equilibria = false, json = false;
  int resolution = 73, threads = 0;
};

void checkStability(const StabilityCommand& o) {
  const auto refuse = [](bool wrong, const std::string& why) {
    if (wrong)
      throw Failure(kUsage, why);
  };
  refuse(!o.csv.empty() && (!o.joints.empty() || o.map), "--csv cannot be combined with --joints or --map");
  refuse(!o.map && (!o.beta.empty() || !o.tubes.empty() || o.end_angles || o.figure.wanted()),
         "--beta, --tubes, --end-angles, --figure: need --map");
  refuse(o.json && o.figure.wanted(), "--figure needs CSV output; remove --json");
}

/// Joint vector of the options: --joints or home, with the translations of --beta.
Eigen::VectorXd jointsOf(const StabilityCommand& options, const config::Arm& arm) {
  const int n = arm.model.tubeCount();
  Eigen::VectorXd q = options.joints.empty() ? arm.home : numbersOf("--joints", options.joints, 2 * n);
  if (!options.beta.empty())
    q.head(n) = numbersOf("--beta", options.beta, n);
  if (const std::string why = refusal(arm, {0, {q.begin(), q.end()}, ""}); !why.empty())
    throw Failure(kUsage, (options.beta.empty() ? "--joints: " : "--beta: ") + why);
  return q;
}

/** A row of numbers and what is to be said of it. */
struct Row {
  std::vector<double> numbers;
  std::string status;
};

/// Writes rows that are computed in parallel, in their order. @return whether all are ok.
bool writeStabilityRows(const StabilityCommand& options,
                        const std::string& output,
                        std::vector<std::string> names,
                        std::size_t count,
                        const std::function<Row(std::size_t)>& answer) {
  std::ofstream file;
  if (output != "-") {
    if (const fs::path folder = fs::path(output).parent_path(); !folder.empty())
      fs::create_directories(folder);
    file.open(output);
    if (!file)
      client::failToWrite(kUsage, output);
  }
  std::vector<Row> rows(count);
  parallelFor(count, options.threads, "stability", [&](std::size_t i) { rows[i] = answer(i); });
  Table table(output == "-" ? std::cout : file, std::move(names), options.json);
  bool all = true;
  for (const Row& row : rows) {
    table.add(row.numbers, row.status);
    all = all && row.status == "ok";
  }
  if (!table.finish())
    client::failToWrite(kFailure, output);
  return all;
}

/// Numbers of equilibria: stable ones, others.
std::vector<double> census(const CompliantModel& model, const Eigen::VectorXd& q) {
  double stable = 0.0, others = 0.0;
  for (const kinematics::EquilibriumInfo& info : model.equilibria(q))
    (info.conjugate_points == 0 ? stable : others) += 1.0;
  return {stable, others};
}

int runRows(const StabilityCommand& options, const config::Arm& arm) {
  const CompliantModel model(arm.model);
  const int n = arm.model.tubeCount();
  const auto input = openInput(options.csv);
  const std::vector<experiments::CsvRow> rows = experiments::readRows(*input, jointColumns(arm), options.csv);
  std::vector<std::string> names{"stability",     "stability_at",  "conjugate_points",
                                 "rotation_left", "rotation_tube", "rotation_sense"};
  append(names, numbered("d_beta", n));
  append(names, numbered("d_alpha", n));
  if (options.equilibria)
    append(names, {"stable_equilibria", "other_equilibria"});
  return writeStabilityRows(
             options, options.output, names, rows.size(),
             [&](std::size_t i) -> Row {
               if (const std::string why = refusal(arm, rows[i]); !why.empty())
                 return {{}, why};
               const Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(rows[i].values.data(), 2 * n);
               kinematics::Branch branch;
               kinematics::Stability s;
               if (const ModelStatus status = model.stability(q, branch, s); status != ModelStatus::kOk)
                 return {{}, std::string(describe(status))};
               const bool bounded = std::isfinite(s.rotation_left);
               Row row{{s.minimum, s.at, static_cast<double>(s.conjugate_points), s.rotation_left,
                        bounded ? s.rotation_tube + 1.0 : std::nan(""), bounded ? s.rotation_sense : std::nan("")},
                       s.conjugate_points > 0 ? unstable(s.conjugate_points) : "ok"};
               row.numbers.insert(row.numbers.end(), s.gradient.begin(), s.gradient.end());
               if (options.equilibria)
                 append(row.numbers, census(model, q));
               return row;
             })
             ? kOk
             : kFailure;
}

/// The one or two tubes that are turned in a map, from 0.
std::vector<int> turnedTubes(const StabilityCommand& options, int n) {
  if (options.tubes.empty())
    return n == 2 ? std::vector<int>{1} : std::vector<int>{1, 2};
  std::vector<int> tubes;
  const auto count = static_cast<int>(std::count(options.tubes.begin(), options.tubes.end(), ',')) + 1;
  for (const double tube : numbersOf("--tubes", options.tubes, count)) {
    if (tube != std::floor(tube) || tube < 2 || tube > n)
      throw Failure(kUsage, "--tubes: expected numbers from 2 to " + std::to_string(n) + "; tube 1 is the reference");
    tubes.push_back(static_cast<int>(tube) - 1);
  }
  if (tubes.size() > 2 || (tubes.size() == 2 && tubes[0] == tubes[1]))
    throw Failure(kUsage, "--tubes: expected one tube or two different ones");
  return tubes;
}

/// One place of a map: angles of tubes relative to tube 1, at the motors or at the ends.
Row mapRow(const StabilityCommand& options,
           const CompliantModel& model,
           const Eigen::VectorXd& q,
           std::vector<double> numbers) {
  const int n = model.arm().tubeCount();
  kinematics::Tip tip;
  Eigen::VectorXd alpha = q.tail(n);
  const ModelStatus status = options.end_angles ? model.tipFromEndAngles(q, alpha, tip) : model.tip(q, tip);
  const bool known = status == ModelStatus::kOk;
  if (!known)
    tip.stability = tip.stability_at = std::nan("");
  append(numbers, {tip.stability, tip.stability_at, known ? tip.conjugate_points : std::nan("")});
  if (options.end_angles)
    numbers.insert(numbers.end(), alpha.begin(), alpha.end());
  if (options.equilibria)
    append(numbers, census(model, q));
  return {numbers, statusOf(status, tip)};
}

int runMap(StabilityCommand options, const config::Arm& arm) {
  const CompliantModel model(arm.model);
  const int n = arm.model.tubeCount();
  const Eigen::VectorXd q = jointsOf(options, arm);
  const std::vector<int> turned = turnedTubes(options, n);
  if (options.end_angles && options.equilibria)
    throw Failure(kUsage, "--equilibria: end angles belong to one equilibrium; leave out --end-angles");
  std::vector<std::string> names;
  for (const int tube : turned)
    names.push_back("relative_" + std::to_string(tube + 1));
  append(names, {"stability", "stability_at", "conjugate_points"});
  if (options.end_angles)
    append(names, numbered("alpha", n));
  if (options.equilibria)
    append(names, {"stable_equilibria", "other_equilibria"});
  const auto across = static_cast<std::size_t>(options.resolution);
  if (options.figure.wanted() && options.output == "-")
    options.output = fs::path(options.figure.path).replace_extension(".csv").string();
  // A map is there to show where an arm is unstable: that is no failure.
  writeStabilityRows(options, options.output, names, turned.size() == 2 ? across * across : across, [&](std::size_t i) {
    Eigen::VectorXd joints = q;
    std::vector<double> relative;
    for (std::size_t k = 0; k < turned.size(); ++k, i /= across) {
      const double part = static_cast<double>(i % across) / static_cast<double>(across - 1);
      relative.push_back(std::numbers::pi * (2.0 * part - 1.0));
      joints[n + turned[k]] = joints[n] + relative[k];
    }
    return mapRow(options, model, joints, relative);
  });
  if (options.figure.wanted())
    drawFigures("mechanics.py", {"map", options.output, options.figure.path}, options.figure);
  return kOk;
}

int runStability(const StabilityCommand& options) {
  checkStability(options);
  const config::Robot robot = config::loadAnyRobot(config::findFile(options.robot, config::robotKinds()));
  if (const std::string why = refusal(robot, robots::Capability::kStability); !why.empty())
    throw Failure(kUsage, why);
  const config::Arm& arm = armOf(robot, options.arm);
  if (options.map)
    return runMap(options, arm);
  if (!options.csv.empty())
    return runRows(options, arm);
  const StabilityReport report = reportStability(arm, jointsOf(options, arm));
  if (options.json) {
    std::cout << toJson(report).dump(2) << '\n';
  } else {
    std::cout << toText(report);
  }
  return report.status == "ok" ? kOk : kFailure;
}

}  // namespace

void registerStability(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<StabilityCommand>();
  CLI::App* command =
      app.add_subcommand("stability", "elastic stability of an arm at a joint vector, for CSV rows, or as a map");
  command->add_option("-r,--robot", options->robot, "robot file or preset")->capture_default_str();
  command->add_option("-a,--arm", options->arm, "name of the arm, with or without the prefix arm_")
      ->capture_default_str();
  command->add_option("-q,--joints", options->joints, "beta_1,..,beta_n,alpha_1,..,alpha_n, m and rad (default: home)");
  command->add_option("--csv", options->csv,
                      "CSV file of joint vectors, in SI or with a header that names units; - is standard input");
  command->add_flag("--map", options->map, "a map over rotations relative to tube 1, from -180 to 180 degrees");
  command->add_option("--beta", options->beta, "translations beta_1,..,beta_n of the map, m (default: those of home)");
  command->add_option("--tubes", options->tubes, "the one or two tubes that the map turns (default: 2,3)");
  command->add_option("--resolution", options->resolution, "points along each axis of the map")
      ->check(CLI::Range(2, 2001))
      ->capture_default_str();
  command->add_flag("--end-angles", options->end_angles,
                    "map over the angles of the tube ends instead of the motors; each point has exactly one "
                    "equilibrium, stable or not");
  command->add_flag("--equilibria", options->equilibria, "also count all equilibria of rows and maps (slow)");
  command->add_option("-o,--output", options->output, "file for rows and maps; - is standard output")
      ->capture_default_str();
  addFigureOption(*command, options->figure, "draw the map; the CSV file is written beside it");
  command->add_option("-t,--threads", options->threads, "threads; 0: one per core")->check(client::kNonNegative);
  command->add_flag("--json", options->json, "JSON instead of text or CSV");
  command->footer(
      "Stability is the smallest determinant along the arm: 1 without interaction, 0 where the arm snaps "
      "(docs/models.md).");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return runStability(*options); }); });
}

}  // namespace tandem::cli
