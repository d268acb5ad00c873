// SPDX-License-Identifier: Apache-2.0
/** @file tandem plan: inverse kinematics, checks and timing, in this process or in a running system. */
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>

#include "config/arm_names.h"
#include "control/method_names.h"
#include "services/cli/models/arm_options.h"
#include "services/cli/models/table.h"
#include "services/cli/plan/plan_print.h"
#include "services/cli/plan/plan_setup.h"
#include "services/computation/reports.h"
#include "services/runtime/process.h"

namespace tandem::cli {
namespace {

using Json = nlohmann::ordered_json;
using dds::ComputationKind;

bool isGood(const dds::ComputationResult& result) {
  return result.outcome == static_cast<std::uint8_t>(dds::Outcome::kGood);
}

/// The planned joints, the start first.
Eigen::MatrixXd pathOf(const PlanSetup& setup, const dds::ComputationResult& result) {
  Eigen::MatrixXd path(setup.model().jointCount(), static_cast<Eigen::Index>(result.report.points.size()) + 1);
  path.col(0) = Eigen::VectorXd::Map(result.start.data(), path.rows());
  for (std::size_t k = 0; k < result.report.points.size(); ++k)
    path.col(static_cast<Eigen::Index>(k) + 1) =
        Eigen::VectorXd::Map(result.report.points[k].joints.data(), path.rows());
  return path;
}

/// Freedom of the tasks along a checked trajectory; empty without further tasks: IK then says it all.
std::vector<planning::TaskFreedom> freedomOf(const PlanSetup& setup, const dds::ComputationResult& result) {
  const planning::TrajectorySpec& spec = setup.trajectory();
  if (spec.further.empty() || !result.report.start.empty())
    return {};
  return planning::taskFreedom({setup.model().models(), setup.model().limits()}, spec, pathOf(setup, result));
}

/// Deviation from the path of the leader, of an insertion or a task that follows one.
std::optional<LeaderPrediction> leaderOf(const PlanSetup& setup, const dds::ComputationResult& result) {
  const planning::TrajectorySpec& spec = setup.trajectory();
  const bool follows = std::holds_alternative<planning::Insertion>(spec.shape) ||
                       std::ranges::any_of(spec.further, &planning::FurtherTask::follows_leader);
  if (!follows || !result.report.start.empty())
    return {};
  const planning::Arms arms{setup.model().models(), setup.model().limits()};
  LeaderPrediction leader{planning::leaderDeviation(arms, spec.arm, pathOf(setup, result)), {}};
  const auto rows = static_cast<Eigen::Index>(setup.model().jointCount());
  const std::vector<double>& joints = result.with_posture.joints;
  if (result.rehearsed != 0 && !joints.empty())
    leader.rehearsed =
        planning::leaderDeviation(
            arms, spec.arm, Eigen::MatrixXd::Map(joints.data(), rows, static_cast<Eigen::Index>(joints.size()) / rows))
            .distance;
  return leader;
}

int checkPlan(const PlanOptions& options) {
  PlanSetup setup(options);
  const auto result = setup.compute(setup.request(ComputationKind::kCheck));
  const bool rehearsed = result.rehearsed != 0;
  const std::vector<std::string> arms = config::shortArmNames(setup.robot());
  const std::vector<planning::TaskFreedom> freedom = freedomOf(setup, result);
  const std::string lost = planning::lostTask(freedom, arms);
  const std::optional<LeaderPrediction> leader = leaderOf(setup, result);
  if (options.json) {
    Json json = reportJson(result.report);
    if (!freedom.empty())
      json["tasks"] = freedomJson(freedom, arms);
    json["lost_task"] = lost;
    if (leader)
      json["leader"] = leaderJson(*leader);
    json["rehearsal"] = rehearsed ? Json{{"method", setup.method()},
                                         {"with_posture", rehearsalJson(result.with_posture)},
                                         {"without_posture", rehearsalJson(result.without_posture)}}
                                  : Json();
    std::cout << json.dump(2) << '\n';
  } else {
    print(result.report, std::cout);
    if (!freedom.empty())
      print(freedom, arms, std::cout);
    if (leader)
      print(*leader, std::cout);
    if (!lost.empty())
      std::cout << "not feasible: " << lost << '\n';
    if (rehearsed) {
      print(result.with_posture, setup.method(), "with the planned posture", std::cout);
      print(result.without_posture, setup.method(), "without a posture", std::cout);
    }
  }
  return isGood(result) && lost.empty() ? kOk : kFailure;
}

int repair(const PlanOptions& options) {
  PlanSetup setup(options);
  const auto result = setup.compute(setup.request(ComputationKind::kRepair));
  const dds::RepairReport& repair = result.repair;
  const bool found = !repair.trajectory.empty();
  if (found) {
    std::ofstream out(options.output);
    out << "# SPDX-License-Identifier: Apache-2.0\n" << repair.trajectory;
    if (!out.flush())
      client::failToWrite(kUsage, options.output);
  }
  if (options.json) {
    std::cout << Json{{"before", reportJson(repair.before)},
                      {"after", reportJson(result.report)},
                      {"rounds", repair.rounds},
                      {"largest_change_m", repair.largest_change},
                      {"rms_change_m", repair.rms_change},
                      {"file", found ? Json(options.output) : Json()}}
                     .dump(2)
              << '\n';
  } else if (found) {
    std::printf("%d of %zu points were not reachable; moved by %.3g mm at most, %.3g mm rms, in %u rounds: %s\n",
                computation::unreachable(repair.before), repair.before.points.size(), 1e3 * repair.largest_change,
                1e3 * repair.rms_change, repair.rounds, options.output.c_str());
  } else {
    print(result.report, std::cout);
    std::cout << "no feasible trajectory was found; nothing was written\n";
  }
  return isGood(result) ? kOk : kFailure;
}

/// "a=x,y,z", "a=x,y,z,dx,dy,dz" or "a=x,y,z,qx,qy,qz,qw".
dds::TipTarget targetOf(const std::string& text, const config::Robot& robot) {
  const std::size_t sign = text.find('=');
  if (sign == std::string::npos)
    throw Failure(kUsage, "--tip: found '" + text + "', expected ARM=x,y,z, behind it dx,dy,dz or qx,qy,qz,qw");
  const std::string numbers = text.substr(sign + 1);
  const auto count = static_cast<int>(std::count(numbers.begin(), numbers.end(), ',')) + 1;
  if (count != 3 && count != 6 && count != 7)
    throw Failure(kUsage, fmt::format("--tip: found {} numbers in '{}', expected 3, 6 or 7", count, text));
  const Eigen::VectorXd values = numbersOf("--tip", numbers, count);
  dds::TipTarget target;
  target.arm = static_cast<std::uint8_t>(&armOf(robot, text.substr(0, sign)) - robot.arms.data());
  Eigen::Vector3d::Map(target.position.data()) = values.head<3>();
  target.has_direction = count == 6 ? 1 : 0;
  target.has_orientation = count == 7 ? 1 : 0;
  std::copy(values.begin() + 3, values.end(), count == 6 ? target.direction.data() : target.orientation.data());
  if (count == 6 && !(values.tail<3>().norm() > 0.0))
    throw Failure(kUsage, "--tip: found the direction [0, 0, 0], expected a vector other than zero");
  if (count == 7 && !(std::abs(values.tail<4>().norm() - 1.0) < 0.01))
    throw Failure(kUsage, fmt::format("--tip: found a quaternion qx,qy,qz,qw of length {:.3g}, expected 1",
                                      values.tail<4>().norm()));
  return target;
}

Json ikJson(const dds::IkReport& answer, const config::Robot& robot, bool reached, bool clearance) {
  Json json{{"reached", reached},
            {"reach", planning::name(static_cast<planning::Reach>(answer.reach))},
            {"reason", answer.reason},
            {"joints", answer.joints},
            {"tips_m", Json::array()},
            {"errors_m", answer.errors},
            {"angles_rad", answer.angles},
            {"limits", Json::array()},
            {"stability", answer.stability},
            {"clearance_m", clearance ? Json(answer.clearance) : Json()},
            {"starts", answer.starts},
            {"iterations", answer.iterations}};
  for (std::size_t k = 0; k + 2 < answer.tips.size(); k += 3)
    json["tips_m"].push_back({answer.tips[k], answer.tips[k + 1], answer.tips[k + 2]});
  for (const dds::LimitReport& limit : answer.limits)
    json["limits"].push_back({{"arm", robot.arms.at(limit.arm).name}, {"limit", limit.description}});
  return json;
}

int ik(const PlanOptions& options) {
  PlanSetup setup(options);
  auto request = setup.request(ComputationKind::kInverseKinematics);
  for (const std::string& tip : options.tips)
    request.targets.push_back(targetOf(tip, setup.robot()));
  const auto result = setup.compute(request);
  const dds::IkReport& answer = result.ik;
  const bool reached = isGood(result);
  if (options.json) {
    const bool clearance = !options.no_clearance && setup.robot().arms.size() > 1;
    std::cout << ikJson(answer, setup.robot(), reached, clearance).dump(2) << '\n';
    return reached ? kOk : kFailure;
  }
  std::cout << (reached ? "reached" : "not reached: " + answer.reason + "; the nearest found") << '\n';
  const robots::RobotModel& model = setup.model();
  for (int arm = 0; arm < model.armCount(); ++arm) {
    const double* own = answer.joints.data() + model.offset(arm);
    const int n = model.size(arm) / 2;
    std::printf("%s: beta_mm [", setup.robot().arms[static_cast<std::size_t>(arm)].name.c_str());
    for (int j = 0; j < n; ++j)
      std::printf("%s%.6f", j == 0 ? "" : ", ", 1e3 * own[j]);
    std::printf("], alpha_deg [");
    for (int j = n; j < 2 * n; ++j)
      std::printf("%s%.6f", j == n ? "" : ", ", own[j] * 180.0 / M_PI);
    std::printf("]\n");
  }
  return reached ? kOk : kFailure;
}

void writeTiming(const PlanOptions& options, const dds::ComputationResult& result) {
  std::ofstream out(options.csv);
  std::vector<std::string> names{"t"};
  append(names, numbered("q", static_cast<int>(result.start.size())));
  Table table(out, names, false);
  for (std::size_t k = 0; k < result.timing.times.size(); ++k) {
    std::vector<double> row{result.timing.times[k]};
    const std::vector<double>& q = k == 0 ? result.start : result.report.points.at(k - 1).joints;
    row.insert(row.end(), q.begin(), q.end());
    table.add(row, "ok");
  }
  if (!table.finish())
    client::failToWrite(kUsage, options.csv);
}

int time(const PlanOptions& options) {
  PlanSetup setup(options);
  const auto result = setup.compute(setup.request(ComputationKind::kTime));
  if (!isGood(result)) {
    print(result.report, std::cout);
    return kFailure;
  }
  if (!options.csv.empty())
    writeTiming(options, result);
  const double seconds = result.timing.times.empty() ? 0.0 : result.timing.times.back();
  if (options.json)
    std::cout << Json{{"seconds", seconds}, {"time_s", result.timing.times}, {"limiting_joint", result.timing.limiting}}
                     .dump(2)
              << '\n';
  else
    std::printf("%.3f s for %zu points\n", seconds, result.report.points.size());
  return kOk;
}

int start(const PlanOptions& options) {
  PlanSetup setup(options);
  const auto result = setup.compute(setup.request(ComputationKind::kChooseStart));
  Json json = Json::array();
  for (const dds::StartReport& candidate : result.starts) {
    json.push_back({{"joints", candidate.joints},
                    {"unreachable", candidate.unreachable},
                    {"room", candidate.room},
                    {"mean_room", candidate.mean_room},
                    {"given", candidate.given != 0}});
  }
  if (options.json) {
    std::cout << json.dump(2) << '\n';
    return isGood(result) ? kOk : kFailure;
  }
  std::printf("room      mean      unreachable  joints\n");
  for (const dds::StartReport& candidate : result.starts) {
    std::printf("%-9.4f %-9.4f %-12u ", candidate.room, candidate.mean_room, candidate.unreachable);
    for (std::size_t j = 0; j < candidate.joints.size(); ++j)
      std::printf("%s%.9g", j == 0 ? "" : ",", candidate.joints[j]);
    std::printf("%s\n", candidate.given != 0 ? "  (given)" : "");
  }
  return isGood(result) ? kOk : kFailure;
}

void common(CLI::App* app, const std::shared_ptr<PlanOptions>& o) {
  CLI::Option* live =
      app->add_option("-d,--deployment", o->deployment,
                      "compute in the planning service of this running deployment (file or preset), with its "
                      "robot, model and present joints");
  app->add_flag_callback(
         "--live",
         [o] {
           if (o->deployment.empty())
             o->deployment = runtime::defaultDeployment();
         },
         "same as --deployment laptop")
      ->excludes(live);
  CLI::Option* robot = app->add_option("-r,--robot", o->robot, "robot file or preset")->capture_default_str();
  CLI::Option* model = app->add_option("--model", o->model, "rigid or compliant")
                           ->check(CLI::IsMember({"rigid", "compliant"}))
                           ->capture_default_str();
  for (CLI::Option* own : {robot, model})
    own->excludes(live)->excludes("--live");
  app->add_option("--from", o->from,
                  "start: home, or EXPERIMENT:CONFIGURATION, e.g. table3:1 (default: home; with a running system its "
                  "present joints)");
  app->add_option("--joints", o->joints, "start: joints of all arms, m and rad, separated by commas");
  app->add_option("--stability", o->stability, "smallest stability of compliant arms, 0 to 1")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app->add_option("--clearance-mm", o->clearance_mm, "smallest distance between the arms' bodies")
      ->check(client::kNonNegative)
      ->capture_default_str();
  app->add_flag("--no-clearance", o->no_clearance, "ignore collisions between the arms");
  app->add_option("--port-radius-mm", o->port_radius_mm, "radius of the port's hole, about the robot's z axis")
      ->check(client::kPositive);
  app->add_option("--port-depth-mm", o->port_depth_mm, "distance of the port's rim in front of the entry plane")
      ->check(client::kNonNegative);
  app->add_option("--starts", o->starts, "number of random starts of a search")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app->add_option("--seed", o->seed, "seed of the random starts; the same seed gives the same result")
      ->capture_default_str();
  app->add_flag("--json", o->json, "JSON instead of text");
}

void trajectoryOf(CLI::App* app, const std::shared_ptr<PlanOptions>& o) {
  app->add_option("file", o->file, "trajectory file or preset")->required();
  common(app, o);
  app->add_option("--within-mm", o->within_mm, "position tolerance of a reached point, mm")
      ->check(client::kPositive)
      ->capture_default_str();
}

}  // namespace

void registerPlan(CLI::App& app, int& exit_code) {
  CLI::App* plan = app.add_subcommand("plan", "planning computations: check, repair, ik, time, start");
  plan->require_subcommand(1);
  plan->footer(
      "Needs no running system. With --deployment the planning service of the running system computes, from the "
      "present joints. Exit codes: 0 feasible, 1 not feasible, 2 bad input. Ctrl-C cancels.");
  const auto add = [&](const char* name, const char* text, int (*body)(const PlanOptions&), const char* footer = "") {
    auto options = std::make_shared<PlanOptions>();
    CLI::App* command = plan->add_subcommand(name, text);
    command->footer(footer);
    command->callback([options, body, &exit_code] { guarded(exit_code, [&] { return body(*options); }); });
    return std::pair{command, options};
  };
  {
    auto [command, o] = add("check", "list the unreachable points of a trajectory, with reasons", checkPlan);
    trajectoryOf(command, o);
    command
        ->add_option("--method", o->method,
                     "method of the rehearsal, simulated with ideal joints (default: nspqp; with a running system its "
                     "deployment's)")
        ->check(CLI::IsMember(control::methodNames()));
    command
        ->add_option(
            "--set", o->settings,
            "parameter of the rehearsal as NAME=VALUE, in SI units, e.g. tip_gain=5; repeatable. All others have "
            "the values of the files, also where a running system has set others (`tandem robot set`)")
        ->type_name("NAME=VALUE");
    command->add_flag("--no-rehearsal", o->no_rehearsal, "skip the rehearsal of the control method");
  }
  {
    auto [command, o] = add("repair", "the nearest feasible trajectory, as a file of waypoints", repair);
    trajectoryOf(command, o);
    command->add_option("-o,--output", o->output, "trajectory file to write")->required();
    command->add_option("--smoothing", o->smoothing, "smoothing of the corrections; 0: move only unreachable points")
        ->check(client::kNonNegative)
        ->capture_default_str();
  }
  {
    auto [command, o] = add(
        "ik",
        "inverse kinematics: the joints nearest to the start that reach the tip targets, or the nearest pose and the "
        "limiting constraints",
        ik, "An arm without a --tip stays near its start.");
    common(command, o);
    command
        ->add_option(
            "--tip", o->tips,
            "ARM=x,y,z in m, robot base frame; optionally ,dx,dy,dz: direction of the tool, or ,qx,qy,qz,qw: its "
            "orientation")
        ->required();
  }
  {
    auto [command, o] = add("time", "the fastest timing within the joint limits", time,
                            "Velocity limits are those of the robot file. Rotations without a velocity limit use "
                            "snsqp_rotation_velocity. Accelerations are the slew limits.");
    trajectoryOf(command, o);
    command
        ->add_option("--translation-acceleration-mm-per-s2", o->translation_acceleration,
                     "acceleration limit of translations instead of the robot file's")
        ->check(client::kPositive);
    command
        ->add_option("--rotation-velocity-rad-per-s", o->rotation_velocity,
                     "velocity limit of rotations instead of the robot file's")
        ->check(client::kPositive);
    command
        ->add_option("--rotation-acceleration-rad-per-s2", o->rotation_acceleration,
                     "acceleration limit of rotations instead of the robot file's")
        ->check(client::kPositive);
    command->add_option("--csv", o->csv, "CSV file, one row per point: t, joints, SI");
  }
  {
    auto [command, o] =
        add("start", "start configurations with the same tips, sorted by margin to the limits", start,
            "Room: smallest margin along the trajectory, to joint limits (per 100 mm, per 1 rad) and above the least "
            "stability.");
    trajectoryOf(command, o);
    command->add_option("--tries", o->tries, "number of random references to choose from")
        ->check(CLI::Range(1, 10000))
        ->capture_default_str();
  }
}

}  // namespace tandem::cli
