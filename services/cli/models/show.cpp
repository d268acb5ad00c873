// SPDX-License-Identifier: Apache-2.0
/** @file tandem show: what a file describes, in numbers and as a picture. */
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iostream>

#include "config/arm_names.h"
#include "config/path.h"
#include "config/robot_files.h"
#include "planning/insertion.h"
#include "robots/mechanisms.h"
#include "robots/overlap.h"
#include "robots/robot_model.h"
#include "robots/robot_type.h"
#include "services/cli/models/arm_options.h"
#include "services/cli/models/figure.h"
#include "services/cli/models/parallel.h"
#include "services/cli/models/reach.h"
#include "services/cli/subcommand.h"
#include "services/runtime/temporary_folder.h"

namespace tandem::cli {
namespace {

using Json = nlohmann::ordered_json;
using Places = std::vector<Eigen::Vector3d>;  ///< m, robot base frame

constexpr std::size_t kReachSamples = 1u << 14;
constexpr int kSlices = 32;  ///< of the solid that a tip reaches

struct ShowCommand {
  std::string file, robot, model = "rigid";
  FigureOptions figure;
  bool json = false;
};

Json placeJson(const Eigen::Vector3d& place) { return {place.x(), place.y(), place.z()}; }

Json placesJson(const Places& places) {
  Json json = Json::array();
  for (const Eigen::Vector3d& place : places)
    json.push_back(placeJson(place));
  return json;
}

/// Solid of revolution about the base's z axis that the tip of an arm with free rotations reaches; null otherwise.
Json reachJson(const config::Arm& arm, const kinematics::ArmModel& model) {
  if (!turnsFreely(arm.limits))
    return nullptr;
  const Eigen::MatrixXd joints = sampleJoints(arm.limits, kReachSamples, 1);
  std::vector<Eigen::Vector2d> tips(kReachSamples, Eigen::Vector2d::Constant(std::nan("")));  // radius, z
  const Eigen::Isometry3d to_arm = arm.model.base.inverse();
  parallelFor(kReachSamples, 0, arm.name, [&](std::size_t i) {
    kinematics::Tip tip;
    const auto status = model.tip(joints.col(static_cast<Eigen::Index>(i)), tip);
    if (statusOf(status, tip) != "ok")
      return;
    const Eigen::Vector3d place = to_arm * tip.pose.translation();
    tips[i] = {std::hypot(place.x(), place.y()), place.z()};
  });
  std::erase_if(tips, [](const Eigen::Vector2d& tip) { return !tip.allFinite(); });
  if (tips.empty())
    return nullptr;
  double low = INFINITY, high = -INFINITY, radius = 0.0;
  for (const Eigen::Vector2d& tip : tips) {
    low = std::min(low, tip.y());
    high = std::max(high, tip.y());
    radius = std::max(radius, tip.x());
  }
  std::vector<Eigen::Vector2d> slices(kSlices, {INFINITY, -INFINITY});  // least and largest radius
  for (const Eigen::Vector2d& tip : tips) {
    const auto at = static_cast<std::size_t>(kSlices * (tip.y() - low) / std::max(high - low, 1e-9));
    Eigen::Vector2d& slice = slices[std::min<std::size_t>(at, kSlices - 1)];
    slice = {std::min(slice[0], tip.x()), std::max(slice[1], tip.x())};
  }
  Json outline = Json::array();
  for (int k = 0; k < kSlices; ++k) {
    if (const Eigen::Vector2d& slice = slices[static_cast<std::size_t>(k)]; slice[1] >= 0.0)
      outline.push_back({low + (k + 0.5) * (high - low) / kSlices, slice[0], slice[1]});
  }
  return {{"radius_m", radius}, {"z_m", {low, high}}, {"outline_z_least_r_largest_r_m", outline}};
}

Json armJson(const config::Robot& robot, int k, const Places& shape) {
  const robots::ArmAppearance appearance = robots::typeOf(robot).appearance(robot, k);
  Json lengths = Json::array(), radii = Json::array();
  for (const robots::TubeAppearance& tube : appearance.tubes) {
    lengths.push_back(tube.length);
    radii.push_back(tube.outer_radius);
  }
  return {{"arm", robot.arms[static_cast<std::size_t>(k)].name},
          {"base", poseNumbers(appearance.base)},
          {"tube_lengths_m", lengths},
          {"tube_radii_m", radii},
          {"tip_m", placeJson(shape.back())},
          {"shape_m", placesJson(shape)}};
}

/** A robot at given joints. */
struct Shown {
  Json arms = Json::array(), clearance = Json::array();
  Places tips;
};

/// Arms whose tips are independent. @throw Failure for joints at which a model has no solution
Shown showTips(const config::Robot& robot, const std::string& model, const std::vector<Eigen::VectorXd>& joints) {
  const robots::RobotModel models(robot, model);
  Shown shown;
  const auto bodies = robots::bodiesAt(models, joints);
  for (std::size_t k = 0; k < bodies.size(); ++k) {
    const config::Arm& arm = robot.arms[k];
    const kinematics::ArmModel& own = *models.models()[k];
    kinematics::Tip tip;
    if (!bodies[k] || own.tip(joints[k], tip) != kinematics::ModelStatus::kOk)
      throw Failure(kFailure, robot.file.string() + ": " + arm.name + ": the " + model +
                                  " model has no solution at these joints; see tandem fk");
    Places shape;
    for (const kinematics::BackbonePoint& node : bodies[k]->nodes)
      shape.push_back(node.position);
    Json json = armJson(robot, static_cast<int>(k), shape);
    shown.tips.push_back(tip.pose.translation());
    json["tip_m"] = placeJson(shown.tips.back());
    json["piece_radii_m"] = bodies[k]->radius;
    json["reach"] = reachJson(arm, own);
    shown.arms.push_back(json);
  }
  for (const auto& [i, j, least] : robots::armDistances(bodies))
    shown.clearance.push_back({{"arm", robot.arms[i].name},
                               {"other", robot.arms[j].name},
                               {"distance_m", least.distance},
                               {"place_m", placeJson(least.place_a)},
                               {"other_place_m", placeJson(least.place_b)}});
  return shown;
}

std::vector<Eigen::VectorXd> homeOf(const config::Robot& robot) {
  std::vector<Eigen::VectorXd> home;
  for (const config::Arm& arm : robot.arms)
    home.push_back(arm.home);
  return home;
}

Shown showRobot(const config::Robot& robot, const std::string& model) {
  if (robots::has(robot, robots::Capability::kTips))
    return showTips(robot, model, homeOf(robot));
  const robots::EquilibriumFollower follower = robots::makeEquilibriumFollower(robot);
  Shown shown;
  int k = 0;
  for (const Places& shape : follower.mechanism().shapes()) {
    shown.arms.push_back(armJson(robot, k++, shape));
    shown.tips.push_back(shape.back());
  }
  return shown;
}

double lengthOf(const Places& path) {
  double length = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i)
    length += (path[i] - path[i - 1]).norm();
  return length;
}

/// Duration of a motion from standstill to standstill with trapezoidal speed, s.
double trapezoid(double length, double speed, double acceleration) {
  const double ramps = speed * speed / acceleration;  // m, both together
  return length > ramps ? length / speed + speed / acceleration : 2.0 * std::sqrt(length / acceleration);
}

Json pathJson(const std::string& name, const Places& path) {
  Eigen::Vector3d lower = path.front(), upper = path.front();
  for (const Eigen::Vector3d& place : path) {
    lower = lower.cwiseMin(place);
    upper = upper.cwiseMax(place);
  }
  return {{"name", name},
          {"length_m", lengthOf(path)},
          {"lower_m", placeJson(lower)},
          {"upper_m", placeJson(upper)},
          {"path_m", placesJson(path)}};
}

/// An insertion starts at joints, other shapes at the tip.
void setOwnPath(const robots::RobotModel& models,
                const std::vector<Eigen::VectorXd>& joints,
                planning::TrajectorySpec& spec) {
  planning::setInsertion({models.models(), models.limits()}, models.stack(joints), spec);
}

/// @param start  of the tip, m
Json trajectoryJson(const planning::TrajectorySpec& spec, const Eigen::Vector3d& start) {
  Places path{start};
  for (const planning::TrajectoryPoint& point : planning::sample(spec.ofPositions(), {start, Eigen::Vector3d::Zero()}))
    path.push_back(point.tip);
  Json json = pathJson(spec.name, path);
  if (spec.following == planning::Following::kTimed)
    json["duration_s"] = trapezoid(lengthOf(path), spec.speed, spec.acceleration);
  else
    json["most_iterations_per_point"] = spec.max_iterations;
  return json;
}

/// Path of the common object, from its start.
Json objectPathJson(const planning::ObjectPath& spec) {
  constexpr int kPoints = 200;
  Places path;
  for (int i = 0; i <= kPoints; ++i) {
    planning::Twist displacement, rate;
    spec.at(spec.duration * i / kPoints, displacement, rate);
    path.emplace_back(displacement.head<3>());
  }
  Json json = pathJson(spec.name, path);
  json["duration_s"] = spec.duration;
  return json;
}

void addRobot(Json& facts, const config::Robot& robot, const Shown& shown) {
  facts["robot"] = robot.name;
  facts["arms"] = shown.arms;
  facts["clearance"] = shown.clearance;
}

/// A trajectory alone, from its start; or from the home of a robot.
void addTrajectory(Json& facts, const ShowCommand& options, const std::filesystem::path& file) {
  planning::TrajectorySpec spec = config::loadTrajectory(file);
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  if (!options.robot.empty()) {
    const config::Robot robot = config::loadAnyRobot(config::findFile(options.robot, config::robotKinds()));
    if (const std::string why = robots::refusal(robot, robots::Capability::kTips); !why.empty())
      throw Failure(kUsage, robot.file.string() + ": " + why);
    if (const std::string wrong = config::findArms(spec, robot); !wrong.empty())
      throw Failure(kUsage, file.string() + ": " + wrong + " (robot " + robot.name + ")");
    const Shown shown = showRobot(robot, options.model);
    addRobot(facts, robot, shown);
    setOwnPath(robots::RobotModel(robot, options.model), homeOf(robot), spec);
    start = shown.tips[static_cast<std::size_t>(spec.arm)];
  } else if (std::holds_alternative<planning::Insertion>(spec.shape)) {
    throw Failure(kUsage, file.string() +
                              ": shape: found an insertion, whose path follows from the joints of an arm, "
                              "expected --robot NAME, too");
  }
  facts["paths"] = {trajectoryJson(spec, start)};
}

/// The robot at the first start configuration, and each trajectory from the first of its own.
void addExperiment(Json& facts, const ShowCommand& options, const std::filesystem::path& file) {
  const config::Experiment experiment = config::loadExperiment(file);
  const config::Robot robot = config::loadAnyRobot(experiment.robot);
  const robots::RobotModel models(robot, options.model);
  addRobot(facts, robot, showTips(robot, options.model, experiment.configurations.front().joints));
  facts["configuration"] = experiment.configurations.front().name;
  facts["paths"] = Json::array();
  for (const config::ExperimentTrajectory& trajectory : experiment.trajectories) {
    for (const config::Configuration& configuration : experiment.configurations) {
      if (trajectory.configurations.front() != configuration.name)
        continue;
      const auto arm = static_cast<std::size_t>(trajectory.spec.arm);
      kinematics::Tip tip;
      if (models.models()[arm]->tip(configuration.joints[arm], tip) != kinematics::ModelStatus::kOk)
        continue;
      planning::TrajectorySpec spec = trajectory.spec;
      setOwnPath(models, configuration.joints, spec);
      facts["paths"].push_back(trajectoryJson(spec, tip.pose.translation()));
    }
  }
}

Json factsOf(const ShowCommand& options, const std::filesystem::path& file) {
  const std::string kind = config::kindOf(file);
  Json facts{{"file", file.string()}, {"kind", kind}};
  if (kind == "deployment") {
    const config::Deployment deployment = config::loadDeployment(file);
    const config::Robot robot = config::loadAnyRobot(deployment);
    addRobot(facts, robot, showRobot(robot, deployment.model));
  } else if (kind == "trajectory") {
    addTrajectory(facts, options, file);
  } else if (kind == "path") {
    facts["paths"] = {objectPathJson(config::loadPath(file))};
  } else if (kind == "experiment") {
    addExperiment(facts, options, file);
  } else if (kind == "hardware" || kind == "drive") {
    throw Failure(kUsage, file.string() + ": drives have no picture; what they are: tandem validate " + file.string());
  } else {
    const config::Robot robot = config::loadAnyRobot(file);
    addRobot(facts, robot, showRobot(robot, options.model));
  }
  return facts;
}

double mm(const Json& metres) { return 1e3 * metres.get<double>(); }

std::string millimetres(const Json& place) {
  return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", mm(place[0]), mm(place[1]), mm(place[2]));
}

void printArm(const Json& arm) {
  std::string lengths;
  for (const Json& length : arm["tube_lengths_m"])
    lengths += fmt::format("{}{:.1f}", lengths.empty() ? "" : ", ", mm(length));
  fmt::print("  {}: length {} mm, tip at {}\n", arm["arm"].get<std::string>(), lengths, millimetres(arm["tip_m"]));
  if (arm.contains("reach") && !arm["reach"].is_null()) {
    const Json& reach = arm["reach"];
    fmt::print("    reach: {:.1f} mm around its axis, {:.1f} to {:.1f} mm in front of its base\n",
               mm(reach["radius_m"]), mm(reach["z_m"][0]), mm(reach["z_m"][1]));
  }
}

void printFacts(const Json& facts) {
  fmt::print("{}: {}\n", facts["file"].get<std::string>(), facts["kind"].get<std::string>());
  if (facts.contains("arms"))
    fmt::print(
        "{}, {}\n", facts["robot"].get<std::string>(),
        facts.contains("configuration") ? "configuration " + facts["configuration"].get<std::string>() : "at home");
  for (const Json& arm : facts.value("arms", Json::array()))
    printArm(arm);
  for (const Json& pair : facts.value("clearance", Json::array())) {
    const double distance = mm(pair["distance_m"]);
    fmt::print("  {} to {}: {}\n", pair["arm"].get<std::string>(), pair["other"].get<std::string>(),
               distance < 0.0 ? fmt::format("they overlap by {:.3g} mm at {}", -distance, millimetres(pair["place_m"]))
                              : fmt::format("{:.2f} mm apart", distance));
  }
  const bool is_placed = facts.contains("arms");
  for (const Json& path : facts.value("paths", Json::array())) {
    fmt::print("  path {}: {:.1f} mm long, {}\n    within {} to {}{}\n", path["name"].get<std::string>(),
               mm(path["length_m"]),
               path.contains("duration_s")
                   ? fmt::format("{:.1f} s", path["duration_s"].get<double>())
                   : fmt::format("at most {} iterations per point", path["most_iterations_per_point"].get<int>()),
               millimetres(path["lower_m"]), millimetres(path["upper_m"]), is_placed ? "" : ", from its start");
  }
}

int runShow(const ShowCommand& options) {
  const Json facts = factsOf(options, config::findFile(options.file, ""));
  if (options.figure.wanted()) {
    const runtime::TemporaryFolder folder;
    const std::filesystem::path file = folder.path() / "facts.json";
    std::ofstream(file) << facts.dump();
    drawFigures("mechanics.py", {"show", file.string(), options.figure.path}, options.figure);
  }
  if (options.json)
    std::cout << facts.dump(2) << '\n';
  else
    printFacts(facts);
  return kOk;
}

}  // namespace

void registerShow(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ShowCommand>();
  CLI::App* command = app.add_subcommand("show", "what a file describes: arms at home, reach, distances, paths");
  command
      ->add_option("file", options->file,
                   "file or preset: robot, deployment, trajectory, path of catheters, experiment")
      ->required();
  command->add_option("-r,--robot", options->robot,
                      "robot from whose home a trajectory starts (default: the trajectory alone)");
  command->add_option("-m,--model", options->model, "model of tubes; of a deployment its own")
      ->check(CLI::IsMember({"rigid", "compliant"}))
      ->capture_default_str();
  addFigureOption(*command, options->figure, "picture of the same from the front and from the side");
  command->add_flag("--json", options->json, "JSON instead of text, SI");
  command->footer(
      "The reach is that of arms whose rotations are free, sampled; volumes: tandem workspace. Feasibility of a "
      "trajectory: tandem plan check.");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return runShow(*options); }); });
}

}  // namespace tandem::cli
