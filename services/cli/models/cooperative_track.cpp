// SPDX-License-Identifier: Apache-2.0
/** @file tandem cooperative co-manipulate, target-assist: motion of an object or of the target's tip along a path,
 * over DDS or in one process. */
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>

#include "config/robot_files.h"
#include "control/method_names.h"
#include "robots/catheters.h"
#include "robots/track.h"
#include "services/cli/deployment/supervisor.h"
#include "services/cli/models/arm_options.h"
#include "services/cli/models/cooperative.h"
#include "services/cli/models/figure.h"
#include "services/cli/models/path_experiment.h"
#include "services/cli/models/table.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using robots::TrackRecord;
using robots::TrackStep;

struct TrackCommand {
  bool assist = false;
  GraspOptions grasp;
  std::string shape = "lissajous", along, method = "nspqp", hold = "none", csv;
  FigureOptions figure;
  double size = 5e-3, duration = 10.0;
  std::string log = "warn";
  bool json = false, offline = false;
};

std::vector<int> directionsOf(const std::string& text) {
  std::vector<int> directions;
  std::istringstream line(text);
  for (std::string name; std::getline(line, name, ',');) {
    try {
      directions.push_back(planning::directionOf(name));
    } catch (const std::invalid_argument& error) {
      throw Failure(kUsage, "--along: " + std::string(error.what()));
    }
  }
  return directions;
}

/// Largest speed along the first direction of a path, m/s; for rotations at the size of the object.
double largestSpeed(const planning::ObjectPath& path) {
  constexpr int kTimes = 200;
  double speed = 0.0;
  planning::Twist displacement, rate;
  for (int k = 0; k <= kTimes; ++k) {
    path.at(path.duration * k / kTimes, displacement, rate);
    const int direction = path.directions[0];
    speed = std::max(speed, (direction < 3 ? 1.0 : path.length) * std::abs(rate[direction]));
  }
  return speed;
}

/// The first directions in which the mechanism can be moved at the speed of the path: translations before rotations.
std::vector<int> possible(robots::Mechanism& mechanism, planning::ObjectPath path) {
  const std::size_t wanted = path.shape == planning::PathShape::kLine ? 1 : 2;
  std::vector<int> found;
  for (int k = 0; k < 6 && found.size() < wanted; ++k) {
    path.directions = {k};
    if (robots::refusal(mechanism, path).empty() && robots::attainableSpeed(mechanism, k) > largestSpeed(path))
      found.push_back(k);
  }
  if (found.size() < wanted) {
    throw Failure(kFailure, "the arms can move the common object along " +
                                (found.empty() ? std::string("none") : "only " + planning::directionName(found[0])) +
                                " of x, y, z, rx, ry, rz, but the shape needs " + std::to_string(wanted) +
                                "; see tandem cooperative mobility, or use --shape line");
  }
  return found;
}

std::vector<std::string> jointNames(const config::CooperativeRobot& robot, bool assisted) {
  std::vector<int> arms;
  if (assisted)
    arms = {robot.assistance->target, robot.assistance->assist};
  else
    arms = robot.object->arms;
  std::vector<std::string> names;
  for (const int arm : arms) {
    for (const char* joint : {"insertion_", "roll_", "bend_"})
      names.push_back(joint + robot.arms[static_cast<std::size_t>(arm)].name);
  }
  return names;
}

void writeTrackRows(std::ostream& out, const TrackRecord& record, const std::vector<std::string>& joints) {
  std::vector<std::string> names{"time"};
  append(names, joints);
  append(names, {"x", "y", "z", "qx", "qy", "qz", "qw", "error", "residual"});
  append(names, record.names);
  names.push_back("active_limits");
  Table table(out, names, false);
  for (const TrackStep& step : record.steps) {
    std::vector<double> row{step.time};
    row.insert(row.end(), step.joints.begin(), step.joints.end());
    append(row, poseNumbers(step.pose));
    append(row, {step.error, step.residual});
    append(row, step.columns);
    row.push_back(step.active_limits);
    table.add(row, std::string(control::name(step.status)));
  }
  if (!table.finish())
    client::failToWrite(kFailure, "table of results");
}

void writeShapes(const fs::path& file, const TrackRecord& record) {
  std::ofstream out(file);
  Table table(out, {"end", "arm", "x", "y", "z"}, false);
  for (const int end : {0, 1}) {
    const auto& shapes = end == 0 ? record.first_shape : record.last_shape;
    for (std::size_t arm = 0; arm < shapes.size(); ++arm) {
      for (const Eigen::Vector3d& p : shapes[arm])
        table.add({double(end), double(arm), p.x(), p.y(), p.z()}, "ok");
    }
  }
  table.finish();
}

/// Smallest and largest of a fact along the path.
std::pair<double, double> rangeOf(const TrackRecord& record, std::size_t fact) {
  double lower = INFINITY, upper = -INFINITY;
  for (const TrackStep& step : record.steps) {
    if (step.time < 0.0)
      continue;
    lower = std::min(lower, step.columns[fact]);
    upper = std::max(upper, step.columns[fact]);
  }
  return {lower, upper};
}

Json summary(const TrackCommand& o, const planning::ObjectPath& path, const TrackRecord& record) {
  Json directions = Json::array(), facts = Json::object();
  for (const int d : path.directions)
    directions.push_back(planning::directionName(d));
  int active = 0, periods = 0;
  for (const TrackStep& step : record.steps) {
    active += step.time >= 0.0 && step.active_limits > 0;
    periods += step.time >= 0.0;
  }
  for (std::size_t k = 0; k < record.names.size() && periods > 0; ++k) {
    const auto [lower, upper] = rangeOf(record, k);
    facts[record.names[k]] = {lower, upper};
  }
  return {{"robot", o.grasp.robot},
          {"method", o.method},
          {"offline", o.offline},
          {"shape", o.shape},
          {"along", directions},
          {"size_m", o.size},
          {"hold", o.hold},
          {"periods", periods},
          {"good", record.good()},
          {"refused", record.refused},
          {"stopped", record.stopped},
          {"rms_error_m", record.rms_error},
          {"max_error_m", record.max_error},
          {"max_residual_m", record.max_residual},
          {"periods_at_limits", active},
          {"facts", facts}};
}

void printTrack(const Json& json, bool assisted) {
  if (json["refused"] != "") {
    std::printf("refused: %s\n", json["refused"].get<std::string>().c_str());
    return;
  }
  std::string along;
  for (const Json& name : json["along"])
    along += (along.empty() ? "" : ", ") + name.get<std::string>();
  std::printf("%s along %s of %.1f mm, held: %s, %s: %d periods, %d with an active limit\n",
              json["shape"].get<std::string>().c_str(), along.c_str(), 1e3 * json["size_m"].get<double>(),
              json["hold"].get<std::string>().c_str(), json["method"].get<std::string>().c_str(),
              json["periods"].get<int>(), json["periods_at_limits"].get<int>());
  std::printf("  %-32s %10s %10s\n", "", "rms", "largest");
  std::printf("  %-32s %10.4f %10.4f\n", assisted ? "error of the tip, mm" : "error of the object, mm",
              1e3 * json["rms_error_m"].get<double>(), 1e3 * json["max_error_m"].get<double>());
  std::printf("  %-32s %10s %10.2g\n", assisted ? "contact open, mm" : "residual of the contacts, mm", "",
              1e3 * json["max_residual_m"].get<double>());
  std::printf("  %-32s %10s %10s\n", "", "smallest", "largest");
  for (const auto& [name, range] : json["facts"].items())
    std::printf("  %-32s %10.4g %10.4g\n", name.c_str(), range[0].is_null() ? NAN : range[0].get<double>(),
                range[1].is_null() ? NAN : range[1].get<double>());
  std::printf("  %s\n", json["offline"].get<bool>() ? "in one process" : "over DDS in lock-step");
  if (json["stopped"] != "")
    std::printf("failed: %s\n", json["stopped"].get<std::string>().c_str());
}

/// The services run a robot file as it is.
void refuseChanges(const GraspOptions& grasp) {
  const auto refuse = [](const char* option) {
    throw Failure(kUsage,
                  std::string(option) +
                      ": needs --offline, because the processes of a run over DDS read the robot file unchanged; "
                      "add --offline, or change the robot file");
  };
  if (!grasp.contact.empty())
    refuse("--contact");
  if (grasp.squeeze)
    refuse("--squeeze");
  if (!grasp.load.empty())
    refuse("--load");
}

using TrackProgress = std::function<void(double, double)>;

/// By simulator, control and planning, as processes. @param mechanism  in equilibrium at home
TrackRecord trackOverDds(const TrackCommand& o,
                         const config::CooperativeRobot& robot,
                         robots::Mechanism& mechanism,
                         const planning::ObjectPath& path,
                         const robots::TrackOptions& options,
                         const TrackProgress& progress) {
  config::loadAnyRobot(robot.file);  // refused here, once, rather than by every process
  const TemporaryDeployment own(robot.file, options.parameters.period, options.gain, options.method);
  TrackRecord record;
  withProcesses(own.deployment(), o.log, [&](const std::function<bool()>& interrupted) {
    ExperimentRunner runner(own.deployment(), interrupted, false);
    record = runPath(runner, mechanism, path, options, progress);
  });
  return record;
}

int runTrack(TrackCommand o) {
  if (!o.offline)
    refuseChanges(o.grasp);
  const config::CooperativeRobot robot = o.assist ? cooperativeRobot(o.grasp.robot) : graspingRobot(o.grasp);
  std::unique_ptr<robots::Mechanism> mechanism;
  if (o.assist) {
    if (!robot.assistance)
      throw Failure(kUsage, robot.file.string() + ": assistance: found none, expected one for this command");
    mechanism = std::make_unique<robots::AssistedMechanism>(robot);
  } else {
    mechanism = std::make_unique<robots::GraspedObjectMechanism>(robot);
  }
  planning::ObjectPath path{planning::pathShape(o.shape), directionsOf(o.along),   o.size, o.duration,
                            mechanism->length(),          planning::keptOf(o.hold)};
  path.name = o.assist ? "target-assist" : "co-manipulate";
  if (const std::string why = mechanism->solveEquilibrium(mechanism->home()); !why.empty())
    throw Failure(kFailure, "home: " + why);
  if (o.along.empty())
    path.directions = possible(*mechanism, path);
  try {
    path.check();
  } catch (const std::invalid_argument& error) {
    throw Failure(kUsage, error.what());
  }
  robots::TrackOptions track;
  track.method = idl::fromName<control::Method>(o.method).value();
  track.parameters = robot.parameters;
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const TrackProgress progress = [terminal](double time, double duration) {
    if (terminal)
      std::fprintf(stderr, "\r%6.2f of %.2f s ", time, duration);
  };
  const TrackRecord record = o.offline ? robots::track(*mechanism, path, track, progress)
                                       : trackOverDds(o, robot, *mechanism, path, track, progress);
  if (terminal)
    std::fprintf(stderr, "\r%30s\r", "");
  const Json json = summary(o, path, record);
  if (o.json)
    std::cout << json.dump(2) << '\n';
  else
    printTrack(json, o.assist);
  if (o.figure.wanted() && o.csv.empty())
    o.csv = fs::path(o.figure.path).replace_extension(".csv").string();
  if (!o.csv.empty()) {
    if (fs::path(o.csv).has_parent_path())
      fs::create_directories(fs::path(o.csv).parent_path());
    std::ofstream out(o.csv);
    writeTrackRows(out, record, jointNames(robot, o.assist));
  }
  if (o.figure.wanted() && record.refused.empty()) {
    const std::string shapes = fs::path(o.csv).replace_extension(".shapes.csv").string();
    writeShapes(shapes, record);
    drawFigures("cooperative.py", {"track", o.csv, shapes, o.figure.path}, o.figure);
  }
  return record.good() ? kOk : kFailure;
}

void addTrackCommand(CLI::App& app, int& exit_code, bool assist) {
  auto options = std::make_shared<TrackCommand>();
  options->assist = assist;
  CLI::App* command = assist ? app.add_subcommand("target-assist", "move the target's tip with both arms along a path")
                             : app.add_subcommand("co-manipulate", "move the grasped object along a path");
  if (assist) {
    options->grasp.robot = "ablation-assist";
    options->hold = "places";
    command->add_option("-r,--robot", options->grasp.robot, "cooperative robot file or preset")->capture_default_str();
  } else {
    options->shape = "line";  // the one that the preset's rigid contacts leave
    options->size = 3e-3;
    addGraspOptions(*command, options->grasp);
  }
  command->add_option("--shape", options->shape, "line, circle or lissajous")
      ->check(CLI::IsMember({"line", "circle", "lissajous"}))
      ->capture_default_str();
  command->add_option("--along", options->along,
                      "directions of the path, separated by commas, from x,y,z,rx,ry,rz: one for a line, two otherwise "
                      "(default: the first in which the arms can move at the speed of the path)");
  command->add_option("--size", options->size, "amplitude, m; for rotations: arc length at the size of the object")
      ->check(CLI::Range(1e-6, 1.0))
      ->capture_default_str();
  command->add_option("--duration", options->duration, "duration of the motion, s")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  command
      ->add_option("--hold", options->hold,
                   "components held constant besides the directions: none, places (positions), or all")
      ->check(CLI::IsMember({"none", "places", "all"}))
      ->capture_default_str();
  command->add_option("--method", options->method, "redundancy resolution")
      ->check(CLI::IsMember(control::methodNames()))
      ->capture_default_str();
  command->add_option("--csv", options->csv, "CSV file, one row per control period, SI");
  addFigureOption(*command, options->figure, "arms, path, errors, forces");
  command->add_flag("--offline", options->offline, "run in one process, without DDS; the same results within rounding");
  command->add_option("--log", options->log, "log level of the services")->capture_default_str();
  command->add_flag("--json", options->json, "JSON instead of text");
  command->footer(
      "Runs simulator, control and planning as processes, over DDS in lock-step.\nExit code 1: the path is not "
      "feasible (the reason is printed), or errors exceed 1 mm or contact residuals 0.1 mm.\nDocumentation: "
      "docs/cooperative.md");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return runTrack(*options); }); });
}

}  // namespace

void registerTracks(CLI::App& app, int& exit_code) {
  addTrackCommand(app, exit_code, false);
  addTrackCommand(app, exit_code, true);
}

}  // namespace tandem::cli
