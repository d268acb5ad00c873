// SPDX-License-Identifier: Apache-2.0
/** @file tandem cooperative reach: reach of a tip with and without assistance. */
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
  double cell = 5e-3;
  bool json = false;
};

void writeReachSamples(const ReachCommand& o,
                       const config::CooperativeRobot& robot,
                       const std::vector<assist::Reach>& samples) {
  std::ofstream out(o.csv);
  std::vector<std::string> names;
  for (const int arm : {robot.assistance->target, robot.assistance->assist}) {
    for (const char* joint : {"insertion_", "roll_", "bend_"})
      names.push_back(joint + robot.arms[static_cast<std::size_t>(arm)].name);
  }
  append(names, {"x", "y", "z", "beyond"});
  Table table(out, names, false);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const assist::Joints q = assist::jointsOf(robot.range(), k, o.seed);
    std::vector<double> row(q.begin(), q.end());
    const bool ok = samples[k].status == assist::Status::kOk;
    for (int i = 0; i < 3; ++i)
      row.push_back(ok ? samples[k].assisted[i] : std::nan(""));
    row.push_back(ok ? samples[k].beyond : std::nan(""));
    table.add(row, ok ? "ok" : std::string(assist::describe(samples[k].status)));
  }
  if (!table.finish())
    client::failToWrite(kFailure, o.csv);
}

int runReach(ReachCommand o) {
  const config::CooperativeRobot robot = cooperativeRobot(o.robot);
  if (!robot.assistance)
    throw Failure(kUsage, robot.file.string() + ": assistance: found none, expected one for this command");
  const assist::TargetAssist model(robot.assistance->pair);
  const assist::Range range = robot.range();
  std::vector<assist::Reach> samples(static_cast<std::size_t>(o.samples));
  parallelFor(samples.size(), o.threads, "assisted",
              [&](std::size_t k) { samples[k] = assist::reachAt(model, range, assist::jointsOf(range, k, o.seed)); });
  const assist::ReachVolume volume = assist::reachVolume(model.pair().target.arm, range, samples, o.cell);
  std::map<std::string, int> refused;
  for (const assist::Reach& sample : samples) {
    if (sample.status != assist::Status::kOk)
      ++refused[std::string(assist::describe(sample.status))];
  }
  const Json json{{"robot", robot.name},
                  {"samples", volume.samples},
                  {"answered", volume.answered},
                  {"refused", refused},
                  {"cell_m", o.cell},
                  {"alone_m3", volume.alone},
                  {"assisted_m3", volume.assisted},
                  {"gained_m3", volume.gained},
                  {"farthest_m", volume.farthest}};
  if (o.figure.wanted() && o.csv.empty())
    o.csv = fs::path(o.figure.path).replace_extension(".csv").string();
  if (!o.csv.empty()) {
    if (fs::path(o.csv).has_parent_path())
      fs::create_directories(fs::path(o.csv).parent_path());
    writeReachSamples(o, robot, samples);
  }
  if (o.figure.wanted())
    drawFigures("cooperative.py", {"reach", o.csv, o.figure.path}, o.figure);
  if (o.json) {
    std::cout << json.dump(2) << '\n';
  } else {
    std::printf("%s: %d joint vectors, %d with a stable contact, cells of %g mm\n", robot.name.c_str(), volume.samples,
                volume.answered, 1e3 * o.cell);
    for (const auto& [why, count] : refused)
      std::printf("  not counted: %d x %s\n", count, why.c_str());
    std::printf("  reached alone            %9.1f cm3\n", 1e6 * volume.alone);
    std::printf("  reached with assistance  %9.1f cm3, of which beyond %9.1f cm3\n", 1e6 * volume.assisted,
                1e6 * volume.gained);
    std::printf("  farthest beyond          %9.1f mm\n", 1e3 * volume.farthest);
  }
  return volume.answered > 0 ? kOk : kFailure;
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
  command->add_option("-t,--threads", options->threads, "threads; 0: one per core")->check(CLI::NonNegativeNumber);
  command->add_option("--csv", options->csv, "CSV file, one row per joint vector, SI");
  addFigureOption(*command, options->figure, "workspace without and with assistance");
  command->add_flag("--json", options->json, "JSON instead of text");
  command->footer("Volumes with assistance are lower bounds: they grow with the number of samples.");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return runReach(*options); }); });
}

}  // namespace tandem::cli
