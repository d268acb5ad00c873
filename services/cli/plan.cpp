// SPDX-License-Identifier: Apache-2.0
/** @file tandem plan: what can be had, before anything moves. */
#include <cmath>
#include <fstream>
#include <iostream>

#include "planning/start_choice.h"
#include "planning/timing.h"
#include "services/cli/arm_options.h"
#include "services/cli/plan_report.h"
#include "services/cli/plan_setup.h"
#include "services/cli/table.h"

namespace tandem::cli {
namespace {

using Json = nlohmann::ordered_json;

[[noreturn]] void interrupted() { throw Failure(kFailure, "cancelled"); }

int check(const PlanOptions& options) {
  const PlanSetup setup(options);
  const auto report =
      planning::checkTrajectory(setup.arms(), setup.trajectory(), setup.start(), setup.feasibility("point"));
  if (report.cancelled)
    interrupted();
  planning::Rehearsal with, without;
  const bool rehearsed = !options.no_rehearsal && report.start.empty();
  if (rehearsed) {
    const auto rehearse = [&](const std::vector<safety::RobotVector>& postures, const char* label) {
      auto run = planning::rehearse(setup.arms(), setup.trajectory(), setup.start(), postures, setup.rehearsal(label));
      if (run.end == planning::RehearsalEnd::kCancelled)
        interrupted();
      return run;
    };
    with = rehearse(report.path(), "rehearsal");
    without = rehearse({}, "rehearsal without posture");
  }
  if (options.json) {
    Json json = reportJson(report);
    json["rehearsal"] = rehearsed ? Json{{"method", options.method},
                                         {"with_posture", rehearsalJson(with)},
                                         {"without_posture", rehearsalJson(without)}}
                                  : Json();
    std::cout << json.dump(2) << '\n';
  } else {
    print(report);
    if (rehearsed) {
      std::fflush(stdout);
      print(with, options.method, "with the planned posture");
      print(without, options.method, "without a posture");
    }
  }
  const bool completes = !rehearsed || with.end == planning::RehearsalEnd::kCompleted;
  return report.feasible && completes ? kOk : kFailure;
}

int repair(const PlanOptions& options) {
  const PlanSetup setup(options);
  const auto result = planning::repairTrajectory(setup.arms(), setup.trajectory(), setup.start(),
                                                 setup.feasibility("point"), options.smoothing);
  if (result.after.cancelled)
    interrupted();
  if (result.after.feasible) {
    std::ofstream out(options.output);
    out << "# SPDX-License-Identifier: Apache-2.0\n" << config::formatTrajectory(result.spec);
    if (!out.flush())
      throw Failure(kUsage, options.output + ": cannot be written");
  }
  if (options.json) {
    std::cout << Json{{"before", reportJson(result.before)},
                      {"after", reportJson(result.after)},
                      {"rounds", result.rounds},
                      {"largest_change_m", result.largest_change},
                      {"rms_change_m", result.rms_change},
                      {"file", result.after.feasible ? Json(options.output) : Json()}}
                     .dump(2)
              << '\n';
  } else if (result.after.feasible) {
    std::printf("%d of %zu points could not be had; moved by %.3g mm at most, %.3g mm rms, in %d rounds: %s\n",
                result.before.unreachable(), result.before.points.size(), 1e3 * result.largest_change,
                1e3 * result.rms_change, result.rounds, options.output.c_str());
  } else {
    print(result.after);
    std::cout << "no feasible trajectory was found; nothing is written\n";
  }
  return result.after.feasible ? kOk : kFailure;
}

/// "a=x,y,z" or "a=x,y,z,dx,dy,dz".
planning::TipTarget targetOf(const std::string& text, const config::Robot& robot) {
  const std::size_t sign = text.find('=');
  if (sign == std::string::npos)
    throw Failure(kUsage, "--tip: found '" + text + "', expected ARM=x,y,z or ARM=x,y,z,dx,dy,dz");
  const std::string numbers = text.substr(sign + 1);
  const auto commas = std::count(numbers.begin(), numbers.end(), ',');
  const Eigen::VectorXd values = numbersOf("--tip", numbers, commas > 2 ? 6 : 3);
  planning::TipTarget target;
  target.arm = static_cast<int>(&armOf(robot, text.substr(0, sign)) - robot.arms.data());
  target.position = values.head<3>();
  if (values.size() == 6) {
    const Eigen::Vector3d direction = values.tail<3>();
    if (!(direction.norm() > 0.0))
      throw Failure(kUsage, "--tip: found the direction [0, 0, 0], expected a vector with a length");
    target.direction = direction.normalized();
  }
  return target;
}

int ik(const PlanOptions& options) {
  const PlanSetup setup(options);
  std::vector<planning::TipTarget> targets;
  for (const std::string& tip : options.tips)
    targets.push_back(targetOf(tip, setup.robot()));
  const planning::InverseKinematics inverse(setup.arms(), setup.ik());
  const planning::IkAnswer answer = inverse.solve(targets, setup.start());
  if (answer.reach == planning::Reach::kCancelled)
    interrupted();
  const bool reached = answer.reach == planning::Reach::kReached;
  Json json{{"reached", reached},
            {"reason", planning::name(answer.reach)},
            {"words", answer.words},
            {"joints", listOf(answer.q)},
            {"tips_m", Json::array()},
            {"errors_m", answer.error},
            {"limits", Json::array()},
            {"stability", answer.stability},
            {"clearance_m", setup.ik().demands.clearance ? Json(answer.clearance) : Json()},
            {"starts", answer.starts},
            {"iterations", answer.iterations}};
  for (const Eigen::Vector3d& tip : answer.tips)
    json["tips_m"].push_back(listOf(tip));
  for (const planning::ActiveLimit& limit : answer.limits)
    json["limits"].push_back(
        {{"arm", setup.robot().arms[static_cast<std::size_t>(limit.arm)].name}, {"limit", limit.words}});
  if (options.json) {
    std::cout << json.dump(2) << '\n';
    return reached ? kOk : kFailure;
  }
  std::cout << (reached ? "reached" : "not reached: " + answer.words + "; the nearest found") << '\n';
  for (int arm = 0; arm < setup.arms().count(); ++arm) {
    const auto own = answer.q.segment(setup.arms().offset(arm), setup.arms().size(arm));
    const auto n = own.size() / 2;
    std::printf("%s: beta_mm [", setup.robot().arms[static_cast<std::size_t>(arm)].name.c_str());
    for (Eigen::Index j = 0; j < n; ++j)
      std::printf("%s%.6f", j == 0 ? "" : ", ", 1e3 * own[j]);
    std::printf("], alpha_deg [");
    for (Eigen::Index j = n; j < 2 * n; ++j)
      std::printf("%s%.6f", j == n ? "" : ", ", own[j] * 180.0 / M_PI);
    std::printf("]\n");
  }
  return reached ? kOk : kFailure;
}

double chosen(double wanted, double by_robot, double otherwise) {
  return wanted > 0.0 ? wanted : std::isfinite(by_robot) ? by_robot : otherwise;
}

int time(const PlanOptions& options) {
  const PlanSetup setup(options);
  const auto report =
      planning::checkTrajectory(setup.arms(), setup.trajectory(), setup.start(), setup.feasibility("point"));
  if (report.cancelled)
    interrupted();
  if (!report.feasible) {
    print(report);
    return kFailure;
  }
  planning::TimingProblem problem;
  const int joints = setup.arms().jointCount();
  problem.path.resize(joints, static_cast<Eigen::Index>(report.points.size()) + 1);
  problem.path.col(0) = setup.start();
  for (std::size_t k = 0; k < report.points.size(); ++k)
    problem.path.col(static_cast<Eigen::Index>(k) + 1) = report.points[k].q;
  problem.velocity.resize(joints);
  problem.acceleration.resize(joints);
  for (int arm = 0, j = 0; arm < setup.arms().count(); ++arm) {
    const auto& limits = setup.robot().arms[static_cast<std::size_t>(arm)].limits;
    for (int k = 0; k < limits.jointCount(); ++k, ++j) {
      const safety::JointLimit& limit = limits.joints[static_cast<std::size_t>(k)];
      const bool translation = k < limits.jointCount() / 2;
      problem.velocity[j] = chosen(translation ? 0.0 : options.rotation_velocity, limit.velocity,
                                   setup.robot().parameters.snsqp_rotation_velocity);
      problem.acceleration[j] =
          chosen(translation ? 1e-3 * options.translation_acceleration : options.rotation_acceleration,
                 limit.slew_limit, safety::kUnlimited);
    }
  }
  const planning::Timing timing = planning::timeOptimal(problem, [&] { return setup.cancelled(); });
  if (timing.status == planning::TimingStatus::kCancelled)
    interrupted();
  if (timing.status != planning::TimingStatus::kOptimal)
    throw Failure(kFailure, timing.status == planning::TimingStatus::kUnlimited
                                ? "a piece of the path moves only joints without a velocity limit"
                                : "no optimal timing was found within the limit of the iterations");
  if (!options.csv.empty()) {
    std::ofstream out(options.csv);
    std::vector<std::string> names{"t"};
    append(names, numbered("q", joints));
    Table table(out, names, false);
    for (std::size_t k = 0; k < timing.time.size(); ++k) {
      std::vector<double> row{timing.time[k]};
      const Eigen::VectorXd q = problem.path.col(static_cast<Eigen::Index>(k));
      row.insert(row.end(), q.begin(), q.end());
      table.add(row, "ok");
    }
    if (!table.finish())
      throw Failure(kUsage, options.csv + ": cannot be written");
  }
  if (options.json)
    std::cout << Json{{"seconds", timing.total()}, {"time_s", timing.time}, {"limiting_joint", timing.limiting}}.dump(2)
              << '\n';
  else
    std::printf("%.3f s for %zu points\n", timing.total(), report.points.size());
  return kOk;
}

int start(const PlanOptions& options) {
  const PlanSetup setup(options);
  planning::StartOptions choice_options;
  choice_options.feasibility = setup.feasibility("");
  choice_options.tries = options.tries;
  PlanProgress progress("start");
  choice_options.progress = [&](int done, int all) { progress.show(done, all); };
  const auto choice = planning::chooseStart(setup.arms(), setup.trajectory(), setup.start(), choice_options);
  if (choice.cancelled)
    interrupted();
  if (choice.candidates.empty())
    throw Failure(kFailure, "no start has these tips within the limits and demands");
  const bool good = choice.candidates.front().unreachable == 0;
  Json json = Json::array();
  for (const planning::StartCandidate& candidate : choice.candidates) {
    json.push_back({{"joints", listOf(candidate.q)},
                    {"unreachable", candidate.unreachable},
                    {"room", candidate.room},
                    {"mean_room", candidate.mean_room},
                    {"given", candidate.q == setup.start()}});
  }
  if (options.json) {
    std::cout << json.dump(2) << '\n';
    return good ? kOk : kFailure;
  }
  std::printf("room      mean      unreachable  joints\n");
  for (const planning::StartCandidate& candidate : choice.candidates) {
    std::printf("%-9.4f %-9.4f %-12d ", candidate.room, candidate.mean_room, candidate.unreachable);
    for (Eigen::Index j = 0; j < candidate.q.size(); ++j)
      std::printf("%s%.9g", j == 0 ? "" : ",", candidate.q[j]);
    std::printf("%s\n", candidate.q == setup.start() ? "  (given)" : "");
  }
  return good ? kOk : kFailure;
}

void common(CLI::App* app, const std::shared_ptr<PlanOptions>& o) {
  app->add_option("-r,--robot", o->robot, "robot file or preset")->capture_default_str();
  app->add_option("--model", o->model, "rigid or compliant")
      ->check(CLI::IsMember({"rigid", "compliant"}))
      ->capture_default_str();
  app->add_option("--from", o->from, "start: home, or EXPERIMENT:CONFIGURATION, e.g. table3:1")->capture_default_str();
  app->add_option("--joints", o->joints, "start: joints of all arms, m and rad, separated by commas");
  app->add_option("--stability", o->stability, "smallest stability of compliant arms, 0 to 1")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app->add_option("--clearance-mm", o->clearance_mm, "smallest distance between the arms' bodies")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app->add_flag("--no-clearance", o->no_clearance, "arms may touch");
  app->add_option("--port-radius-mm", o->port_radius_mm, "radius of the port's hole, about the robot's z axis")
      ->check(CLI::PositiveNumber);
  app->add_option("--port-depth-mm", o->port_depth_mm, "how far the port's rim stands in front of the entry plane")
      ->check(CLI::NonNegativeNumber);
  app->add_option("--starts", o->starts, "random starts of a search")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app->add_option("--seed", o->seed, "of the random starts: the same seed gives the same answer")
      ->capture_default_str();
  app->add_flag("--json", o->json, "JSON instead of text");
}

void trajectoryOf(CLI::App* app, const std::shared_ptr<PlanOptions>& o) {
  app->add_option("file", o->file, "trajectory file or preset")->required();
  common(app, o);
  app->add_option("--within-mm", o->within_mm, "a point nearer than this counts as reached")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}

}  // namespace

void registerPlan(CLI::App& app, int& exit_code) {
  CLI::App* plan = app.add_subcommand("plan", "what a robot can do, before it moves: check, repair, ik, time, start");
  plan->require_subcommand(1);
  plan->footer(
      "Nothing of this needs a running system. Ends with 0: feasible, 1: not, 2: bad input. Ctrl-C cancels.\n"
      "  tandem plan check circle                      can it be run from the home position, and if not, why\n"
      "  tandem plan repair far.yaml -o near.yaml      the nearest trajectory that can be run\n"
      "  tandem plan ik --tip a=0.02,0.01,0.3          joints for a tip position\n"
      "  tandem plan time circle                       how fast the joints' limits allow it\n"
      "  tandem plan start circle                      the start with the most room around it");
  const auto add = [&](const char* name, const char* text, int (*body)(const PlanOptions&), const char* footer) {
    auto options = std::make_shared<PlanOptions>();
    CLI::App* command = plan->add_subcommand(name, text);
    command->footer(footer);
    command->callback([options, body, &exit_code] { guarded(exit_code, [&] { return body(*options); }); });
    return std::pair{command, options};
  };
  {
    auto [command, o] = add("check", "which points of a trajectory cannot be had, and why", check,
                            "Example: tandem plan check lissajous --from table3:2 --model compliant --json");
    trajectoryOf(command, o);
    std::vector<std::string> methods;
    for (int m = 0; m < control::kMethodCount; ++m)
      methods.emplace_back(control::name(static_cast<control::Method>(m)));
    command->add_option("--method", o->method, "method that the rehearsal runs with, with ideal joints")
        ->check(CLI::IsMember(methods))
        ->capture_default_str();
    command->add_flag("--no-rehearsal", o->no_rehearsal, "only what the robot can do, not whether a method gets there");
  }
  {
    auto [command, o] = add("repair", "the nearest trajectory that can be run, as a file of waypoints", repair,
                            "Example: tandem plan repair far.yaml -o near.yaml");
    trajectoryOf(command, o);
    command->add_option("-o,--output", o->output, "trajectory file to write")->required();
    command->add_option("--smoothing", o->smoothing, "how smooth corrections are, 0: only what must be moved is")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
  }
  {
    auto [command, o] =
        add("ik", "joints for tips, nearest to the start's, or the nearest pose and what is in the way", ik,
            "Example: tandem plan ik --tip a=0.02,0.01,0.3 --tip b=0.02,-0.01,0.3,0,0,1\n"
            "An arm without a --tip stays near its start.");
    common(command, o);
    command->add_option("--tip", o->tips, "ARM=x,y,z in m, robot base frame; ,dx,dy,dz: where the tool points")
        ->required();
  }
  {
    auto [command, o] = add("time", "the fastest timing under the joints' limits", time,
                            "Velocities are those of the robot file; rotations without any take the "
                            "snsqp_rotation_velocity. Accelerations are the slew limits.");
    trajectoryOf(command, o);
    command->add_option("--translation-acceleration-mm-per-s2", o->translation_acceleration, "instead of the file's")
        ->check(CLI::PositiveNumber);
    command->add_option("--rotation-velocity-rad-per-s", o->rotation_velocity, "instead of the file's")
        ->check(CLI::PositiveNumber);
    command->add_option("--rotation-acceleration-rad-per-s2", o->rotation_acceleration, "instead of the file's")
        ->check(CLI::PositiveNumber);
    command->add_option("--csv", o->csv, "file for a row a point: t, joints, SI");
  }
  {
    auto [command, o] = add("start", "starts with the same tips, the one with the most room first", start,
                            "Room is the smallest distance to limits (per 100 mm and 1 rad) and stability on the way.");
    trajectoryOf(command, o);
    command->add_option("--tries", o->tries, "random references")->check(CLI::Range(1, 10000))->capture_default_str();
  }
}

}  // namespace tandem::cli
