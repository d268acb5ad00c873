// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "config/arm_names.h"
#include "config/detail/loaders.h"
#include "config/file_tables.h"
#include "config/robot_files.h"

namespace tandem::config {
namespace {

Configuration readConfiguration(const Map& map, const Robot& robot) {
  auto configuration = map.read<Configuration>();
  const std::vector<std::string> names = armList(robot);
  if (!map.has("joints")) {
    for (const Arm& arm : robot.arms)
      configuration.joints.push_back(arm.home);
    return configuration;
  }
  if (robot.type != "robot")
    map.fail("joints", "found joints of tubes for the " + robot.type + " robot of " + robot.file.filename().string() +
                           ", expected no such key: it starts at home");
  configuration.joints.resize(names.size());
  for (const Map& joints : map.maps("joints")) {
    const std::size_t index = joints.indexAmong("arm", names, "an arm of the robot: " + join(names));
    if (configuration.joints[index].size() > 0)
      joints.fail("arm", "found '" + names[index] + "' a second time, expected it once");
    configuration.joints[index] = readJoints(joints, robot.arms[index].limits);
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (configuration.joints[i].size() == 0)
      map.fail("joints", "found no entry for '" + names[i] + "', expected one");
  }
  return configuration;
}

/// Names of the trajectory's configurations; all of them if the key is absent.
std::vector<std::string> readStarts(const Map& map, const std::vector<Configuration>& configurations) {
  std::vector<std::string> known;
  for (const Configuration& configuration : configurations)
    known.push_back(configuration.name);
  if (!map.has("configurations"))
    return known;
  const std::vector<std::string> names = map.texts("configurations");
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (std::find(known.begin(), known.end(), names[i]) == known.end()) {
      map.fail("configurations", "found '" + names[i] + "', expected one of " + join(known), static_cast<int>(i));
    }
  }
  return names;
}

ExperimentTrajectory readRun(const Map& map, const Experiment& experiment, const Robot& robot) {
  ExperimentTrajectory run{readTrajectory(map, experiment.file.has_parent_path() ? experiment.file.parent_path() : "."),
                           readStarts(map, experiment.configurations)};
  if (const std::string wrong = findArms(run.spec, robot); !wrong.empty())
    map.fail(map.has("tasks") ? "tasks" : map.has("other_arm") ? "other_arm" : "arm", wrong);
  for (const ExperimentTrajectory& earlier : experiment.trajectories) {
    if (earlier.spec.name != run.spec.name)
      continue;
    for (const std::string& start : run.configurations) {
      if (std::find(earlier.configurations.begin(), earlier.configurations.end(), start) !=
          earlier.configurations.end()) {
        map.fail("name", "found '" + run.spec.name + "' from configuration " + start +
                             " a second time, expected another name or other configurations");
      }
    }
  }
  return run;
}

PublishedRow readPublished(const Map& map, const std::vector<ExperimentTrajectory>& trajectories) {
  auto row = map.read<PublishedRow>();
  const bool known = std::any_of(trajectories.begin(), trajectories.end(),
                                 [&](const ExperimentTrajectory& t) { return t.spec.name == row.trajectory; });
  if (!known)
    map.fail("trajectory", "found '" + row.trajectory + "', expected the name of one of the trajectories");
  row.iterations = map.number("iterations");
  const Map relative = map.map("relative");
  row.rms_ab = relative.number("rms");
  row.std_ab = relative.number("std");
  row.max_ab = relative.number("max");
  const Map tip = map.map("tip");
  row.rms_a = tip.number("rms");
  row.std_a = tip.number("std");
  row.max_a = tip.number("max");
  return row;
}

}  // namespace

Experiment loadExperiment(const std::filesystem::path& file) {
  Document document(file.string(), readFile(file));
  const Map map = document.check(experimentTable());
  auto experiment = map.read<Experiment>();
  experiment.file = file;
  experiment.robot = robotPath(map, file);
  experiment.method_library = methodLibrary(
      map, file, std::ranges::find(experiment.methods, control::Method::kForeign) != experiment.methods.end(),
      "methods");
  const Robot robot = loadAnyRobot(experiment.robot);
  map.eachDistinct("configurations", "name",
                   [&](const Map& entry) { experiment.configurations.push_back(readConfiguration(entry, robot)); });
  map.each("trajectories",
           [&](const Map& entry) { experiment.trajectories.push_back(readRun(entry, experiment, robot)); });
  map.each("published",
           [&](const Map& entry) { experiment.published.push_back(readPublished(entry, experiment.trajectories)); });
  document.finish();
  return experiment;
}

}  // namespace tandem::config
