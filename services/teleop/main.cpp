// SPDX-License-Identifier: Apache-2.0
/** @file tandem-teleop: publishes the state of an operator's device on teleop/input; tandem-control moves the robot,
 * and reports on teleop/status. */
#include <CLI/CLI.hpp>
#include <iostream>
#include <mutex>
#include <numbers>

#include "config/arm_names.h"
#include "config/robot_files.h"
#include "robots/capability.h"
#include "safety/faults.h"
#include "safety/operating_state.h"
#include "services/client/arguments.h"
#include "services/client/client.h"
#include "services/client/number_checks.h"
#include "services/client/role.h"
#include "services/runtime/periodic_loop.h"
#include "services/runtime/process.h"
#include "services/runtime/stop_signal.h"
#include "services/teleop/device.h"

using namespace tandem;
using client::Failure;
using planning::teleoperation::Mode;
using planning::teleoperation::State;

namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;  ///< in a radian

struct Options {
  std::string deployment = "teleop", device = "gamepad", file, mode = "pair", arm, other_arm;
  std::vector<double> view;  ///< deg, about x, then y, then z of the base frame
  double scale = 0.0, speed = 20.0, angular_speed = kDegrees * teleop::kAngularSpeed, rate = 100.0;
  bool enable = false, quiet = false;
};

std::unique_ptr<teleop::Device> open(const Options& options) {
  const double speed = 1e-3 * options.speed, angular_speed = options.angular_speed / kDegrees;
  if (!options.file.empty())
    return teleop::openTrace(options.file);
  if (options.device == "gamepad")
    return teleop::openGamepad(speed, angular_speed);
  if (options.device == "spacemouse")
    return teleop::openSpaceMouse(speed, angular_speed);
  if (options.device == "keyboard")
    return teleop::openKeyboard(speed, angular_speed);
  throw Failure(client::kUsage, "device trace: expected --trace FILE");
}

std::uint8_t armIndex(const config::Robot& robot, const std::string& name, std::size_t otherwise) {
  if (name.empty())
    return static_cast<std::uint8_t>(std::min(otherwise, robot.arms.size() - 1));
  if (const auto k = config::findArm(robot, name))
    return static_cast<std::uint8_t>(*k);
  throw Failure(client::kUsage, "arm: found '" + name + "', expected one of " + config::armNames(robot));
}

/** Client session: sends teleop/input, and stores teleop/status and control/status from DDS threads. */
class Session {
 public:
  Session(const Options& options, const config::Deployment& deployment, const config::Robot& robot)
      : options_(options),
        robot_(robot),
        client_(deployment, callbacks()),
        inputs_(client_.bus().writer(dds::kTeleopInput)),
        statuses_(client_.bus().reader(dds::kTeleopStatus, [this](const dds::TeleopStatus& s) { receive(s); })) {
    input_.client = client_.id();
    input_.arm = armIndex(robot, options.arm, 0);
    input_.other_arm = armIndex(robot, options.other_arm, input_.arm == 0 ? 1 : 0);
    input_.mode = static_cast<std::uint8_t>(options.mode == "tip"    ? Mode::kTip
                                            : options.mode == "pair" ? Mode::kPair
                                                                     : Mode::kRelative);
    if (robot.arms.size() < 2 && input_.mode != static_cast<std::uint8_t>(Mode::kTip))
      throw Failure(client::kUsage, "mode " + options.mode + " needs two arms, and this robot has one; use --mode tip");
    input_.scale = options.scale;
    if (!options.view.empty()) {
      const Eigen::Quaterniond view(Eigen::AngleAxisd(1.0 / kDegrees * options.view[2], Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(1.0 / kDegrees * options.view[1], Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(1.0 / kDegrees * options.view[0], Eigen::Vector3d::UnitX()));
      input_.frame = 1;
      Eigen::Vector4d::Map(input_.view.data()) = view.coeffs();
    }
  }

  client::Client& client() { return client_; }

  /// Publishes a reading of the device.
  void send(const teleop::Reading& reading, planning::teleoperation::Device kind) {
    take(reading);
    input_.device = static_cast<std::uint8_t>(kind);
    input_.operator_present = reading.present ? 1 : 0;
    input_.clutch = reading.clutch ? 1 : 0;
    input_.kind = static_cast<std::uint8_t>(reading.pose ? idl::TeleopKind::kPose : idl::TeleopKind::kVelocity);
    Eigen::Vector3d::Map(input_.linear.data()) = reading.linear;
    Eigen::Vector3d::Map(input_.angular.data()) = reading.angular;
    Eigen::Vector3d::Map(input_.position.data()) = reading.position;
    Eigen::Vector4d::Map(input_.orientation.data()) = reading.orientation.coeffs();
    input_.buttons = reading.buttons;
    ++input_.sequence;
    input_.stamp = runtime::monotonicNow();
    {
      const std::lock_guard lock(mutex_);
      input_.control_session = session_;
      input_.answers_control = sequence_;
    }
    inputs_.write(input_);
  }

  dds::TeleopStatus status() const {
    const std::lock_guard lock(mutex_);
    return status_;
  }

  /// The first arm in FAULT, with cause and remedy; empty if none.
  std::string fault() const {
    const client::Snapshot now = client_.snapshot();
    for (std::size_t k = 0; k < now.status.arm_count; ++k)
      if (const safety::FaultMask faults = now.status.faults[k] | now.state.faults[k]; faults != 0)
        return robot_.arms[k].name + " is in FAULT: " + safety::describeFaults(faults) +
               "; `tandem robot disable` clears it";
    return {};
  }

  /// Reason why the robot no longer follows this operator, although the operator has not stopped it; empty if none.
  std::string stopped() const {
    const dds::TeleopStatus s = status();
    if (s.client != client_.id() || s.state != static_cast<std::uint8_t>(State::kStopped))
      return {};
    const std::string found = fault();
    return found.empty() ? s.reason : found;
  }

  /// Prints a status line after each change.
  void report() {
    const dds::TeleopStatus s = status();
    if (s.client != client_.id() && s.state != static_cast<std::uint8_t>(State::kRefused))
      return;
    std::string line(planning::teleoperation::name(static_cast<State>(s.state)));
    line += ": " + std::string(planning::teleoperation::name(static_cast<Mode>(input_.mode))) + " of " +
            robot_.arms[input_.arm].name;
    if (!s.reason.empty())
      line += "; " + s.reason;
    if (!s.limited_by.empty())
      line += "; limited by " + s.limited_by;
    if (const std::string found = fault(); !found.empty())
      line += "; " + found;
    if (line != reported_ && !options_.quiet)
      std::cout << line << std::endl;
    reported_ = line;
  }

 private:
  client::Client::Callbacks callbacks() {
    client::Client::Callbacks callbacks;
    callbacks.status = [this](const dds::ControlStatus& message) { receive(message); };
    return callbacks;
  }

  void take(const teleop::Reading& reading) {
    const auto arms = static_cast<std::uint8_t>(robot_.arms.size());
    if (reading.next_mode && arms > 1)
      input_.mode = static_cast<std::uint8_t>(input_.mode % 3 + 1);
    if (reading.next_arm && arms > 1)
      std::swap(input_.arm, input_.other_arm);
    if (reading.scale_steps != 0) {
      const double from = input_.scale > 0.0 ? input_.scale : status().scale;
      input_.scale = std::clamp(from * (reading.scale_steps > 0 ? 1.25 : 0.8), planning::teleoperation::kMinScale,
                                planning::teleoperation::kMaxScale);
    }
    if (reading.stop)
      client_.stop("the operator's device");
  }
  void receive(const dds::ControlStatus& s) {
    const std::lock_guard lock(mutex_);
    session_ = s.session;
    sequence_ = s.sequence;
  }
  void receive(const dds::TeleopStatus& s) {
    const std::lock_guard lock(mutex_);
    status_ = s;
  }

  const Options& options_;
  const config::Robot& robot_;
  mutable std::mutex mutex_;
  std::uint64_t session_ = 0, sequence_ = 0;
  dds::TeleopStatus status_;
  dds::TeleopInput input_;
  std::string reported_;
  client::Client client_;
  dds::Writer<dds::TeleopInput> inputs_;
  dds::Reader statuses_;
};

void expectEnabled(Session& session, const Options& options) {
  const dds::ControlStatus status = session.client().snapshot().status;
  for (std::size_t k = 0; k < status.arm_count; ++k) {
    if (status.operating_state[k] == static_cast<std::uint8_t>(safety::OperatingState::kEnabled))
      continue;
    if (!options.enable)
      throw Failure(client::kFailure, "the arms are not ENABLED; add --enable");
    return session.client().stateCommand("enable");
  }
}

/// Runs until the device or a signal ends it. @return reason why a trace was not followed to its end
std::string drive(Session& session, teleop::Device& device, const Options& options, const runtime::StopSignal& stop) {
  const std::int64_t start = runtime::monotonicNow();
  while (!stop.requested()) {
    const teleop::Reading reading = device.read(1e-9 * static_cast<double>(runtime::monotonicNow() - start));
    session.send(reading, device.kind());
    session.report();
    device.showLimited(session.status().clamped != 0);
    const dds::ControlStatus status = session.client().snapshot().status;
    if (status.lease_owner != session.client().id())
      throw Failure(client::kFailure, "the control lease was lost");
    // A trace cannot release and press the switch again: its remainder would not be the recorded motion.
    if (device.kind() == planning::teleoperation::Device::kTrace) {
      if (const std::string reason = session.stopped(); !reason.empty())
        return "the trace was not followed to its end: " + reason;
    }
    if (reading.end)
      break;
    stop.waitFor(1.0 / options.rate);
  }
  return {};
}

int run(const Options& options) {
  runtime::StopSignal stop;
  const config::Deployment deployment = runtime::loadDeployment(options.deployment);
  const config::Robot robot = config::loadAnyRobot(deployment.robot);
  if (const std::string why = refusal(robot, robots::Capability::kTips); !why.empty())
    throw Failure(client::kUsage, why);
  if (deployment.clock == config::ClockMode::kLockStep)
    throw Failure(client::kUsage,
                  deployment.file.string() + ": clock: found lock_step, expected real_time for teleoperation");
  const std::unique_ptr<teleop::Device> device = open(options);
  Session session(options, deployment, robot);
  session.client().setInterrupt([&] { return stop.requested(); });
  session.client().connect(10.0);
  session.client().acquireLease();
  expectEnabled(session, options);
  if (!options.quiet)
    std::cout << device->describe() << std::endl;
  std::string error;
  try {
    error = drive(session, *device, options, stop);
  } catch (...) {
    session.send({}, device->kind());  // releases the switch at once, instead of after a time-out
    throw;
  }
  session.client().setInterrupt({});
  // Release the switch first: otherwise the lease would end during motion.
  session.client().waitFor(1.0, [&](const client::Snapshot& s) {
    session.send({}, device->kind());
    return s.status.source != static_cast<std::uint8_t>(dds::Source::kTeleoperation);
  });
  const std::string fault = session.fault();
  if (options.enable && fault.empty())  // a fault stays latched, for the operator to examine
    session.client().stateCommand("disable");
  session.client().releaseLease();
  if (error.empty())
    error = fault;
  if (!error.empty())
    throw Failure(client::kFailure, error);
  return client::kOk;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Teleoperation: moves the tips of a running robot with an operator's device.", "tandem-teleop");
  Options options;
  int exit_code = client::kOk;
  client::addRoleOption(app);
  app.add_option("-d,--deployment", options.deployment, "deployment file or preset")->capture_default_str();
  app.add_option("--device", options.device, "gamepad, spacemouse, keyboard or trace")
      ->capture_default_str()
      ->check(CLI::IsMember({"gamepad", "spacemouse", "keyboard", "trace"}));
  app.add_option("--trace", options.file, "motion from a file instead: CSV, or an MCAP recording with teleop/input");
  app.add_option("--mode", options.mode, "tip, pair (the relative position is kept) or relative (it is moved)")
      ->capture_default_str()
      ->check(CLI::IsMember({"tip", "pair", "relative"}));
  app.add_option("--arm", options.arm, "driven arm (default: the first one)");
  app.add_option("--other-arm", options.other_arm, "its partner (default: the second one, or the first)");
  app.add_option("--view", options.view,
                 "rotation from device axes to base frame: angles about x, then y, then z of the base frame, deg")
      ->expected(3);
  app.add_option("--scale", options.scale, "motion scale (default: the deployment's)")
      ->check(CLI::Range(planning::teleoperation::kMinScale, planning::teleoperation::kMaxScale));
  app.add_option("--speed", options.speed, "tip speed at full deflection, before scaling, mm/s")
      ->capture_default_str()
      ->check(client::kPositive);
  app.add_option("--angular-speed", options.angular_speed,
                 "angular speed at full deflection, deg/s; rotations move the tip as far as the deployment's "
                 "teleoperation.orientation says")
      ->capture_default_str()
      ->check(client::kPositive);
  app.add_option("--rate", options.rate, "readings of the device per second")
      ->capture_default_str()
      ->check(CLI::Range(20.0, 1000.0));
  app.add_flag("--enable", options.enable, "enable the arms at the start and disable them at the end");
  app.add_flag("--quiet", options.quiet, "print errors only");
  app.footer(
      "The robot moves only while the device's dead-man switch is pressed. Devices: docs/teleoperation.md\n\n"
      "Examples:\n"
      "  tandem teleop -d teleop --enable\n"
      "  tandem teleop -d one-arm --device keyboard --mode tip --enable");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? client::kOk : client::kUsage;
  }
  client::guarded(exit_code, [&] {
    try {
      return run(options);
    } catch (const teleop::DeviceError& error) {
      throw Failure(client::kFailure, error.what());
    }
  });
  return exit_code;
}
