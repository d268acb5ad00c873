// SPDX-License-Identifier: Apache-2.0
/** @file tandem validate: check and summary of configuration files. */
#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "config/config.h"
#include "config/robot_files.h"
#include "config/values.h"
#include "robots/orientation_freedom.h"
#include "robots/overlap.h"
#include "services/cli/subcommand.h"
#include "services/runtime/identity.h"

namespace tandem::cli {
namespace {

/// Overlaps of the arms at home, of a robot or deployment file.
/// @throw config::Error for a deployment whose arms cannot follow the orientations that it names
std::vector<std::string> overlapsOf(const std::string& file, const std::string& kind) {
  if (kind == "deployment") {
    const config::Deployment deployment = config::loadDeployment(file);
    const config::Robot robot = config::loadAnyRobot(deployment);
    robots::requireOrientation(deployment, robot);
    return robots::describeHomeOverlaps(robot, deployment.model);
  }
  const auto& robots = config::robotFiles();
  const bool robot = std::ranges::any_of(robots, [&](const config::RobotFile& of) { return of.kind == kind; });
  return robot ? robots::describeHomeOverlaps(config::loadAnyRobot(file)) : std::vector<std::string>{};
}

int runValidate(const std::vector<std::string>& files, bool as_json) {
  nlohmann::ordered_json results = nlohmann::ordered_json::array();
  bool good = true;
  for (const std::string& name : files) {
    nlohmann::ordered_json result{{"file", name}};
    try {
      const bool is_path = name.find_first_of("./") != std::string::npos;  // no preset has these in its name
      const std::string file = is_path ? name : config::findFile(name, "").string();
      result["file"] = file;
      config::Summary summary = config::validate(file);
      for (const std::string& overlap : overlapsOf(file, summary.kind))
        summary.warnings.push_back(overlap);
      result["valid"] = true;
      result["kind"] = summary.kind;
      result["summary"] = summary.text;
      result["warnings"] = summary.warnings;
      std::string fingerprint;
      if (summary.kind == "deployment") {
        fingerprint = config::fingerprintText(runtime::fingerprintOf(config::loadDeployment(file)));
        result["fingerprint"] = fingerprint;
        fingerprint.insert(0, ", fingerprint ");
      }
      if (!as_json) {
        std::cout << file << ": ok: " << summary.text << fingerprint << '\n';
        for (const std::string& warning : summary.warnings)
          std::cout << "  warning: " << warning << '\n';
      }
    } catch (const config::Error& error) {
      good = false;
      result["valid"] = false;
      result["errors"] = client::errorsJson(error);
      if (!as_json)
        std::cerr << error.what() << '\n';
    }
    results.push_back(result);
  }
  if (as_json)
    std::cout << results.dump(2) << '\n';
  return good ? kOk : kUsage;
}

}  // namespace

void registerValidate(CLI::App& app, int& exit_code) {
  auto files = std::make_shared<std::vector<std::string>>();
  auto as_json = std::make_shared<bool>(false);
  CLI::App* validate = app.add_subcommand(
      "validate", "check configuration files of every kind: robot, deployment, trajectory, path, hardware ...");
  validate->add_option("files", *files, "files, or names of presets")->required();
  validate->add_flag("--json", *as_json, "JSON instead of text");
  validate->callback(
      [files, as_json, &exit_code] { guarded(exit_code, [&] { return runValidate(*files, *as_json); }); });
}

}  // namespace tandem::cli
