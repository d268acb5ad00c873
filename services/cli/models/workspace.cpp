// SPDX-License-Identifier: Apache-2.0
/** @file tandem workspace: reachable tip positions. */
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>

#include "config/robot_files.h"
#include "kinematics/tube_model.h"
#include "robots/capability.h"
#include "services/cli/models/arm_options.h"
#include "services/cli/models/figure.h"
#include "services/cli/models/parallel.h"
#include "services/cli/models/reach.h"
#include "services/cli/models/table.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct WorkspaceCommand {
  std::string robot = "ark2024", arm = "all", model = "compliant", csv;
  FigureOptions figures;
  std::size_t samples = 1u << 18;
  std::uint64_t seed = 1;
  double voxel = 4e-3, margin = 0.0;
  int threads = 0;
  bool json = false;
};

/** Result of the model at one joint vector. */
struct Sample {
  Eigen::Vector3d place = Eigen::Vector3d::Constant(std::nan(""));  ///< of the tip, m, robot base frame
  double stability = std::nan("");
  std::string status;
};

/** Everything that is known of one arm. */
struct ArmReach {
  const config::Arm* arm;
  bool symmetric = false;
  Eigen::MatrixXd joints;  ///< a column a sample
  std::vector<Sample> samples;
  std::map<std::string, std::size_t> refused;                    ///< how many by reason
  std::vector<std::pair<std::size_t, Eigen::Vector3d>> reached;  ///< sample and tip in the arm's base frame, m
};

ArmReach sample(const WorkspaceCommand& options, const config::Arm& arm) {
  ArmReach reach;
  reach.arm = &arm;
  reach.symmetric = turnsFreely(arm.limits);
  reach.joints = sampleJoints(arm.limits, options.samples, options.seed);
  reach.samples.resize(options.samples);
  const auto model = kinematics::makeArmModel(options.model, arm.model);
  parallelFor(options.samples, options.threads, arm.name, [&](std::size_t i) {
    Sample& sample = reach.samples[i];
    kinematics::Tip tip;
    const auto status = model->tip(reach.joints.col(static_cast<Eigen::Index>(i)), tip);
    sample.status = statusOf(status, tip);
    if (status != kinematics::ModelStatus::kOk)
      return;
    sample.place = tip.pose.translation();
    sample.stability = tip.stability;
    if (sample.status == "ok" && tip.stability < options.margin)
      sample.status = "stability below the margin";
  });
  const Eigen::Isometry3d to_arm = arm.model.base.inverse();
  for (std::size_t i = 0; i < options.samples; ++i) {
    if (reach.samples[i].status == "ok") {
      reach.reached.emplace_back(i, to_arm * reach.samples[i].place);
    } else {
      ++reach.refused[reach.samples[i].status];
    }
  }
  return reach;
}

/// Volume in cells of `size`, m^3, of the first `samples` samples.
double volume(const ArmReach& reach, double size, std::size_t samples) {
  return Cells(reach.reached, reach.symmetric, size, samples).volume();
}

Json armJson(const WorkspaceCommand& options, const ArmReach& reach) {
  Eigen::Vector3d lower = Eigen::Vector3d::Constant(INFINITY), upper = -lower;
  double radius = 0.0;
  for (const auto& [index, point] : reach.reached) {
    lower = lower.cwiseMin(point);
    upper = upper.cwiseMax(point);
    radius = std::max(radius, std::hypot(point.x(), point.y()));
  }
  const Eigen::Vector3d p = reach.arm->model.base.translation();
  const Eigen::Quaterniond q(reach.arm->model.base.linear());
  return {{"arm", reach.arm->name},
          {"samples", options.samples},
          {"reached", reach.reached.size()},
          {"refused", reach.refused},
          {"symmetric", reach.symmetric},
          {"volume_m3", volume(reach, options.voxel, options.samples)},
          {"volume_half_samples_m3", volume(reach, options.voxel, options.samples / 2)},
          {"volume_double_voxel_m3", volume(reach, 2.0 * options.voxel, options.samples)},
          {"radius_m", radius},
          {"z_m", {lower.z(), upper.z()}},
          {"base", {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()}}};
}

/// Volumes that all arms, and that any arm reaches, in cells of `size` and from the first samples.
SharedVolume shared(const std::vector<ArmReach>& arms, double size, std::size_t samples) {
  std::vector<Cells> cells;
  std::vector<Eigen::Isometry3d> bases;
  for (const ArmReach& reach : arms) {
    cells.emplace_back(reach.reached, reach.symmetric, size, samples);
    bases.push_back(reach.arm->model.base);
  }
  return sharedVolume(cells, bases, size);
}

Json sharedJson(const WorkspaceCommand& options, const std::vector<ArmReach>& arms) {
  const SharedVolume fine = shared(arms, options.voxel, options.samples);
  const SharedVolume half = shared(arms, options.voxel, options.samples / 2);
  const SharedVolume coarse = shared(arms, 2.0 * options.voxel, options.samples);
  return {
      {"common_m3", fine.common}, {"common_half_samples_m3", half.common}, {"common_double_voxel_m3", coarse.common},
      {"any_m3", fine.any},       {"any_half_samples_m3", half.any},       {"any_double_voxel_m3", coarse.any}};
}

void writeSamples(const fs::path& file, const ArmReach& reach) {
  std::ofstream out(file);
  const int n = reach.arm->model.tubeCount();
  std::vector<std::string> names = numbered("beta", n);
  append(names, numbered("alpha", n));
  append(names, {"x", "y", "z", "stability"});
  Table table(out, names, false);
  for (std::size_t i = 0; i < reach.samples.size(); ++i) {
    const auto q = reach.joints.col(static_cast<Eigen::Index>(i));
    std::vector<double> numbers(q.begin(), q.end());
    const Sample& sample = reach.samples[i];
    append(numbers, {sample.place.x(), sample.place.y(), sample.place.z(), sample.stability});
    table.add(numbers, sample.status);
  }
  if (!table.finish())
    client::failToWrite(kFailure, file.string());
}

void writeFiles(const WorkspaceCommand& options, const std::vector<ArmReach>& arms, const Json& summary) {
  fs::create_directories(options.csv);
  for (const ArmReach& reach : arms)
    writeSamples(fs::path(options.csv) / ("workspace-" + reach.arm->name + ".csv"), reach);
  std::ofstream out(fs::path(options.csv) / "workspace.json");
  out << summary.dump(2) << '\n';
  if (!out.flush())
    client::failToWrite(kFailure, options.csv);
  if (options.figures.wanted())
    drawFigures("mechanics.py", {"workspace", options.csv, options.figures.path, "--format", options.figures.format},
                options.figures);
}

/// "  reachable volume   1234.5 cm3; from half the samples -2.1 %, in voxels twice as large +5.0 %".
void printVolume(const char* what, const Json& json, const std::string& name) {
  const auto at = [&](const char* suffix) { return json[name + suffix].get<double>(); };
  const double volume = at("_m3");
  const auto percent = [&](const char* suffix) { return volume > 0.0 ? 100.0 * (at(suffix) / volume - 1.0) : 0.0; };
  std::printf("  %-17s %9.1f cm3; from half the samples %+.1f %%, in voxels twice as large %+.1f %%\n", what,
              1e6 * volume, percent("_half_samples_m3"), percent("_double_voxel_m3"));
}

void printWorkspace(const WorkspaceCommand& options, const Json& summary) {
  std::printf("%s model, voxels of %g mm, seed %llu\n", options.model.c_str(), 1e3 * options.voxel,
              static_cast<unsigned long long>(options.seed));
  for (const Json& arm : summary["arms"]) {
    std::printf("%s: %zu samples, %zu stable answers%s\n", arm["arm"].get<std::string>().c_str(),
                arm["samples"].get<std::size_t>(), arm["reached"].get<std::size_t>(),
                arm["symmetric"] ? "; a solid of revolution, as rotations are free" : "");
    for (const auto& [reason, count] : arm["refused"].items())
      std::printf("  not counted: %zu x %s\n", count.get<std::size_t>(), reason.c_str());
    printVolume("reachable volume", arm, "volume");
    std::printf("  radius up to %.1f mm, z %.1f to %.1f mm\n", 1e3 * arm["radius_m"].get<double>(),
                1e3 * arm["z_m"][0].get<double>(), 1e3 * arm["z_m"][1].get<double>());
  }
  if (!summary.contains("shared"))
    return;
  std::printf("all arms together:\n");
  printVolume("every tip reaches", summary["shared"], "common");
  printVolume("some tip reaches", summary["shared"], "any");
}

int runWorkspace(WorkspaceCommand options) {
  const config::Robot robot = config::loadAnyRobot(config::findFile(options.robot, config::robotKinds()));
  if (const std::string why = refusal(robot, robots::Capability::kComputation); !why.empty())
    throw Failure(kUsage, why);
  std::vector<ArmReach> arms;
  const bool all = options.arm == "all" || options.arm == "both";
  if (options.arm == "both" && robot.arms.size() != 2)
    throw Failure(kUsage, "--arm both: the robot has " + std::to_string(robot.arms.size()) + " arms; use --arm all");
  for (const config::Arm& arm : robot.arms) {
    if (all || &arm == &armOf(robot, options.arm))
      arms.push_back(sample(options, arm));
  }
  Json summary{{"robot", robot.name},  {"model", options.model},   {"voxel_m", options.voxel},
               {"seed", options.seed}, {"margin", options.margin}, {"arms", Json::array()}};
  for (const ArmReach& reach : arms)
    summary["arms"].push_back(armJson(options, reach));
  if (arms.size() > 1)
    summary["shared"] = sharedJson(options, arms);
  if (options.figures.wanted() && options.csv.empty())
    options.csv = (fs::path(options.figures.path) / "csv").string();
  if (!options.csv.empty())
    writeFiles(options, arms, summary);
  if (options.json) {
    std::cout << summary.dump(2) << '\n';
  } else {
    printWorkspace(options, summary);
  }
  for (const ArmReach& reach : arms) {
    if (reach.reached.empty())
      return kFailure;
  }
  return kOk;
}

}  // namespace

void registerWorkspace(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<WorkspaceCommand>();
  CLI::App* command =
      app.add_subcommand("workspace", "reachable volume of each arm, and the volumes that all and any arms reach");
  command->add_option("-r,--robot", options->robot, "robot file or preset")->capture_default_str();
  command->add_option("-a,--arm", options->arm, "arm by its name, or all, or both")->capture_default_str();
  command->add_option("-m,--model", options->model, "kinematic model: rigid or compliant")
      ->check(CLI::IsMember({"rigid", "compliant"}))
      ->capture_default_str();
  command->add_option("-n,--samples", options->samples, "number of joint vectors per arm")
      ->check(CLI::Range(std::size_t{16}, std::size_t{1} << 26))
      ->capture_default_str();
  command->add_option("--seed", options->seed, "seed: shift of the sequence of joint vectors")->capture_default_str();
  command->add_option("--voxel", options->voxel, "edge of the cells that are counted, m")
      ->check(CLI::Range(1e-5, 0.1))
      ->capture_default_str();
  command->add_option("--margin", options->margin, "minimum stability of a sample to be counted, 0 to 1")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->add_option("-t,--threads", options->threads, "threads; 0: one per core")->check(client::kNonNegative);
  command->add_option("--csv", options->csv,
                      "folder for workspace-ARM.csv (one row per sample, SI) and workspace.json");
  addFiguresOption(*command, options->figures, "folder for the figures workspace-section and workspace-volume");
  command->add_flag("--json", options->json, "JSON instead of text");
  command->footer("Samples cover the permitted joint range, each solved independently; only stable solutions count.");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return runWorkspace(*options); }); });
}

}  // namespace tandem::cli
