// SPDX-License-Identifier: Apache-2.0
#include "services/cli/robot/commission_findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>

#include "config/axis_block.h"

namespace tandem::cli {
namespace {

using Json = nlohmann::ordered_json;

Json numberOrNull(double value) { return std::isfinite(value) ? Json(value) : Json(); }

/// Descriptions of the problems that the measurement of an axis shows; empty: none.
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

}  // namespace

Json describeAxis(const Candidate& candidate, const hal::SweepResult& found, double wanted, bool right_way) {
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

Findings::Findings(const std::filesystem::path& folder, const std::string& fingerprint, bool again) : folder_(folder) {
  std::filesystem::create_directories(folder);
  std::ifstream stream(folder / "commissioning.json");
  if (stream && !again)
    json_ = Json::parse(stream, nullptr, false);
  const bool readable = json_.is_object() && json_.value("axes", Json()).is_object();
  if (!readable || json_.value("fingerprint", "") != fingerprint) {
    if (stream && !again)
      std::cerr << (folder / "commissioning.json").string()
                << (readable ? ": the robot or hardware file has changed since" : ": found no results of this command")
                << "; all axes are checked again\n";
    json_ = {{"fingerprint", fingerprint}, {"axes", Json::object()}};
  }
}

bool Findings::passed(const std::string& axis) const {
  return json_["axes"].contains(axis) && json_["axes"][axis].value("problems", Json::array({""})).empty();
}

void Findings::add(const Candidate& candidate, const Json& found, const std::vector<hal::SweepSample>& samples) {
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

std::string Findings::report() const {
  std::string text =
      "# Commissioning\n\n| axis | direction | travel | following error, largest | free travel | encoder / drive | "
      "problems |\n|---|---|---|---|---|---|---|\n";
  for (const auto& item : json_["axes"].items()) {
    const Json& axis = item.value();
    const auto number = [&](const char* key, const std::string& unit) {
      return axis[key].is_null() ? std::string("not known") : fmt::format("{:.4g}{}", axis[key].get<double>(), unit);
    };
    const std::string unit = " " + axis["unit"].get<std::string>();
    std::string problems;
    for (const auto& problem : axis["problems"])
      problems += (problems.empty() ? "" : "; ") + problem.get<std::string>();
    text += "| " + item.key() + " | " + axis["direction"].get<std::string>() + " | " + number("travel", unit) + " | " +
            number("following_max", unit) + " | " + number("backlash", unit) + " | " + number("encoder_ratio", "") +
            " | " + (problems.empty() ? "none" : problems) + " |\n";
  }
  return text;
}

void Findings::finish(const std::filesystem::path& hardware_file,
                      const hal::HardwareConfig& hardware,
                      const std::vector<Candidate>& candidates) const {
  std::ofstream(folder_ / "report.md") << report();
  std::vector<const hal::AxisConfig*> wrong;
  for (const Candidate& candidate : candidates) {
    const auto found = json_["axes"].find(candidate.name);
    if (found != json_["axes"].end() && (*found)["direction"] == "wrong")
      wrong.push_back(candidate.axis);
  }
  if (wrong.empty())
    return;
  const std::filesystem::path file = folder_ / "hardware.yaml";
  std::ofstream(file) << config::withDirectionsReversed(hardware_file, hardware, wrong);
  std::cerr << file.string() << ": the hardware file with " << wrong.size()
            << (wrong.size() == 1 ? " direction" : " directions")
            << " turned round; compare it, use it, and check these axes again\n";
}

}  // namespace tandem::cli
