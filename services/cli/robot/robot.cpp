// SPDX-License-Identifier: Apache-2.0
/** @file tandem robot: commands to a running system, under the control lease. */
#include <poll.h>
#include <unistd.h>

#include <iostream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "config/arm_names.h"
#include "config/robot_files.h"
#include "control/method_names.h"
#include "robots/capability.h"
#include "services/cli/legend.h"
#include "services/cli/plan/plan_print.h"
#include "services/cli/plan/plan_setup.h"
#include "services/cli/subcommand.h"
#include "services/client/diagnostic_details.h"
#include "services/client/motions.h"
#include "services/client/run_summary.h"
#include "services/runtime/diagnostics.h"
#include "services/runtime/process.h"
#include "services/runtime/stop_signal.h"

namespace tandem::cli {
namespace {

struct RobotCommand {
  std::string deployment = runtime::defaultDeployment(), trajectory, arm, method, name, value;
  std::vector<double> joints;
  std::vector<std::string> without;
  double wait = 10.0;  // s
  bool json = false, keep_enabled = false, check = false, planned = false;
};

/// A running system, with its lease if requested.
struct Session {
  Session(const RobotCommand& options, bool lease)
      : deployment(runtime::loadDeployment(options.deployment)),
        robot(config::loadAnyRobot(deployment)),
        client(deployment),
        motions(client, deployment, robot, [this](bool uninterruptible) { uninterruptible_ = uninterruptible; }) {
    client.setInterrupt([this] { return stop.requested() && !uninterruptible_; });
    client.connect(options.wait);
    client.setSilenceLimit(2.0 + 3.0 * deployment.control_period);
    if (lease)
      client.acquireLease();
  }
  runtime::StopSignal stop;
  config::Deployment deployment;
  config::Robot robot;
  client::Client client;
  client::Motions motions;

 private:
  bool uninterruptible_ = false;
};

int done(const RobotCommand& options,
         const std::string& text,
         nlohmann::ordered_json json = nlohmann::ordered_json::object()) {
  if (options.json) {
    json["text"] = text;
    std::cout << json.dump() << '\n';
  } else {
    std::cout << text << '\n';
  }
  return kOk;
}

int stateCommand(const RobotCommand& options, const std::string& command) {
  const bool gives_power = command == "enable" || command == "resume";
  Session session(options, gives_power);
  if (command == "disable")
    session.motions.disable();
  else
    session.client.stateCommand(command);
  if (gives_power)
    session.client.releaseLease();
  return done(options, "all arms: " + command + "d");
}

int stop(const RobotCommand& options) {
  // Not a Session: a stop does not wait for other processes, since a silent one may be its reason.
  client::Client client(runtime::loadDeployment(options.deployment), {}, client::Client::Receives::kAnyRobot);
  client::stopAndWait(client, "tandem robot stop");
  return done(options, "stopped; `tandem robot disable` clears the fault");
}

int moveJp(const RobotCommand& options) {
  Session session(options, true);
  const auto arm = config::findArm(session.robot, options.arm);
  if (!arm)
    throw Failure(kUsage, "--arm: found '" + options.arm + "', expected one of: " + config::armNames(session.robot));
  if (options.joints.size() > safety::kMaxJointsPerArm)
    throw Failure(kUsage, "joints: found " + std::to_string(options.joints.size()) + ", expected " +
                              std::to_string(session.robot.arms[*arm].limits.jointCount()) + " for " +
                              session.robot.arms[*arm].name);
  session.motions.moveJp(*arm, Eigen::VectorXd::Map(options.joints.data(), std::ssize(options.joints)));
  session.client.releaseLease();
  return done(options, "the arm is at its goal");
}

int recover(const RobotCommand& options) {
  Session session(options, true);
  const std::uint8_t arm = client::armIndex(session.robot, options.arm);
  const config::Arm& of = session.robot.arms[arm];
  dds::ControlRequest request;
  request.kind = static_cast<std::uint8_t>(dds::ControlKind::kStateCommand);
  request.value = "recover";
  request.arm = arm;
  request.joint_count = static_cast<std::uint8_t>(of.limits.jointCount());
  for (const std::string& name : options.without)
    request.joints[static_cast<std::size_t>(client::jointIndex(of, name))] = 1.0;
  session.motions.recover(request);
  session.client.releaseLease();
  const std::string lost = client::jointNamesOf(of, session.client.snapshot().state.lost[arm]);
  return done(options,
              of.name + (lost.empty() ? ": recovered with all joints" : ": recovered without " + lost) +
                  ". Move slowly inwards with `tandem jog` or `tandem robot withdraw`, then `tandem robot disable`",
              {{"without", lost}});
}

int withdraw(const RobotCommand& options) {
  Session session(options, true);
  const std::uint8_t arm = client::armIndex(session.robot, options.arm);
  const config::Arm& of = session.robot.arms[arm];
  const auto reported = [&](const client::Snapshot& s) {
    std::string text;
    for (int j = 0; j < of.limits.jointCount(); ++j) {
      if (!of.limits.isTranslation(j))
        continue;
      char place[40];
      std::snprintf(place, sizeof place, "%s%s %.1f mm", text.empty() ? "" : ", ",
                    of.joint_names[static_cast<std::size_t>(j)].c_str(),
                    1e3 * s.state.position[dds::jointIndex(arm, j)]);
      text += place;
    }
    return text;
  };
  session.motions.withdraw(arm, [&](const client::Snapshot& s) {
    if (isatty(STDERR_FILENO) != 0 && !options.json)
      std::fprintf(stderr, "\r%s   ", reported(s).c_str());
  });
  session.client.releaseLease();
  return done(options, of.name + ": nothing more can be retracted; " + reported(session.client.snapshot()));
}

int home(const RobotCommand& options) {
  Session session(options, true);
  session.motions.home();
  session.client.releaseLease();
  return done(options, "the arms are at home");
}

int setMethod(const RobotCommand& options) {
  Session session(options, true);
  dds::ControlRequest request;
  const bool parameter = !options.value.empty();
  request.kind = static_cast<std::uint8_t>(parameter ? dds::ControlKind::kSetParameter : dds::ControlKind::kSetMethod);
  request.text = options.name;
  request.value = options.value;
  session.client.control(request);
  session.client.releaseLease();
  return done(options, options.name + (parameter ? " = " + options.value : ""));
}

/// Parameters of the method that control has now. What this client receives was published after its start.
std::vector<dds::ParameterSetting> settingsOf(const client::Client& client) {
  constexpr double kThere = 5.0;  // s: diagnostics come once a second
  if (!client.waitFor(kThere, [](const client::Snapshot& s) { return s.diagnostics.contains(runtime::kControl); }))
    throw Failure(kFailure,
                  fmt::format("control has not published its parameters for {} s; see `tandem status`", kThere));
  const auto details = client::diagnosticDetails(client.snapshot(), runtime::kParameterKey);
  std::vector<dds::ParameterSetting> settings;
  if (const auto values = details.find(runtime::kControl); values != details.end()) {
    for (const auto& [name, value] : values->items())
      settings.push_back({name, value.get<std::string>()});
  }
  return settings;
}

/// Requests a check by planning from the present joint positions, under the lease, so that no other client moves the
/// robot meanwhile.
/// @throw Failure if the trajectory is infeasible
void checkFirst(Session& session, const std::string& text, std::string method, bool planned) {
  dds::ComputationRequest request;
  request.kind = static_cast<std::uint8_t>(dds::ComputationKind::kCheck);
  request.trajectory = text;
  request.stability = PlanOptions{}.stability;
  if (method.empty())
    method = control::name(static_cast<control::Method>(session.client.snapshot().status.method));
  request.rehearse = method;
  request.parameters = settingsOf(session.client);
  const auto result = computeLive(session.deployment, request, [&session] { return session.stop.requested(); });
  const dds::RehearsalReport& run = planned ? result.with_posture : result.without_posture;
  const bool completes = run.end == static_cast<std::uint8_t>(planning::RehearsalEnd::kCompleted);
  if (result.report.feasible != 0 && completes)
    return;
  print(result.report, std::cerr);
  if (result.report.feasible != 0)
    print(run, request.rehearse, planned ? "with the planned posture" : "without a posture", std::cerr);
  throw Failure(kFailure, "nothing was started: " + (result.report.feasible != 0 ? run.reason : result.reason));
}

/// Whether standard input has data for this process: a terminal may be another job's.
bool canRead() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  const bool ours = isatty(STDIN_FILENO) == 0 || tcgetpgrp(STDIN_FILENO) == getpgrp();
  return ours && poll(&input, 1, 0) == 1 && (input.revents & POLLIN) != 0;
}

/// Whether Enter was pressed since the last call.
bool enterTyped() {
  bool entered = false;
  char byte = 0;
  while (canRead() && read(STDIN_FILENO, &byte, 1) == 1)
    entered = entered || byte == '\n';
  return entered;
}

/// Discards input typed before a question.
void forgetTyped() { enterTyped(); }

int runTrajectory(const RobotCommand& options) {
  const std::string text = client::runText(options.trajectory);
  const auto method = idl::fromName<control::Method>(options.method);
  if (!options.method.empty() && !method)
    throw Failure(kUsage, "--method: found '" + options.method + "', expected " + control::methodList());
  Session session(options, true);
  const std::string why = refusal(session.robot, robots::Capability::kComputation);
  if (!why.empty() && (options.check || options.planned))
    throw Failure(kUsage, std::string(options.check ? "--check: " : "--planned: ") + why);
  client::Client& client = session.client;
  if (method)
    client.setMethod(*method);
  if (options.check || options.planned)
    checkFirst(session, text, options.method, options.planned);
  client::Motions::Run run{text, options.planned, options.keep_enabled};
  bool reported = false;
  if (isatty(STDERR_FILENO) != 0 && !options.json) {
    run.progress = [&reported](const client::RunState& state) {
      reported = true;
      std::fprintf(stderr, "\rpoint %u of %u, errors", state.point, state.points);
      for (const double error : state.errors)
        std::fprintf(stderr, " %.3f", 1e3 * error);
      std::fprintf(stderr, " mm   ");
    };
  }
  run.paused = [](const std::string& who) {
    forgetTyped();
    std::fprintf(stderr, "\npaused by %s; Enter continues, Ctrl-C ends the run\n", who.c_str());
  };
  run.goes_on = enterTyped;
  const std::uint32_t before = client.snapshot().summary.trajectory_id;
  const auto follow = [&] {
    try {
      return session.motions.run(run);
    } catch (...) {
      std::fputs(reported ? "\n" : "", stderr);
      if (const dds::RunSummary ended = client.snapshot().summary; ended.trajectory_id != before)
        std::fputs(client::describeSummary(client::summaryJson(ended, session.robot)).c_str(), stderr);
      throw;
    }
  };
  const client::RunState last = follow();
  std::fputs(reported ? "\n" : "", stderr);
  client.releaseLease();
  const nlohmann::ordered_json summary = client::summaryJson(last.summary, session.robot);
  const std::string& reason = last.summary.reason;
  std::string result = std::string(planning::name(last.phase)) + ": " + std::to_string(last.points) + " points, " +
                       std::to_string(last.iterations) + " iterations" + (reason.empty() ? "" : ": " + reason);
  if (last.summary.trajectory_id != 0)
    result += '\n' + client::describeSummary(summary);
  if (result.back() == '\n')
    result.pop_back();
  done(options, result,
       {{"phase", planning::name(last.phase)},
        {"points", last.points},
        {"iterations", last.iterations},
        {"why", reason},
        {"summary", summary}});
  return last.phase == planning::Phase::kFinished ? kOk : kFailure;
}

}  // namespace

void registerRobot(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<RobotCommand>();
  CLI::App* robot = app.add_subcommand("robot", "commands to a running system, under the control lease");
  robot->add_option("-d,--deployment", options->deployment, "deployment file or preset")->capture_default_str();
  robot->add_option("--wait", options->wait, "how long the command waits for a running system, s")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 3600.0));
  robot->add_flag("--json", options->json, "JSON instead of text");
  robot->require_subcommand(1);
  robot->fallthrough();
  const auto add = [&](const std::string& name, const std::string& text, std::function<int(const RobotCommand&)> body) {
    CLI::App* command = robot->add_subcommand(name, text);
    command->callback([options, body, &exit_code] { guarded(exit_code, [&] { return body(*options); }); });
    return command;
  };
  for (const std::string name : {"enable", "disable", "pause", "resume"}) {
    add(name, name + " all arms (CRTK state command)", [name](const RobotCommand& o) { return stateCommand(o, name); });
  }
  add("stop", "soft stop of all arms; latches until `disable`", stop);
  CLI::App* move =
      add("move-jp", "move one ENABLED arm to a joint vector along a straight line in joint space", moveJp);
  move->add_option("-a,--arm", options->arm, "name of the arm, with or without the prefix arm_")->required();
  move->add_option("joints", options->joints,
                   "beta_1..beta_n alpha_1..alpha_n, or insertion roll bend; m and rad; -- before negative numbers")
      ->required();
  CLI::App* back = add(
      "recover",
      "give power to the usable joints of an arm that cannot be enabled (outside its limits, or lost joints)", recover);
  back->add_option("arm", options->arm, "name of the arm, with or without the prefix arm_")->required();
  back->add_option("--without", options->without, "joints to exclude: beta_1 ...")->delimiter(',');
  back->footer(
      "This causes no motion. Then move the arm with `tandem jog` or `tandem robot withdraw`: slowly, and never "
      "farther out of its limits. End with `tandem robot disable`. Documentation: docs/withdrawal.md");
  CLI::App* out =
      add("withdraw", "retract the tubes of an arm after `tandem robot recover`, the innermost first", withdraw);
  out->add_option("arm", options->arm, "name of the arm, with or without the prefix arm_")->required();
  add("home", "move all ENABLED arms to the home of the robot file", home);
  CLI::App* method = add("method", "choose the redundancy-resolution method", setMethod);
  method->add_option("name", options->name, control::methodList())->required();
  CLI::App* set = add("set", "set a parameter of the method or a gain", setMethod);
  set->add_option("name", options->name, "e.g. tip_gain, nspqp_zeta, bounds")->required();
  set->add_option("value", options->value, "its value")->required();
  CLI::App* run = add("run", "enable, follow a trajectory or a path, disable", runTrajectory);
  run->add_option("trajectory", options->trajectory,
                  "trajectory file or preset: circle, line, rectangle, lissajous; of catheters a path: lift, tip-eight")
      ->required();
  run->add_option("-m,--method", options->method, "method (default: the active one)");
  run->add_flag("--check", options->check,
                "check the trajectory from the present joints first; start only if it is feasible");
  run->add_flag("--planned", options->planned,
                "as --check; in addition control follows the planned joint positions in the null space of the tasks");
  run->add_flag("--keep-enabled", options->keep_enabled, "leave the arms ENABLED at the end");
  run->footer(legend({"gate", "restricted"}) + "Exit code 1: a point was not within the tolerance when it was left.");
}

}  // namespace tandem::cli
