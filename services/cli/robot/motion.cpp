// SPDX-License-Identifier: Apache-2.0
/** @file tandem home and tandem jog: homing runs and measured positions, and motion of single joints. */
#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <cmath>
#include <iostream>
#include <numbers>
#include <thread>

#include "config/arm_names.h"
#include "config/robot_files.h"
#include "services/cli/robot/axis_motion.h"
#include "services/cli/subcommand.h"
#include "services/client/motions.h"
#include "services/client/unconfirmed_positions.h"
#include "services/runtime/process.h"
#include "services/runtime/stop_signal.h"

namespace tandem::cli {
namespace {

struct MotionCommand {
  std::string deployment = runtime::defaultDeployment(), arm, joint;
  double speed = 0.0, seconds = 1.0, timeout = 180.0;
  bool confirm = false;
  std::vector<std::string> measured;  ///< JOINT=POSITION
};

/// "beta_1=12.5" as joint and position, mm or degrees. @throw Failure
std::pair<std::string, double> readMeasurement(const std::string& text) {
  const std::size_t equals = text.find('=');
  double value = 0.0;
  const char* const end = text.data() + text.size();
  const char* const begin = equals == std::string::npos ? end : text.data() + equals + 1;
  const auto [rest, error] = std::from_chars(begin, end, value);
  if (error != std::errc{} || rest != end || !std::isfinite(value))
    throw Failure(kUsage, "--measured: found '" + text + "', expected JOINT=POSITION, e.g. beta_1=-12.5 (mm, degrees)");
  return {text.substr(0, equals), value};
}

/// The requests of --measured. @throw Failure
std::vector<dds::HalRequest> measurementsOf(const config::Robot& robot, const MotionCommand& options) {
  if (options.arm.empty() && robot.arms.size() > 1)
    throw Failure(kUsage, "--measured: expected --arm, the arm of these joints");
  dds::HalRequest request;
  request.kind = static_cast<std::uint8_t>(dds::HalKind::kMeasured);
  request.arm = options.arm.empty() ? 0 : client::armIndex(robot, options.arm);
  const config::Arm& arm = robot.arms[request.arm];
  std::vector<dds::HalRequest> requests;
  for (const std::string& text : options.measured) {
    const auto [joint, position] = readMeasurement(text);
    const int index = client::jointIndex(arm, joint);
    request.joint = static_cast<std::uint8_t>(index);
    request.position = position * (arm.limits.isTranslation(index) ? 1e-3 : std::numbers::pi / 180.0);
    requests.push_back(request);
  }
  return requests;
}

/// Sends measured positions, and waits until their axes have them; nothing moves. @throw Failure
int sendMeasurements(client::Client& client, const config::Robot& robot, const std::vector<dds::HalRequest>& requests) {
  for (const dds::HalRequest& one : requests) {
    client.hal(one);
    const std::size_t i = dds::jointIndex(static_cast<int>(one.arm), one.joint);
    const bool taken = client.waitFor(10.0, [&](const client::Snapshot& s) {
      const auto phase = static_cast<idl::AxisPhase>(s.hal.axis_phase[i]);
      return phase == idl::AxisPhase::kReady || phase == idl::AxisPhase::kUnconfirmed;
    });
    if (!taken)
      throw Failure(kFailure, robot.arms[one.arm].joint_names[one.joint] +
                                  ": the drive did not take its software limits within 10 s; see tandem can monitor");
  }
  client.releaseLease();
  const client::Snapshot now = client.snapshot();
  const nlohmann::ordered_json left = client::unconfirmedPositions(robot, now.hal, now.state);
  std::string text = "measured positions taken; not ready yet:\n" + client::describeUnconfirmed(left, "  ");
  text.pop_back();
  answer(left.empty() ? "measured positions taken" : text, {{"taken", requests.size()}, {"unconfirmed", left}});
  return kOk;
}

/// Repeats the request until the HAL takes it as a confirmation. @throw Failure
void confirmPositions(client::Client& client,
                      const config::Robot& robot,
                      const dds::HalRequest& request,
                      runtime::StopSignal& stop) {
  const client::Snapshot now = client.snapshot();
  std::cerr << client::describeUnconfirmed(client::unconfirmedPositions(robot, now.hal, now.state), "");
  constexpr double kRepeat = 0.2, kLongest = 40.0;  // s: longer than ArmHardware::kConfirmTime of every arm
  const auto start = std::chrono::steady_clock::now();
  while (true) {
    try {
      client.hal(request);
      return;
    } catch (const client::Refusal& refusal) {
      const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start;
      if (std::string(refusal.what()).find("--confirm") == std::string::npos || passed.count() > kLongest)
        throw;
    }
    if (stop.waitFor(kRepeat))
      throw Failure(kFailure, "interrupted; no position is confirmed");
  }
}

/// Homing of the drives. It continues while the request is repeated; without repetition the drives stop.
int homeDrives(const MotionCommand& options) {
  constexpr double kRepeat = 0.2;  // s, below the keep-alive of 1 s
  runtime::StopSignal stop;
  const config::Deployment deployment = runtime::loadDeployment(options.deployment);
  const config::Robot robot = config::loadAnyRobot(deployment);
  const std::vector<dds::HalRequest> measurements =
      options.measured.empty() ? std::vector<dds::HalRequest>{} : measurementsOf(robot, options);
  client::Client client(deployment);
  client::takeCommand(client, [&] { return stop.requested(); });
  dds::HalRequest request;
  request.kind = static_cast<std::uint8_t>(dds::HalKind::kHome);
  request.arm = options.arm.empty() ? dds::kAllArms : client::armIndex(robot, options.arm);
  if (!measurements.empty())
    return sendMeasurements(client, robot, measurements);
  if (options.confirm)
    confirmPositions(client, robot, request, stop);
  const auto start = std::chrono::steady_clock::now();
  bool began = false;
  while (client.hal(request).value == 0) {
    if (!began)
      std::cerr << "homing; Ctrl-C stops\n";
    began = true;
    if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() > options.timeout)
      throw Failure(kFailure, "homing did not end in time; the drives now stop by themselves");
    if (stop.waitFor(kRepeat))
      throw Failure(kFailure, "interrupted; the drives now stop by themselves");
  }
  client.releaseLease();
  answer(began ? "homed" : "all joints are homed; nothing to do", {{"homed", true}, {"moved", began}});
  return kOk;
}

int jog(const MotionCommand& options) {
  runtime::StopSignal stop;
  const config::Deployment deployment = runtime::loadDeployment(options.deployment);
  const config::Robot robot = config::loadAnyRobot(deployment);
  const std::uint8_t arm = client::armIndex(robot, options.arm);
  const int joint = client::jointIndex(robot.arms[arm], options.joint);
  const int joints = robot.arms[arm].limits.jointCount();
  const bool translation = robot.arms[arm].limits.isTranslation(joint);
  client::Client client(deployment);
  client.setInterrupt([&] { return stop.requested(); });
  client.connect(10.0);
  client.setSilenceLimit(2.0 + 3.0 * deployment.control_period);
  client.acquireLease();
  const double from = client.snapshot().state.position[dds::jointIndex(static_cast<int>(arm), joint)];
  jogJoint(client, deployment,
           {arm, joint, joints, options.speed * (translation ? 1e-3 : std::numbers::pi / 180.0), options.seconds},
           [&](double seconds) { return stop.waitFor(seconds); });
  client.releaseLease();
  const double scale = translation ? 1e3 : 180.0 / std::numbers::pi;
  const double to = client.snapshot().state.position[dds::jointIndex(static_cast<int>(arm), joint)];
  answer(fmt::format("{} {}: from {:.4f} to {:.4f} {}", robot.arms[arm].name, options.joint, scale * from, scale * to,
                     translation ? "mm" : "deg"),
         {{"arm", robot.arms[arm].name}, {"joint", options.joint}, {"from", from}, {"to", to}});
  return client.snapshot().status.faults[arm] == 0 ? kOk : kFailure;
}

}  // namespace

bool jogJoint(client::Client& client,
              const config::Deployment& deployment,
              const Jog& jog,
              const std::function<bool(double)>& wait) {
  dds::ControlRequest request;
  request.kind = static_cast<std::uint8_t>(dds::ControlKind::kJog);
  request.arm = jog.arm;
  request.joint_count = static_cast<std::uint8_t>(jog.joints);
  request.joints[static_cast<std::size_t>(jog.joint)] = jog.speed;
  // Each request is valid for the larger of the teleoperation budget and two periods.
  const double repeat = 0.4 * std::max(deployment.budgets.teleoperation, 2.0 * deployment.control_period);
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(jog.seconds);
  bool ended = false;
  while (std::chrono::steady_clock::now() < end && !ended) {
    client.control(request);
    const double left = std::chrono::duration<double>(end - std::chrono::steady_clock::now()).count();
    ended = wait(std::clamp(left, 0.0, repeat));
  }
  client.setInterrupt({});
  request.kind = static_cast<std::uint8_t>(dds::ControlKind::kHold);
  client.control(request);
  const std::size_t index = dds::jointIndex(static_cast<int>(jog.arm), jog.joint);
  client.waitFor(2.0, [&](const client::Snapshot& s) { return s.state.velocity[index] == 0.0; });
  return !ended;
}

void registerHome(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<MotionCommand>();
  CLI::App* command = app.add_subcommand("home", "run the drives' homing procedures; absolute encoders need none");
  command->add_option("-d,--deployment", options->deployment, "deployment file or preset")->capture_default_str();
  command->add_option("-a,--arm", options->arm, "one arm only");
  command->add_option("--timeout", options->timeout, "time-out, s")->capture_default_str()->check(client::kPositive);
  CLI::Option* const confirm = command->add_flag(
      "--confirm", options->confirm,
      "confirm positions after power on that are not those of before (jump_tolerance); it takes 3 s per arm");
  command
      ->add_option("--measured", options->measured,
                   "JOINT=POSITION in mm or degrees: where a joint with `reference: measured` stands, as measured from "
                   "outside; repeatable, with --arm")
      ->excludes(confirm);
  command->footer("The arms must be DISABLED. To move homed arms to the robot file's home: tandem robot home.");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return homeDrives(*options); }); });
}

void registerJog(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<MotionCommand>();
  CLI::App* command = app.add_subcommand("jog", "move one joint of an ENABLED arm at a speed, within its limits");
  command->add_option("-d,--deployment", options->deployment, "deployment file or preset")->capture_default_str();
  command->add_option("arm", options->arm, "name of the arm, with or without the prefix arm_")->required();
  command->add_option("joint", options->joint, "beta_1 ... alpha_n; of a catheter insertion, roll, bend")->required();
  command->add_option("speed", options->speed, "mm/s for beta or insertion, else deg/s; put -- before a negative value")
      ->required();
  command->add_option("--for", options->seconds, "duration, s")->capture_default_str()->check(CLI::Range(0.0, 60.0));
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return jog(*options); }); });
}

}  // namespace tandem::cli
