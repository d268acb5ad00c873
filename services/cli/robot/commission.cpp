// SPDX-License-Identifier: Apache-2.0
/** @file tandem commission: checks the axes of a new arm one after the other, with the person who stands beside it. */
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <iostream>
#include <mutex>
#include <numbers>

#include "config/robot_files.h"
#include "config/values.h"
#include "hal/drives/axis_sweep.h"
#include "safety/faults.h"
#include "services/cli/models/figure.h"
#include "services/cli/robot/axis_motion.h"
#include "services/cli/robot/commission_findings.h"
#include "services/cli/subcommand.h"
#include "services/client/motions.h"
#include "services/runtime/process.h"
#include "services/runtime/stop_signal.h"

namespace tandem::cli {
namespace {

using Json = nlohmann::ordered_json;

struct CommissionCommand {
  std::string deployment = runtime::defaultDeployment(), arm, joint, folder = "commissioning";
  double travel_mm = 1.0, travel_deg = 3.0, speed_percent = 1.0;
  bool again = false;
  FigureOptions figure;
};

/** Samples of one joint, taken from hal/status while it is switched on. */
class SweepRecorder {
 public:
  void begin(std::size_t index) {
    const std::scoped_lock lock(mutex_);
    index_ = index;
    samples_.clear();
    known_ = false;
    on_ = true;
  }
  std::vector<hal::SweepSample> end() {
    const std::scoped_lock lock(mutex_);
    on_ = false;
    return samples_;
  }
  void onState(const dds::ActuationState& state) {
    const std::scoped_lock lock(mutex_);
    if (!on_)
      return;
    position_ = state.position[index_];
    setpoint_ = state.setpoint[index_];
    known_ = true;
  }
  void onHal(const dds::HalStatus& hal) {
    const std::scoped_lock lock(mutex_);
    if (!on_ || !known_)
      return;
    const double now = 1e-9 * static_cast<double>(hal.stamp);
    samples_.push_back({now, setpoint_, position_, hal.following_error[index_], hal.encoder_difference[index_]});
  }

 private:
  std::mutex mutex_;
  std::size_t index_ = 0;
  bool on_ = false, known_ = false;
  double position_ = 0.0, setpoint_ = 0.0;
  std::vector<hal::SweepSample> samples_;
};

/** The person beside the robot: answers are lines on standard input. */
class Person {
 public:
  /// @throw Failure at the end of the input, or when a signal asks this program to end
  char ask(const std::string& question, const std::string& letters, const runtime::StopSignal& stop) {
    while (true) {
      std::cerr << question << " [" << letters << "] " << std::flush;
      const std::string line = readLine(stop);
      if (line.size() == 1 && letters.find(line[0]) != std::string::npos)
        return line[0];
      std::cerr << "found '" << line << "', expected one letter of " << letters << '\n';
    }
  }

 private:
  std::string readLine(const runtime::StopSignal& stop) {
    for (std::string line; true;) {
      std::array<pollfd, 2> sources{{{STDIN_FILENO, POLLIN, 0}, {stop.fd(), POLLIN, 0}}};
      poll(sources.data(), sources.size(), -1);
      if (sources[1].revents != 0)
        throw Failure(kFailure,
                      "interrupted; the results so far are kept: repeat the command to continue with this axis");
      char letter = 0;
      if (sources[0].revents != 0 && read(STDIN_FILENO, &letter, 1) != 1)
        throw Failure(kFailure,
                      "no answer; the results so far are kept: repeat the command to continue with this axis");
      if (letter == '\n')
        return line;
      if (letter != 0)
        line += letter;
    }
  }
};

/** Moves, asks and measures. */
class Commissioning {
 public:
  Commissioning(const CommissionCommand& options,
                client::Client& client,
                SweepRecorder& recorder,
                const runtime::StopSignal& stop)
      : options_(options), client_(client), recorder_(recorder), stop_(stop) {}

  /// Checks one axis. @return what commissioning.json keeps of it
  Json check(const Candidate& candidate, const config::Deployment& deployment, std::vector<hal::SweepSample>& samples) {
    const double wanted =
        candidate.translation() ? 1e-3 * options_.travel_mm : options_.travel_deg * std::numbers::pi / 180.0;
    const double speed = 0.01 * options_.speed_percent * candidate.axis->velocity;
    const double side = roomierSide(candidate, wanted);
    const auto move = [&](double distance) {
      const double seconds = std::abs(distance) / speed;
      bool done = false;
      try {
        done = jogJoint(client_, deployment,
                        {candidate.arm, candidate.joint, client_.snapshot().state.joint_count[candidate.arm],
                         std::copysign(speed, distance), seconds},
                        [this](double time) { return stop_.waitFor(time) || faulty(); });
      } catch (const client::Refusal&) {
        if (!client_.waitFor(1.0, [](const client::Snapshot& s) { return faulty(s); }))
          throw;
      }
      if (!done)
        throw Failure(kFailure,
                      faulty() ? "the arm is in FAULT: " + faultText(candidate.arm) : "interrupted; the arm stands");
    };
    char answer = 'a';
    while (answer == 'a') {
      std::cerr << fmt::format("{}: moves by {:+.3g} {} at {:.3g} {}/s, {:.0f} s\n", candidate.name,
                               side * candidate.scale() * wanted, candidate.unit(), candidate.scale() * speed,
                               candidate.unit(), wanted / speed);
      move(side * wanted);
      answer = person_.ask(fmt::format("did {} move {}?  y: yes, n: the other way, a: move again, q: quit",
                                       candidate.name, direction(candidate, side)),
                           "ynaq", stop_);
      if (answer == 'a')
        move(-side * wanted);
    }
    if (answer == 'q')
      throw Failure(kFailure, "ended; the results so far are kept: repeat the command to continue with this axis");
    std::cerr << "  measures: back and forth twice, " << fmt::format("{:.0f} s\n", 4.0 * wanted / speed);
    recorder_.begin(dds::jointIndex(candidate.arm, candidate.joint));
    for (const double distance : {-wanted, wanted, -wanted, wanted})
      move(side * distance);
    samples = recorder_.end();
    move(-side * wanted);
    return describeAxis(candidate, hal::evaluateSweep(samples), wanted, answer == 'y');
  }

 private:
  static bool faulty(const client::Snapshot& s) {
    return std::ranges::any_of(s.status.faults, [](auto faults) { return faults != 0; });
  }
  bool faulty() const { return faulty(client_.snapshot()); }
  std::string faultText(std::uint8_t arm) const {
    return safety::describeFaults(client_.snapshot().status.faults[arm]) + "; `tandem can monitor` names the guard";
  }
  /// +1 or -1: where the joint has more room.
  double roomierSide(const Candidate& candidate, double wanted) const {
    const double here = client_.snapshot().state.position[dds::jointIndex(candidate.arm, candidate.joint)];
    const double up = candidate.axis->upper - here, down = here - candidate.axis->lower;
    if (std::max(up, down) < wanted)
      throw Failure(kFailure,
                    fmt::format("{} has {:.3g} {} of room, expected {:.3g}: move it to the middle of its range "
                                "(tandem jog), or choose a shorter travel",
                                candidate.name, candidate.scale() * std::max(up, down), candidate.unit(),
                                candidate.scale() * wanted));
    return up >= down ? 1.0 : -1.0;
  }
  static std::string direction(const Candidate& candidate, double side) {
    if (candidate.translation())
      return side > 0 ? "forward, into the body (+z)" : "back, out of the body (-z)";
    return side > 0 ? "counter-clockwise, seen from the tip (+z)" : "clockwise, seen from the tip (-z)";
  }
  const CommissionCommand& options_;
  client::Client& client_;
  SweepRecorder& recorder_;
  const runtime::StopSignal& stop_;
  Person person_;
};

std::vector<Candidate> candidatesOf(const CommissionCommand& options,
                                    const config::Robot& robot,
                                    const hal::HardwareConfig& hardware) {
  const int only = options.arm.empty() ? -1 : client::armIndex(robot, options.arm);
  std::vector<Candidate> all;
  for (const hal::AxisConfig& axis : hardware.axes) {
    const config::Arm& arm = robot.arms[static_cast<std::size_t>(axis.arm)];
    const bool chosen = (only < 0 || only == axis.arm) &&
                        (options.joint.empty() || client::jointIndex(arm, options.joint) == axis.joint);
    if (chosen)
      all.push_back({static_cast<std::uint8_t>(axis.arm), axis.joint, &axis,
                     arm.name + " " + arm.joint_names[static_cast<std::size_t>(axis.joint)]});
  }
  return all;
}

int commission(const CommissionCommand& options) {
  const runtime::StopSignal stop;
  const config::Deployment deployment = runtime::loadDeployment(options.deployment);
  if (deployment.hardware.empty())
    throw Failure(
        kUsage,
        "deployment " + deployment.name +
            " has no `hardware`; expected a deployment with a hardware file and tandem-hal, see docs/hardware.md");
  const config::Robot robot = config::loadAnyRobot(deployment);
  const hal::HardwareConfig hardware =
      config::loadHardware(deployment.hardware, deployment.budgets.drive_heartbeat, false);
  const std::vector<Candidate> candidates = candidatesOf(options, robot, hardware);
  Findings findings(options.folder,
                    config::fingerprintText(config::fingerprintOf(config::valuesOfFiles(deployment), 0)),
                    options.again);
  SweepRecorder recorder;
  client::Client::Callbacks callbacks;
  callbacks.state = [&](const dds::ActuationState& state) { recorder.onState(state); };
  callbacks.hal = [&](const dds::HalStatus& hal) { recorder.onHal(hal); };
  client::Client client(deployment, callbacks);
  client.connect(10.0);
  client.setSilenceLimit(2.0 + 3.0 * deployment.control_period);
  client.acquireLease();
  client.stateCommand("enable");
  Commissioning commissioning(options, client, recorder, stop);
  std::size_t number = 0;
  try {
    for (const Candidate& candidate : candidates) {
      ++number;
      if (findings.passed(candidate.name)) {
        std::cerr << candidate.name << ": is done (--again checks it once more)\n";
        continue;
      }
      std::cerr << "axis " << number << " of " << candidates.size() << '\n';
      std::vector<hal::SweepSample> samples;
      const Json found = commissioning.check(candidate, deployment, samples);
      findings.add(candidate, found, samples);
      for (const auto& problem : found["problems"])
        std::cerr << "  PROBLEM: " << problem.get<std::string>() << '\n';
    }
  } catch (...) {
    client::endCommand(client);
    throw;
  }
  client.stateCommand("disable");
  client.releaseLease();
  findings.finish(deployment.hardware, hardware, candidates);
  if (options.figure.wanted())
    drawFigures("commissioning.py", {options.folder, options.figure.path}, options.figure);
  const bool good = std::ranges::all_of(candidates, [&](const Candidate& c) { return findings.passed(c.name); });
  answer(findings.report(), findings.json());
  return good ? kOk : kFailure;
}

}  // namespace

void registerCommission(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CommissionCommand>();
  CLI::App* command = app.add_subcommand(
      "commission", "check direction, following error, free travel and gearing of each axis of a new arm");
  command->add_option("-d,--deployment", options->deployment, "deployment file or preset")->capture_default_str();
  command->add_option("-a,--arm", options->arm, "one arm only");
  command->add_option("--joint", options->joint, "one joint only: beta_1 ... alpha_n");
  command->add_option("--travel-mm", options->travel_mm, "travel of translations")
      ->capture_default_str()
      ->check(CLI::Range(0.05, 50.0));
  command->add_option("--travel-deg", options->travel_deg, "travel of rotations")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 180.0));
  command->add_option("--speed-percent", options->speed_percent, "speed, as share of the axis' `velocity`")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 100.0));
  command->add_option("-o,--out", options->folder, "folder of the results; a second call continues from them")
      ->capture_default_str();
  command->add_flag("--again", options->again, "check all axes, also those that have passed");
  addFigureOption(*command, options->figure, "draw following errors and free travel over the position");
  command->footer(
      "Stand beside the arm, with a hand at the emergency stop. One joint moves at a time; after each motion you say\n"
      "whether it went the right way. Exit code 1: an axis has a problem; report.md in the folder names it.");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return commission(*options); }); });
}

}  // namespace tandem::cli
