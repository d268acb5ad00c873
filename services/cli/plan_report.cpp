// SPDX-License-Identifier: Apache-2.0
#include "services/cli/plan_report.h"

#include <cmath>
#include <cstdio>
#include <iostream>

#include "services/cli/plan_setup.h"

namespace tandem::cli {

using Json = nlohmann::ordered_json;

namespace {

Json pointJson(const planning::PointReport& point) {
  return {{"point", point.point},
          {"reason", planning::name(point.reach)},
          {"words", point.words},
          {"error_m", point.error},
          {"relative_error_m", point.relative_error},
          {"wanted_m", listOf(point.wanted.tip)},
          {"nearest_m", listOf(point.tip)}};
}

}  // namespace

Json reportJson(const planning::FeasibilityReport& report) {
  Json json{{"feasible", report.feasible},         {"start", report.start},
            {"planar_start", report.planar_start}, {"rotation_conditioning_m_per_rad", report.rotation_conditioning},
            {"points", report.points.size()},      {"unreachable", Json::array()}};
  double stability = 1.0, clearance = INFINITY;
  for (const planning::PointReport& point : report.points) {
    stability = std::min(stability, point.stability);
    clearance = std::min(clearance, point.clearance);
    if (point.reach != planning::Reach::kReached)
      json["unreachable"].push_back(pointJson(point));
  }
  json["smallest_stability"] = stability;
  json["smallest_clearance_m"] = std::isfinite(clearance) ? Json(clearance) : Json();
  return json;
}

void print(const planning::FeasibilityReport& report) {
  if (!report.start.empty()) {
    std::cout << "not feasible: " << report.start << '\n';
    return;
  }
  if (report.planar_start) {
    std::cout << "note: an arm starts with all tubes bent in one plane, where rotations move its tip across that plane "
                 "only; inward in the plane, control first turns its tubes a little apart\n";
  }
  for (const planning::PointReport& point : report.points) {
    if (point.reach != planning::Reach::kReached)
      std::cout << "point " << point.point << ": " << point.words << '\n';
  }
  if (report.feasible)
    std::printf("feasible: all %zu points\n", report.points.size());
  else
    std::printf("not feasible: %d of %zu points\n", report.unreachable(), report.points.size());
}

Json rehearsalJson(const planning::Rehearsal& rehearsal) {
  return {{"end", planning::name(rehearsal.end)},
          {"points", rehearsal.points},
          {"converged", rehearsal.converged},
          {"point", rehearsal.point},
          {"tip_error_m", rehearsal.tip_error},
          {"relative_error_m", rehearsal.relative_error},
          {"held_by", rehearsal.held},
          {"words", rehearsal.words},
          {"iterations", rehearsal.iterations}};
}

void print(const planning::Rehearsal& rehearsal, std::string_view method, const char* how) {
  if (rehearsal.end == planning::RehearsalEnd::kCompleted)
    std::printf("rehearsal %s: %.*s completes in %d iterations\n", how, static_cast<int>(method.size()), method.data(),
                rehearsal.iterations);
  else
    std::printf("rehearsal %s: %d of %d points; %s\n", how, rehearsal.converged, rehearsal.points,
                rehearsal.words.c_str());
}

}  // namespace tandem::cli
