// SPDX-License-Identifier: Apache-2.0
#include "services/cli/robot/status_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "idl/enumerations.h"
#include "services/client/diagnostic_details.h"

namespace tandem::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char *kRed = "31", *kGreen = "32", *kYellow = "33", *kBold = "1";

std::string coloured(const std::string& text, const char* colour, bool colours) {
  return colours ? fmt::format("\x1b[{}m{}\x1b[0m", colour, text) : text;
}

std::string text(const Json& json, const char* key) { return json[key].get<std::string>(); }

const char* colourOf(const std::string& state) {
  return state == "ENABLED" ? kGreen : state == "PAUSED" ? kYellow : state == "FAULT" ? kRed : kBold;
}

std::string armLine(const Json& arm, bool colours) {
  const std::string state = text(arm, "operating_state"), faults = text(arm, "faults");
  std::string tip = fmt::format("{:>24}", "not known");
  if (!arm["tip_m"].is_null())
    tip = fmt::format("{:>8.2f}{:>8.2f}{:>8.2f}", 1e3 * arm["tip_m"][0].get<double>(),
                      1e3 * arm["tip_m"][1].get<double>(), 1e3 * arm["tip_m"][2].get<double>());
  std::string notes = arm["is_homed"].get<bool>() ? "" : "not homed";
  if (arm["is_recovering"].get<bool>())
    notes += (notes.empty() ? "" : ", ") + std::string("recovering");
  if (faults != "none")
    notes += (notes.empty() ? "" : ", ") + coloured(faults, kRed, colours);
  return fmt::format("{:<16}{}{}  {}\n", text(arm, "name"),
                     coloured(fmt::format("{:<10}", state), colourOf(state), colours), tip, notes);
}

std::string list(const Json& items, const char* format) {
  std::string all;
  for (const Json& item : items)
    all += fmt::format(fmt::runtime(format), 1e3 * item.get<double>());
  return all;
}

/// Lines that are there only when they matter.
std::string warnings(const Json& json, bool colours) {
  std::string all;
  const auto warn = [&](const std::string& line, const char* colour) { all += coloured(line, colour, colours) + '\n'; };
  if (text(json, "emergency_stop") == "pressed")
    warn("EMERGENCY STOP pressed: release it, then disable", kRed);
  for (const Json& arm : json["arms"]) {
    if (!text(arm, "drive_fault").empty())
      warn(text(arm, "name") + ": drives: " + text(arm, "drive_fault"), kRed);
  }
  all += coloured(client::describeFailed(json["failed"], ""), kRed, colours);
  for (const Json& body : json["clearance"]) {
    if (body["distance_m"].get<double>() < 0.0)
      warn(fmt::format("{} and {} overlap by {:.3f} mm", text(body, "arm"), text(body, "other"),
                       -1e3 * body["distance_m"].get<double>()),
           kRed);
  }
  if (!text(json, "hold").empty())
    warn("held: " + text(json, "hold"), kYellow);
  std::string limits;
  for (const Json& limit : json["limits"]["limits"])
    limits += (limits.empty() ? "" : ", ") + text(limit, "description");
  if (!limits.empty())
    warn("limits " + text(json["limits"], "how") + ": " + limits, kYellow);
  std::string silent;
  for (const Json& who : json["silent"])
    silent += " " + who.get<std::string>();
  if (!silent.empty())
    warn("no recent message from (values shown are old):" + silent, kRed);
  return all;
}

}  // namespace

void TimeLeft::see(const Json& json, double now) {
  const Json& trajectory = json["trajectory"];
  follows_ = trajectory["phase"] == idl::name(idl::Phase::kRunning);
  const auto id = trajectory["id"].get<std::uint64_t>();
  const int point = trajectory["point"].get<int>();
  if (!follows_ || id != id_ || point < point_) {
    id_ = id;
    first_point_ = point;
    began_ = now;
    passed_ = now;
  } else if (point > point_) {
    passed_ = now;
  }
  point_ = point;
  points_ = trajectory["points"].get<int>();
}

std::string TimeLeft::text() const {
  if (!follows_ || point_ < first_point_ + 2 || passed_ <= began_)
    return {};
  const double each = (passed_ - began_) / (point_ - first_point_);
  return fmt::format("about {:.0f} s left", std::ceil(each * std::max(0, points_ - point_)));
}

std::string statusTable(const Json& json, const std::string& time_left, bool colours) {
  std::string all =
      coloured(text(json, "deployment"), kBold, colours) +
      fmt::format(": {}, {}, {} model, lease {}, moved by {}\n\n", text(json, "robot"), text(json, "method"),
                  text(json, "model"), json["lease_owner"].get<std::uint64_t>() == 0 ? "free" : "in use",
                  text(json, "source"));
  all += coloured(fmt::format("{:<16}{:<10}{:>8}{:>8}{:>8}", "arm", "state", "x", "y", "z mm"), kBold, colours) + '\n';
  for (const Json& arm : json["arms"])
    all += armLine(arm, colours);
  const Json& trajectory = json["trajectory"];
  all +=
      fmt::format("\ntrajectory: {}, point {} of {}{}{}\n", text(trajectory, "phase"), trajectory["point"].get<int>(),
                  trajectory["points"].get<int>(), time_left.empty() ? "" : ", ", time_left);
  if (!json["errors_m"].empty())
    all += "errors of the tasks, mm:" + list(json["errors_m"], " {:.3f}") + '\n';
  return all + warnings(json, colours);
}

}  // namespace tandem::cli
