// SPDX-License-Identifier: Apache-2.0
#include "services/cli/robot/status_print.h"

#include <array>
#include <cstdio>
#include <iostream>
#include <string>

#include "services/cli/robot/processes.h"
#include "services/client/diagnostic_details.h"
#include "services/client/lost_protections.h"
#include "services/client/run_summary.h"
#include "services/client/unconfirmed_positions.h"

namespace tandem::cli {
namespace {

/// Remaining time of an arm with power and without a commander; empty for other arms, and in the first seconds.
std::string describeIdle(double idle, double left) {
  constexpr double kMention = 5.0;  // s
  if (idle < kMention)
    return "";
  std::array<char, 100> text{};
  if (left < 0.0)
    std::snprintf(text.data(), text.size(), "\n    has had power without a commander for %.0f s", idle);
  else
    std::snprintf(text.data(), text.size(), "\n    not commanded: power off in %.0f s", left);
  return text.data();
}

std::string describeRecovery(bool recovering, const std::string& without) {
  if (!recovering)
    return "";
  return ", being recovered" + (without.empty() ? "" : " without " + without);
}

}  // namespace

void printStatus(const nlohmann::ordered_json& json) {
  std::cout << json["deployment"].get<std::string>() << " in domain " << json["domain"] << ", prefix "
            << json["prefix"].get<std::string>() << ", robot " << json["robot"].get<std::string>() << ", method "
            << json["method"].get<std::string>() << ", " << json["model"].get<std::string>() << " model, feedback "
            << json["feedback"].get<std::string>() << ", lease "
            << (json["lease_owner"].get<std::uint64_t>() == 0 ? "free" : "in use") << ", moved by "
            << json["source"].get<std::string>() << '\n';
  if (json["emergency_stop"] == "pressed")
    std::cout << "  EMERGENCY STOP pressed: release it, then disable\n";
  for (const auto& arm : json["arms"]) {
    std::cout << "  " << arm["name"].get<std::string>() << ": " << arm["operating_state"].get<std::string>()
              << (arm["is_homed"].get<bool>() ? ", homed" : "") << (arm["is_busy"].get<bool>() ? ", busy" : "")
              << describeRecovery(arm["is_recovering"].get<bool>(), arm["without"].get<std::string>())
              << ", faults: " << arm["faults"].get<std::string>();
    std::cout << describeIdle(arm["idle_s"].get<double>(), arm["idle_left_s"].get<double>());
    if (const auto drive = arm["drive_fault"].get<std::string>(); !drive.empty())
      std::cout << "\n    drives: " << drive;
    if (arm["plant_snaps"].get<unsigned>() > 0)
      std::printf("\n    snaps of the plant: %u, released %.3g mJ, longest way of the tip %.2f mm",
                  arm["plant_snaps"].get<unsigned>(), 1e3 * arm["plant_snap_energy_J"].get<double>(),
                  1e3 * arm["plant_snap_distance_m"].get<double>());
    std::fflush(stdout);
    std::cout << "\n    joints (m, rad):";
    for (double q : arm["joints"])
      std::printf(" %.5f", q);
    if (!arm["tip_m"].is_null())
      std::printf("\n    tip (mm): %.3f %.3f %.3f", 1e3 * arm["tip_m"][0].get<double>(),
                  1e3 * arm["tip_m"][1].get<double>(), 1e3 * arm["tip_m"][2].get<double>());
    std::fflush(stdout);
    std::cout << '\n';
  }
  const auto& t = json["trajectory"];
  std::cout << "  trajectory: " << t["phase"].get<std::string>() << ", point " << t["point"] << " of " << t["points"]
            << ", " << t["iterations"] << " iterations\n";
  if (const auto& errors = json["errors_m"]; !errors.empty()) {
    std::printf("  errors of the tasks, mm:");
    for (const auto& error : errors)
      std::printf(" %.3f", 1e3 * error.get<double>());
    std::printf("\n");
    std::fflush(stdout);
  }
  if (json.contains("last_run"))
    std::cout << "  last run: " << client::describeEnd(json["last_run"]) << client::describeSummary(json["last_run"]);
  if (const auto hold = json["hold"].get<std::string>(); !hold.empty())
    std::cout << "  held: " << hold << '\n';
  if (const auto& limits = json["limits"]["limits"]; !limits.empty()) {
    std::string text;
    for (const auto& limit : limits)
      text += (text.empty() ? "" : ", ") + limit["description"].get<std::string>();
    std::cout << "  limits " << json["limits"]["how"].get<std::string>() << ": " << text << '\n';
  }
  for (const auto& body : json["clearance"])
    std::printf("  %s to %s: %.3f mm%s\n", body["arm"].get<std::string>().c_str(),
                body["other"].get<std::string>().c_str(), 1e3 * body["distance_m"].get<double>(),
                body["distance_m"].get<double>() < 0.0 ? ": they overlap" : "");
  std::fflush(stdout);
  const auto& c = json["control"];
  std::printf(
      "  control: period %.4g s, %llu cycles, %llu overruns, latest wake-up %.1f us late, longest cycle %.1f us\n",
      c["period_s"].get<double>(), static_cast<unsigned long long>(c["cycles"].get<std::uint64_t>()),
      static_cast<unsigned long long>(c["overruns"].get<std::uint64_t>()), 1e6 * c["jitter_max_s"].get<double>(),
      1e6 * c["cycle_time_max_s"].get<double>());
  std::printf("  arrived of the last 100:");
  for (const auto& [what, share] : json["success"].items())
    std::printf(" %s %.0f", what.c_str(), 100.0 * share.get<double>());
  std::printf("\n");
  if (json.contains("silent") && !json["silent"].empty()) {
    std::printf("  no recent message from (values shown are old):");
    for (const auto& who : json["silent"])
      std::printf(" %s", who.get<std::string>().c_str());
    std::printf("\n");
  }
  std::printf("  guards:");
  bool intervened = false;
  for (const auto& [name, count] : json["guards"].items()) {
    if (count.get<std::uint64_t>() > 0) {
      std::printf(" %s %llu", name.c_str(), static_cast<unsigned long long>(count.get<std::uint64_t>()));
      intervened = true;
    }
  }
  if (!intervened)
    std::printf(" none");
  std::printf("\n");
  std::fputs(client::describeLost(json["lost_protections"], "  ").c_str(), stdout);
  std::fputs(client::describeUnconfirmed(json["unconfirmed"], "  ").c_str(), stdout);
  std::fputs(client::describeFailed(json["failed"], "  ").c_str(), stdout);
  for (const auto& [service, topics] : json["dropped"].items()) {
    for (const auto& [topic, what] : topics.items())
      std::printf("  malformed samples dropped by %s: %s: %s\n", service.c_str(), topic.c_str(),
                  what.get<std::string>().c_str());
  }
  printProcesses(json);
  if (json.contains("warning"))
    std::printf("  %s\n", json["warning"].get<std::string>().c_str());
}

}  // namespace tandem::cli
