// SPDX-License-Identifier: Apache-2.0
/** @file tandem commission: checks the axes of a new arm one after the other, with the person who stands beside it. */
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iostream>
#include <mutex>
#include <numbers>

#include "config/axis_block.h"
#include "config/robot_files.h"
#include "config/values.h"
#include "hal/drives/axis_sweep.h"
#include "safety/faults.h"
#include "services/cli/models/figure.h"
#include "services/cli/robot/axis_motion.h"
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

/** One axis to be checked. */
struct Candidate {
  std::uint8_t arm = 0;
  int joint = 0;
  const hal::AxisConfig* axis = nullptr;
  std::string name;  ///< "arm_a beta_1"
  bool translation() const { return axis->translation; }
  double scale() const { return translation() ? 1e3 : 180.0 / std::numbers::pi; }
  const char* unit() const { return translation() ? "mm" : "deg"; }
};

/** Samples of one joint, taken from hal/status while it is switched on. */
class SweepRecorder {
 public:
  void begin(std::size_t index) {
    const std::scoped_lock lock(mutex_);
    index_ = index;
    samples_.clear();
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

/** Asks the person beside the robot; answers are lines on standard input. */
char ask(const std::string& question, const std::string& letters) {
  for (std::string line; true;) {
    std::cerr << question << " [" << letters << "] " << std::flush;
    if (!std::getline(std::cin, line))
      throw Failure(kFailure, "no answer; what is done is kept: the same command goes on from here");
    if (line.size() == 1 && letters.find(line[0]) != std::string::npos)
      return line[0];
    std::cerr << "found '" << line << "', expected one letter of " << letters << '\n';
  }
}

/** The folder with what was found: commissioning.json, a CSV file for each axis, report.md, figure, hardware file. */
class Findings {
 public:
  Findings(const std::filesystem::path& folder, const std::string& fingerprint, bool again) : folder_(folder) {
    std::filesystem::create_directories(folder);
    std::ifstream stream(folder / "commissioning.json");
    if (stream && !again)
      json_ = Json::parse(stream, nullptr, false);
    if (!json_.is_object() || json_.value("fingerprint", "") != fingerprint) {
      if (json_.is_object() && json_.contains("axes"))
        std::cerr << "the robot or hardware file has changed since " << (folder / "commissioning.json").string()
                  << ": all axes are checked again\n";
      json_ = {{"fingerprint", fingerprint}, {"axes", Json::object()}};
    }
  }
  bool passed(const std::string& axis) const {
    return json_["axes"].contains(axis) && json_["axes"][axis].value("problems", Json::array({""})).empty();
  }
  void add(const Candidate& candidate, const Json& found, const std::vector<hal::SweepSample>& samples) {
    std::string name = candidate.name;
    std::ranges::replace(name, ' ', '_');
    std::ofstream csv(folder_ / (name + ".csv"));
    csv << "time_s,setpoint_" << candidate.unit() << ",position_" << candidate.unit() << ",following_error_"
        << candidate.unit() << ",encoder_difference_" << candidate.unit() << '\n';
    for (const hal::SweepSample& s : samples)
      csv << fmt::format("{:.6f},{:.9g},{:.9g},{:.9g},{:.9g}\n", s.time - samples.front().time,
                         candidate.scale() * s.setpoint, candidate.scale() * s.position,
                         candidate.scale() * s.following_error, candidate.scale() * s.encoder_difference);
    json_["axes"][candidate.name] = found;
    const std::filesystem::path file = folder_ / "commissioning.json", next = folder_ / "commissioning.json.next";
    std::ofstream(next) << json_.dump(2) << '\n';
    std::filesystem::rename(next, file);
  }
  const Json& json() const { return json_; }
  const std::filesystem::path& folder() const { return folder_; }

 private:
  std::filesystem::path folder_;
  Json json_;
};

Json numberOrNull(double value) { return std::isfinite(value) ? Json(value) : Json(); }

/// What is wrong with an axis by its measurement, for people.
std::vector<std::string> problemsOf(const Candidate& candidate, const hal::SweepResult& found, double wanted) {
  constexpr double kLeastTravel = 0.8, kGearing = 0.02, kWindow = 0.5;
  const hal::AxisConfig& axis = *candidate.axis;
  const auto shown = [&](double value) {
    return fmt::format("{:.3g} {}", candidate.scale() * value, candidate.unit());
  };
  std::vector<std::string> problems;
  if (found.travel < kLeastTravel * wanted)
    problems.push_back("it travelled " + shown(found.travel) + " of " + shown(wanted) +
                       ": a limit, of other joints too, or a short measurement");
  if (std::abs(found.encoder_ratio - 1.0) > kGearing)
    problems.push_back(
        fmt::format("its encoder travels {:.3f} times as far as its drive: check counts_per_revolution, "
                    "gear_ratio and lead of both, and encoder_reversed",
                    found.encoder_ratio));
  if (found.following_max > kWindow * axis.following_error)
    problems.push_back("it follows with an error of " + shown(found.following_max) +
                       ", more than half of following_error");
  if (axis.encoder && found.backlash > axis.encoder->tolerance)
    problems.push_back("its free travel of " + shown(found.backlash) + " exceeds the encoder's tolerance");
  return problems;
}

std::string reportOf(const Json& json) {
  std::string text =
      "# Commissioning\n\n| axis | direction | travel | following error, largest | free travel | encoder / drive | "
      "problems |\n|---|---|---|---|---|---|---|\n";
  for (const auto& [name, axis] : json["axes"].items()) {
    const auto number = [&](const char* key, const std::string& unit) {
      return axis[key].is_null() ? std::string("not known") : fmt::format("{:.4g}{}", axis[key].get<double>(), unit);
    };
    const std::string unit = " " + axis["unit"].get<std::string>();
    std::string problems;
    for (const auto& problem : axis["problems"])
      problems += (problems.empty() ? "" : "; ") + problem.get<std::string>();
    text += "| " + name + " | " + axis["direction"].get<std::string>() + " | " + number("travel", unit) + " | " +
            number("following_max", unit) + " | " + number("backlash", unit) + " | " + number("encoder_ratio", "") +
            " | " + (problems.empty() ? "none" : problems) + " |\n";
  }
  return text;
}

/** Moves, asks and measures. */
class Commissioning {
 public:
  Commissioning(const CommissionCommand& options, client::Client& client, SweepRecorder& recorder)
      : options_(options), client_(client), recorder_(recorder) {}

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
      answer = ask(fmt::format("did {} move {}?  y: yes, n: the other way, a: move again, q: quit", candidate.name,
                               direction(candidate, side)),
                   "ynaq");
      if (answer == 'a')
        move(-side * wanted);
    }
    if (answer == 'q')
      throw Failure(kFailure, "ended; what is done is kept: the same command goes on from here");
    std::cerr << "  measures: back and forth twice, " << fmt::format("{:.0f} s\n", 4.0 * wanted / speed);
    recorder_.begin(dds::jointIndex(candidate.arm, candidate.joint));
    for (const double distance : {-wanted, wanted, -wanted, wanted})
      move(side * distance);
    samples = recorder_.end();
    move(-side * wanted);
    return describe(candidate, hal::evaluateSweep(samples), wanted, answer == 'y');
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
  static Json describe(const Candidate& candidate, const hal::SweepResult& found, double wanted, bool right_way) {
    std::vector<std::string> problems = problemsOf(candidate, found, wanted);
    if (!right_way)
      problems.insert(problems.begin(), std::string("it moves the wrong way: set `reversed: ") +
                                            (candidate.axis->gearing.reversed ? "false" : "true") +
                                            "`, and check encoder_reversed");
    const bool encoder = candidate.axis->encoder.has_value();
    return {{"unit", candidate.unit()},
            {"direction", right_way ? "right" : "wrong"},
            {"travel", candidate.scale() * found.travel},
            {"following_max", candidate.scale() * found.following_max},
            {"following_mean", candidate.scale() * found.following_mean},
            {"backlash", encoder ? numberOrNull(candidate.scale() * found.backlash) : Json()},
            {"encoder_ratio", encoder ? numberOrNull(found.encoder_ratio) : Json()},
            {"problems", problems}};
  }

  const CommissionCommand& options_;
  client::Client& client_;
  SweepRecorder& recorder_;
  runtime::StopSignal stop_;
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

/// The hardware file with the directions that were found wrong turned round.
void writeHardware(const config::Deployment& deployment,
                   const std::vector<Candidate>& candidates,
                   const hal::HardwareConfig& hardware,
                   const Findings& findings) {
  std::vector<const hal::AxisConfig*> wrong;
  for (const Candidate& candidate : candidates) {
    const auto found = findings.json()["axes"].find(candidate.name);
    if (found != findings.json()["axes"].end() && (*found)["direction"] == "wrong")
      wrong.push_back(candidate.axis);
  }
  if (wrong.empty())
    return;
  const std::filesystem::path file = findings.folder() / "hardware.yaml";
  std::ofstream(file) << config::withDirectionsReversed(deployment.hardware, hardware, wrong);
  std::cerr << file.string() << ": the hardware file with " << wrong.size()
            << " directions turned round; compare it, use it, and check these axes again\n";
}

int commission(const CommissionCommand& options) {
  const config::Deployment deployment = runtime::loadDeployment(options.deployment);
  if (deployment.hardware.empty())
    throw Failure(kUsage,
                  "deployment " + deployment.name + " has no `hardware`: expected one with tandem-hal and drives");
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
  Commissioning commissioning(options, client, recorder);
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
  std::ofstream(findings.folder() / "report.md") << reportOf(findings.json());
  writeHardware(deployment, candidates, hardware, findings);
  if (options.figure.wanted())
    drawFigures("commissioning.py", {findings.folder().string(), options.figure.path}, options.figure);
  const bool good = std::ranges::all_of(candidates, [&](const Candidate& c) { return findings.passed(c.name); });
  answer(reportOf(findings.json()), findings.json());
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
  command->add_option("-o,--out", options->folder, "folder of the results; a second call goes on with them")
      ->capture_default_str();
  command->add_flag("--again", options->again, "check all axes, also those that have passed");
  addFigureOption(*command, options->figure, "draw following errors and free travel over the position");
  command->footer(
      "Stand beside the arm, with a hand at the emergency stop. One joint moves at a time; after each motion you say\n"
      "whether it went the right way. Exit code 1: an axis has a problem; report.md in the folder names it.");
  command->callback([options, &exit_code] { guarded(exit_code, [&] { return commission(*options); }); });
}

}  // namespace tandem::cli
