// SPDX-License-Identifier: Apache-2.0
/** @file tandem cooperative reach: reach of a tip with and without assistance. */
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>

#include "services/cli/models/cooperative.h"
#include "services/cli/models/figure.h"
#include "services/cli/models/parallel.h"
#include "services/cli/models/table.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {
namespace {

namespace assist = kinematics::assist;
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct ReachCommand {
  std::string robot = "ablation-assist", csv;
  FigureOptions figure;
  int samples = 20000, threads = 0;
  std::uint64_t seed = 1;
  double cell = 5e-3, most_strain = 0.08;
  std::vector<double> most_force{0.1, 0.2, 0.5, 1.0};  // increasing
  bool json = false;
};

void writeReachSamples(const ReachCommand& o,
                       const config::CooperativeRobot& robot,
                       const std::vector<assist::Reach>& samples,
                       const assist::ReachBounds& bounds) {
  std::ofstream out(o.csv);
  std::vector<std::string> names;
  for (const int arm : {robot.assistance->target, robot.assistance->assist}) {
    for (const char* joint : {"insertion_", "roll_", "bend_"})
      names.push_back(joint + robot.arms[static_cast<std::size_t>(arm)].name);
  }
  append(names, {"x", "y", "z", "beyond", "force", "strain", "advance"});
  Table table(out, names, false);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const assist::Joints q = assist::jointsOf(robot.range(), k, o.seed);
    const assist::Reach& sample = samples[k];
    std::vector<double> row(q.begin(), q.end());
    if (sample.status == assist::Status::kOk)
      append(row, {sample.assisted.x(), sample.assisted.y(), sample.assisted.z(), sample.beyond, sample.force,
                   sample.strain, sample.advance});
    row.resize(names.size(), std::nan(""));
    const std::string_view excluded = exclusionOf(sample, bounds);
    table.add(row, excluded.empty() ? "ok" : std::string(excluded));
  }
  if (!table.finish())
    client::failToWrite(kFailure, o.csv);
}

/// Results for each bound of the force, and why samples do not count at the largest one.
Json reachJson(const ReachCommand& o,
               const config::CooperativeRobot& robot,
               const std::vector<assist::Reach>& samples) {
  const kinematics::catheter::Arm& target = robot.assistance->pair.target.arm;
  std::map<std::string, int> excluded;
  for (const assist::Reach& sample : samples) {
    const std::string_view why = exclusionOf(sample, {o.most_force.back(), o.most_strain});
    if (!why.empty())
      ++excluded[std::string(why)];
  }
  Json json{{"robot", robot.name},          {"samples", samples.size()},
            {"excluded", excluded},         {"cell_m", o.cell},
            {"most_strain", o.most_strain}, {"alone_m3", assist::volumeAlone(target, robot.range(), o.cell)},
            {"bounds", Json::array()}};
  for (const double force : o.most_force) {
    const auto volume = assist::reachVolume(target, robot.range(), samples, {force, o.most_strain}, o.cell);
    json["bounds"].push_back({{"most_force_N", force},
                              {"counted", volume.counted},
                              {"assisted_m3", volume.assisted},
                              {"gained_m3", volume.gained},
                              {"farthest_m", volume.farthest}});
  }
  return json;
}

void printReach(const Json& json) {
  std::printf("%s: %d joint vectors, cells of %g mm, bending strain up to %g %%, no part behind an entry plane\n",
              json["robot"].get<std::string>().c_str(), json["samples"].get<int>(), 1e3 * json["cell_m"].get<double>(),
              1e2 * json["most_strain"].get<double>());
  for (const auto& [why, count] : json["excluded"].items())
    std::printf("  not counted: %d x %s\n", count.get<int>(), why.c_str());
  std::printf("  reached alone: %.1f cm3\n", 1e6 * json["alone_m3"].get<double>());
  std::printf("  %11s %9s %14s %14s %18s\n", "force up to", "counted", "reached cm3", "beyond cm3",
              "farthest beyond mm");
  for (const Json& row : json["bounds"])
    std::printf("  %9g N %9d %14.1f %14.1f %18.1f\n", row["most_force_N"].get<double>(), row["counted"].get<int>(),
                1e6 * row["assisted_m3"].get<double>(), 1e6 * row["gained_m3"].get<double>(),
                1e3 * row["farthest_m"].get<double>());
}

int runReach(ReachCommand o) {
  const config::CooperativeRobot robot = cooperativeRobot(o.robot);
  if (!robot.assistance)
    throw Failure(kUsage, robot.file.string() + ": assistance: found none, expected one for this command");
  std::ranges::sort(o.most_force);
  const assist::TargetAssist model(robot.assistance->pair);
  const assist::Range range = robot.range();
  std::vector<assist::Reach> samples(static_cast<std::size_t>(o.samples));
  parallelFor(samples.size(), o.threads, "assisted",
              [&](std::size_t k) { samples[k] = assist::reachAt(model, range, assist::jointsOf(range, k, o.seed)); });
  if (o.figure.wanted() && o.csv.empty())
    o.csv = fs::path(o.figure.path).replace_extension(".csv").string();
  if (!o.csv.empty()) {
    if (fs::path(o.csv).has_parent_path())
      fs::create_directories(fs::path(o.csv).parent_path());
    writeReachSamples(o, robot, samples, {o.most_force.back(), o.most_strain});
  }
  const Json json = reachJson(o, robot, samples);
  const bool any = json["bounds"].back()["counted"] > 0;
  if (o.figure.wanted() && any)
    drawFigures("cooperative.py", {"reach", o.csv, o.figure.path}, o.figure);
  if (o.json)
    std::cout << json.dump(2) << '\n';
  else
    printReach(json);
  return any ? kOk : kFailure;
}

}  // namespace

void registerReach(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ReachCommand>();
  CLI::App* command = app.add_subcommand("reach", "workspace of the target's tip, without and with the assist arm");
  command->add_option("-r,--robot", options->robot, "cooperative robot file or preset")->capture_default_str();
  command->add_option("-n,--samples", options->samples, "number of joint vectors, each solved independently")
      ->check(CLI::Range(16, 1 << 24))
      ->capture_default_str();
  command->add_option("--seed", options->seed, "seed: shift of the sequence of joint vectors")->capture_default_str();
  command->add_option("--cell", options->cell, "edge of the cells that are counted, m")
      ->check(CLI::Range(1e-3, 0.1))
      ->capture_default_str();
  command
      ->add_option("--most-force", options->most_force,
                   "largest forces between the arms, N: a row of results for each; the largest one is that of --csv "
                   "and --figure")
      ->delimiter(',')
      ->check(CLI::Range(1e-6, 1e6))
      ->capture_default_str();
  command->add_option("--most-strain", options->most_strain, "largest bending strain of the arms, relative")
      ->check(CLI::Range(1e-6, 1.0))
      ->capture_default_str();
  command->add_option("-t,--threads", options->threads, "threads; 0: one per core")->check(client::kNonNegative);
  command->add_option("--csv", options->csv, "CSV file, one row per joint vector, SI");
  addFigureOption(*command, options->figure, "workspace without and with assistance");
  command->add_flag("--json", options->json, "JSON instead of text");
  command->footer(
      "Volumes with assistance are lower bounds: they grow with the number of samples.\n"
      "A joint vector does not count if a part of an arm is behind the entry plane (through its base, across its "
      "axis).\n"
      "Exit code 1: no joint vector counts.");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return runReach(*options); }); });
}

}  // namespace tandem::cli
