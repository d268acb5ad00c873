// SPDX-License-Identifier: Apache-2.0
/** @file tandem robot: commands to a running system, under the control lease. */
#include <unistd.h>

#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "config/arm_names.h"
#include "planning/follower.h"
#include "safety/faults.h"
#include "safety/joint_motion.h"
#include "services/cli/arguments.h"
#include "services/cli/client.h"
#include "services/cli/plan_print.h"
#include "services/cli/plan_setup.h"
#include "services/common/stop_signal.h"

namespace tandem::cli {
namespace {

struct Options {
  std::string deployment = "laptop", trajectory, arm, method, name, value;
  std::vector<double> joints;
  bool json = false, keep_enabled = false, check = false, planned = false;
};

/// A running system, with its lease if asked for.
struct Session {
  Session(const Options& options, bool lease)
      : deployment(config::loadDeployment(config::findFile(options.deployment, "deployment"))),
        robot(config::loadRobot(deployment.robot)),
        client(deployment) {
    client.interruptBy([this] { return stop.requested(); });
    client.connect(10.0);
    client.expectLife(2.0 + 3.0 * deployment.control_period);
    if (lease)
      client.acquireLease();
  }
  service::StopSignal stop;
  config::Deployment deployment;
  config::Robot robot;
  Client client;
};

int done(const Options& options,
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

/// Before a fault is cleared: power goes at once, then the lease is taken, which a client that has just gone may still
/// hold.
/// @return whether there is a fault to clear, and the lease is ours now.
bool clearLease(Session& session) {
  const Snapshot now = session.client.snapshot();
  const auto faulty = [&](std::size_t k) { return (now.status.faults[k] | now.state.faults[k]) != 0; };
  bool any = false;
  for (std::size_t k = 0; k < now.status.arm_count; ++k)
    any = any || faulty(k);
  if (!any)
    return false;
  try {
    dds::ControlRequest off;
    off.kind = static_cast<std::uint8_t>(dds::ControlKind::kStateCommand);
    off.value = "disable";
    session.client.control(off);
  } catch (const Failure&) {
    // Refused for the fault alone; whatever was not in FAULT has no power now.
  }
  session.client.waitFor(1.5 * session.deployment.budgets.lease,
                         [](const Snapshot& s) { return s.status.lease_holder == 0; });
  session.client.acquireLease();
  return true;
}

int stateCommand(const Options& options, const std::string& command) {
  const bool gives_power = command == "enable" || command == "resume";
  Session session(options, gives_power);
  const bool clears = command == "disable" && clearLease(session);
  session.client.stateCommand(command);
  if (gives_power || clears)
    session.client.releaseLease();
  return done(options, "all arms: " + command + "d");
}

int stop(const Options& options) {
  // Not a Session: a stop waits for nobody, least of all for the one whose silence may be the reason for it.
  Client client(config::loadDeployment(config::findFile(options.deployment, "deployment")));
  client.stop("tandem robot stop");
  const bool stopped = client.waitFor(2.0, [](const Snapshot& s) {
    const auto& faults = s.state.faults;
    return s.states > 0 &&
           std::all_of(faults.begin(), faults.begin() + s.state.arm_count, [](auto f) { return f != 0; }) &&
           std::all_of(s.state.velocity.begin(), s.state.velocity.end(), [](double v) { return v == 0.0; });
  });
  if (!stopped)
    throw Failure(kFailure, "stop was sent, but the drives do not report standstill; is `tandem up` running?");
  return done(options, "stopped; `tandem robot disable` clears the fault");
}

int moveJp(const Options& options) {
  Session session(options, true);
  dds::ControlRequest request;
  request.kind = static_cast<std::uint8_t>(dds::ControlKind::kMoveJp);
  const auto found = config::findArm(session.robot, options.arm);
  if (!found)
    throw Failure(kUsage, "--arm: found '" + options.arm + "', which the robot does not have");
  request.arm = static_cast<std::uint8_t>(*found);
  if (options.joints.size() > safety::kMaxJointsPerArm)
    throw Failure(kUsage, "too many joints");
  request.joint_count = static_cast<std::uint8_t>(options.joints.size());
  std::copy(options.joints.begin(), options.joints.end(), request.joints.begin());
  const std::uint64_t asked = session.client.control(request).value;
  const std::size_t arm = request.arm;
  const auto ended = [&](const Snapshot& s) {
    return s.status.faults[arm] != 0 || (s.status.sequence > asked && s.status.busy[arm] == 0);
  };
  const auto reached = [&](const Snapshot& s) {
    for (std::size_t j = 0; j < options.joints.size(); ++j) {
      const double error =
          s.state.position[dds::jointIndex(static_cast<int>(arm), static_cast<int>(j))] - options.joints[j];
      if (std::abs(error) > safety::kAtRest)
        return false;
    }
    return true;
  };
  constexpr double kLag = 2.0;  // s, of joints behind their setpoints
  if (!session.client.waitFor(600.0, ended) || !session.client.waitFor(kLag, reached)) {
    session.client.interruptBy({});
    if (session.client.snapshot().status.faults[arm] != 0)
      throw Failure(kFailure, "the arm went into FAULT on the way");
    session.client.stateCommand("pause");
    throw Failure(kFailure, "move_jp ended before the goal was reached; the arms are paused");
  }
  session.client.releaseLease();
  return done(options, "the arm is there");
}

int home(const Options& options) {
  Session session(options, true);
  dds::ControlRequest request;
  request.kind = static_cast<std::uint8_t>(dds::ControlKind::kHome);
  const std::uint64_t asked = session.client.control(request).value;
  const bool there = session.client.waitFor(600.0, [&](const Snapshot& s) {
    for (std::size_t k = 0; k < s.status.arm_count; ++k) {
      if (s.status.faults[k] != 0)
        return true;
      if (s.status.busy[k] != 0)
        return false;
    }
    return s.status.sequence > asked;
  });
  session.client.interruptBy({});
  if (!there)
    session.client.stateCommand("pause");
  if (!there || session.client.snapshot().status.faults[0] != 0)
    throw Failure(kFailure, "the arms did not get home");
  session.client.releaseLease();
  return done(options, "the arms are at home");
}

int setMethod(const Options& options) {
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

/// Text of a trajectory file; a shape from CSV is read here, so that planning needs no file of ours.
std::string trajectoryText(const std::string& name) {
  const auto file = config::findFile(name, "trajectory");
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  return config::formatTrajectory(config::parseTrajectory(text.str(), file.string(), file.parent_path()));
}

/// Asks planning, from where the robot stands, under the lease: nobody moves it meanwhile.
/// @throw Failure where the trajectory cannot be had
void checkFirst(Session& session, const std::string& text, std::string method, bool planned) {
  dds::ComputationRequest request;
  request.kind = static_cast<std::uint8_t>(dds::ComputationKind::kCheck);
  request.trajectory = text;
  request.stability = PlanOptions{}.stability;
  if (method.empty())
    method = control::name(static_cast<control::Method>(session.client.snapshot().status.method));
  request.rehearse = method;
  const auto result = computeLive(session.deployment, request, [&session] { return session.stop.requested(); });
  const dds::RehearsalReport& run = planned ? result.with_posture : result.without_posture;
  const bool completes = run.end == static_cast<std::uint8_t>(planning::RehearsalEnd::kCompleted);
  if (result.report.feasible != 0 && completes)
    return;
  print(result.report, std::cerr);
  if (result.report.feasible != 0)
    print(run, request.rehearse, planned ? "with the planned posture" : "without a posture", std::cerr);
  throw Failure(kFailure, "nothing was started: " + (result.report.feasible != 0 ? run.words : result.reason));
}

int runTrajectory(const Options& options) {
  const std::string text = trajectoryText(options.trajectory);
  Session session(options, true);
  Client& client = session.client;
  if (!options.method.empty()) {
    const auto method = control::methodFromName(options.method);
    if (!method)
      throw Failure(kUsage, "--method: found '" + options.method + "'");
    client.setMethod(*method);
  }
  if (options.check || options.planned)
    checkFirst(session, text, options.method, options.planned);
  client.stateCommand("enable");
  const Snapshot enabled = client.snapshot();
  client.waitFor(2.0, [&](const Snapshot& s) { return s.reference.answers_control >= enabled.status.sequence; });
  dds::PlanningRequest request;
  request.kind = 1;
  request.trajectory = text;
  request.planned = options.planned ? 1 : 0;
  const std::uint32_t id = client.planning(request).value;
  const bool terminal = isatty(STDERR_FILENO) != 0 && !options.json;
  const auto ours = [&](const Snapshot& s) { return s.reference.trajectory_id == id; };
  const auto faulty = [](const Snapshot& s) {
    return std::any_of(s.status.faults.begin(), s.status.faults.begin() + s.status.arm_count,
                       [](safety::FaultMask faults) { return faults != 0; });
  };
  std::uint32_t shown = 0;
  const bool ended = client.waitFor(24.0 * 3600.0, [&](const Snapshot& s) {
    if (faulty(s))
      return true;
    if (terminal && ours(s) && s.reference.point != shown) {
      shown = s.reference.point;
      std::fprintf(stderr, "\rpoint %u of %u, errors %.3f and %.3f mm   ", s.reference.point, s.reference.point_count,
                   1e3 * s.status.task_error[0], 1e3 * s.status.task_error[1]);
    }
    const auto phase = static_cast<planning::Phase>(s.reference.phase);
    return ours(s) && phase != planning::Phase::kRunning && phase != planning::Phase::kPaused;
  });
  if (terminal)
    std::fprintf(stderr, "\n");
  // Planning may notice a fault before control says which one it is.
  constexpr double kReason = 0.5;  // s
  if (ended && static_cast<planning::Phase>(client.snapshot().reference.phase) == planning::Phase::kFailed)
    client.waitFor(kReason, faulty);
  const Snapshot last = client.snapshot();
  if (!ended) {
    client.interruptBy({});
    client.stateCommand("pause");
    dds::PlanningRequest give_up;
    give_up.kind = 4;
    client.planning(give_up);
    throw Failure(kFailure, "interrupted; the arms are paused, the trajectory is given up");
  }
  for (std::size_t k = 0; k < last.status.arm_count; ++k) {
    if (last.status.faults[k] != 0) {
      throw Failure(kFailure,
                    session.robot.arms[k].name + " is in FAULT: " + safety::describeFaults(last.status.faults[k]));
    }
  }
  if (!options.keep_enabled)
    client.stateCommand("disable");
  client.releaseLease();
  const auto phase = static_cast<planning::Phase>(last.reference.phase);
  const nlohmann::ordered_json json{{"phase", planning::name(phase)},
                                    {"points", last.reference.point_count},
                                    {"iterations", last.reference.total_iterations}};
  done(options,
       std::string(planning::name(phase)) + ": " + std::to_string(last.reference.point_count) + " points, " +
           std::to_string(last.reference.total_iterations) + " iterations",
       json);
  return phase == planning::Phase::kFinished ? kOk : kFailure;
}

}  // namespace

void registerRobot(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* robot = app.add_subcommand("robot", "commands to a running system, under the control lease");
  robot->add_option("-d,--deployment", options->deployment, "deployment file or preset")->capture_default_str();
  robot->add_flag("--json", options->json, "JSON instead of text");
  robot->require_subcommand(1);
  robot->fallthrough();
  const auto add = [&](const std::string& name, const std::string& text, std::function<int(const Options&)> body) {
    CLI::App* command = robot->add_subcommand(name, text);
    command->callback([options, body, &exit_code] { guarded(exit_code, [&] { return body(*options); }); });
    return command;
  };
  for (const std::string name : {"enable", "disable", "pause", "resume"}) {
    add(name, "CRTK state command '" + name + "' for all arms",
        [name](const Options& o) { return stateCommand(o, name); });
  }
  add("stop", "soft stop of all arms; latches until `disable`", stop);
  CLI::App* move =
      add("move-jp", "move one ENABLED arm to a joint vector along a straight line in joint space", moveJp);
  move->add_option("-a,--arm", options->arm, "arm: its name, or what stands behind arm_ in it")->required();
  move->add_option("joints", options->joints, "beta_1..beta_n alpha_1..alpha_n, m and rad; -- before negative numbers")
      ->required();
  add("home", "move all ENABLED arms to the home of the robot file", home);
  CLI::App* method = add("method", "choose the redundancy-resolution method", setMethod);
  method->add_option("name", options->name, "nsp, nspwln, nspwln-joint, nspqp or snsqp")->required();
  CLI::App* set = add("set", "set a parameter of the method or a gain", setMethod);
  set->add_option("name", options->name, "e.g. tip_gain, nspqp_zeta, bounds")->required();
  set->add_option("value", options->value, "its value")->required();
  CLI::App* run = add("run", "enable, follow a trajectory, disable", runTrajectory);
  run->add_option("trajectory", options->trajectory, "trajectory file or preset: circle, line, rectangle, lissajous")
      ->required();
  run->add_option("-m,--method", options->method, "method (default: the one in force)");
  run->add_flag("--check", options->check, "ask planning first, and start only what can be run from here");
  run->add_flag("--planned", options->planned,
                "as --check, and let control lead the joints, where the tasks leave them free, to those that planning "
                "found");
  run->add_flag("--keep-enabled", options->keep_enabled, "leave the arms ENABLED at the end");
}

}  // namespace tandem::cli
