// SPDX-License-Identifier: Apache-2.0
#include "services/client/run_summary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "config/arm_names.h"
#include "planning/follower.h"

namespace tandem::client {
namespace {

template <class... Values>
std::string format(const char* text, Values... values) {
  std::array<char, 200> line{};
  std::snprintf(line.data(), line.size(), text, values...);
  return line.data();
}

/** Unit of errors: the ending of their keys, and what texts say. */
struct Unit {
  const char *key, *name;
  double per_si;
};
/// In the order of kinematics::TaskUnit.
constexpr std::array kUnits{Unit{"_m", "mm", 1e3}, Unit{"_rad", "deg", 180.0 / M_PI},
                            Unit{"_stability", "stability", 1.0}};

/// Ending of the keys of a task's errors. @param task  index, below task_count
const char* unitOf(const dds::RunSummary& summary, std::size_t task) {
  const auto* kind = kinematics::findTaskKind(static_cast<planning::TaskKind>(summary.task_kind[task]));
  return kUnits[kind == nullptr ? 0 : static_cast<std::size_t>(kind->unit)].key;
}

/// "relative position of arm_a and arm_b".
std::string describeTask(const dds::RunSummary& summary, std::size_t task, const config::Robot& robot) {
  planning::TaskReference reference;
  reference.kind = static_cast<planning::TaskKind>(summary.task_kind[task]);
  reference.arm = summary.task_arm[task];
  reference.other_arm = summary.task_other_arm[task];
  return describe(reference, config::armList(robot));
}

}  // namespace

nlohmann::ordered_json summaryJson(const dds::RunSummary& summary, const config::Robot& robot) {
  nlohmann::ordered_json json{{"name", summary.name},
                              {"phase", planning::name(static_cast<planning::Phase>(summary.phase))},
                              {"reason", summary.reason},
                              {"points", summary.points},
                              {"reached", summary.reached},
                              {"iterations", summary.iterations},
                              {"duration_s", summary.duration},
                              {"tasks", nlohmann::ordered_json::array()},
                              {"gate_interventions", summary.gate_interventions},
                              {"limits", nlohmann::ordered_json::array()}};
  if (std::isfinite(summary.least_clearance))
    json["least_clearance_m"] = summary.least_clearance;
  for (std::size_t k = 0; k < summary.task_count; ++k) {
    const std::string unit = unitOf(summary, k);
    json["tasks"].push_back({{"task", describeTask(summary, k, robot)},
                             {"rms" + unit, summary.rms[k]},
                             {"percentile_95" + unit, summary.percentile_95[k]},
                             {"maximum" + unit, summary.maximum[k]}});
  }
  for (std::size_t k = 0; k < std::min(summary.limits.size(), summary.limit_shares.size()); ++k)
    json["limits"].push_back({{"limit", summary.limits[k]}, {"share", summary.limit_shares[k]}});
  return json;
}

bool summaryIsDue(const Snapshot& snapshot) {
  const auto phase = static_cast<planning::Phase>(snapshot.reference.phase);
  return (phase == planning::Phase::kFinished || phase == planning::Phase::kFailed) &&
         (snapshot.summaries == 0 || snapshot.summary.trajectory_id != snapshot.reference.trajectory_id);
}

std::string describeEnd(const nlohmann::ordered_json& summary) {
  const auto reason = summary["reason"].get<std::string>();
  return summary["name"].get<std::string>() + ' ' + summary["phase"].get<std::string>() +
         (reason.empty() ? "" : ": " + reason) + '\n';
}

std::string describeSummary(const nlohmann::ordered_json& summary) {
  std::string text;
  const auto millimetres = [](const nlohmann::ordered_json& metres) { return 1e3 * metres.get<double>(); };
  for (const auto& task : summary["tasks"]) {
    const auto found =
        std::ranges::find_if(kUnits, [&](const Unit& one) { return task.contains(std::string("rms") + one.key); });
    const Unit& unit = found == kUnits.end() ? kUnits[0] : *found;
    const auto value = [&](const std::string& key) {
      return task[key + unit.key].template get<double>() * unit.per_si;
    };
    text += format("  error, %s: RMS %.3f, 95 %% within %.3f, maximum %.3f %s\n",
                   task["task"].template get<std::string>().c_str(), value("rms"), value("percentile_95"),
                   value("maximum"), unit.name);
  }
  text += format("  points reached: %u of %u; time %.1f s; gate: %llu interventions\n",
                 summary["reached"].get<unsigned>(), summary["points"].get<unsigned>(),
                 summary["duration_s"].get<double>(), summary["gate_interventions"].get<unsigned long long>());
  if (summary.contains("least_clearance_m")) {
    const double least = millimetres(summary["least_clearance_m"]);
    text += least < 0.0 ? format("  WARNING: bodies overlapped by up to %.3f mm\n", -least)
                        : format("  least distance of bodies: %.3f mm\n", least);
  }
  for (const auto& limit : summary["limits"])
    text += format("  %s restricted the motion in %.3g %% of the control periods\n",
                   limit["limit"].get<std::string>().c_str(), 100.0 * limit["share"].get<double>());
  return text;
}

}  // namespace tandem::client
