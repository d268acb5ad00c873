// SPDX-License-Identifier: Apache-2.0
#include "services/cli/plan/plan_print.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <ostream>

#include "services/computation/reports.h"

namespace tandem::cli {
namespace {

using Json = nlohmann::ordered_json;

using computation::reached;

Json pointJson(const dds::PointReport& point) {
  return {{"point", point.point},
          {"reach", planning::name(static_cast<planning::Reach>(point.reach))},
          {"reason", point.reason},
          {"error_m", point.error},
          {"relative_error_m", point.relative_error},
          {"wanted_m", point.wanted},
          {"nearest_m", point.tip}};
}

std::string placeOf(int point) { return point > 0 ? "point " + std::to_string(point) : "the start"; }

/// A soft task.
void printSoft(const planning::TaskFreedom& one, const std::vector<std::string>& arms, std::ostream& out) {
  const bool metres = kinematics::findTaskKind(one.task.kind)->unit == kinematics::TaskUnit::kMetre;
  const double per_si = metres ? 1e3 : 1.0;
  const char* unit = metres ? " mm" : "";
  out << fmt::format("task {}: at least {:.3g}{} at {}; {} of the points below {:.3g}{}\n", describe(one.task, arms),
                     per_si * one.nearest, unit, placeOf(one.nearest_point), one.near_points,
                     per_si * one.task.position.x(), unit);
}

}  // namespace

Json reportJson(const dds::TrajectoryReport& report) {
  Json json{
      {"feasible", report.feasible != 0},         {"start", report.start},
      {"planar_start", report.planar_start != 0}, {"rotation_conditioning_m_per_rad", report.rotation_conditioning},
      {"points", report.points.size()},           {"unreachable", Json::array()}};
  double stability = 1.0, clearance = INFINITY;
  for (const dds::PointReport& point : report.points) {
    stability = std::min(stability, point.stability);
    clearance = std::min(clearance, point.clearance);
    if (!reached(point))
      json["unreachable"].push_back(pointJson(point));
  }
  json["smallest_stability"] = stability;
  json["smallest_clearance_m"] = std::isfinite(clearance) ? Json(clearance) : Json();
  return json;
}

void print(const dds::TrajectoryReport& report, std::ostream& out) {
  if (!report.start.empty()) {
    out << "not feasible: " << report.start << '\n';
    return;
  }
  if (report.planar_start != 0) {
    out << "note: at the start all rotations of an arm move its tip along one line, as where its tubes bend in one "
           "plane; for a motion inward in that plane control first rotates the tubes slightly against each other\n";
  }
  for (const dds::PointReport& point : report.points) {
    if (!reached(point))
      out << "point " << point.point << ": " << point.reason << '\n';
  }
  if (report.feasible != 0)
    out << "feasible: all " << report.points.size() << " points\n";
  else
    out << "not feasible: " << computation::unreachable(report) << " of " << report.points.size() << " points\n";
}

Json freedomJson(const std::vector<planning::TaskFreedom>& freedom, const std::vector<std::string>& arms) {
  Json json = Json::array();
  for (const planning::TaskFreedom& one : freedom) {
    if (one.soft()) {
      json.push_back({{"task", describe(one.task, arms)},
                      {"distance", one.task.position.x()},
                      {"nearest", one.nearest},
                      {"nearest_point", one.nearest_point},
                      {"near_points", one.near_points}});
      continue;
    }
    json.push_back({{"task", describe(one.task, arms)},
                    {"degrees_of_freedom", one.rows},
                    {"rank", one.rank},
                    {"rank_point", one.rank_point},
                    {"smallest_singular_value", one.least},
                    {"smallest_point", one.least_point}});
  }
  return json;
}

void print(const std::vector<planning::TaskFreedom>& freedom, const std::vector<std::string>& arms, std::ostream& out) {
  int rows = 0, rank = 0;
  for (const planning::TaskFreedom& one : freedom) {
    if (one.soft()) {
      printSoft(one, arms, out);
      continue;
    }
    rows += one.rows;
    rank += one.rank;
    out << "task " << describe(one.task, arms) << ": rank " << one.rank << " of " << one.rows
        << ", smallest singular value " << fmt::format("{:.3g}", one.least) << " at " << placeOf(one.least_point)
        << '\n';
  }
  out << "all tasks: rank " << rank << " of " << rows << '\n';
}

Json leaderJson(const LeaderPrediction& leader) {
  const Eigen::Vector3d& place = leader.planned.place;
  return {{"deviation_m", leader.planned.distance},
          {"point", leader.planned.point},
          {"place_m", {place.x(), place.y(), place.z()}},
          {"rehearsed_deviation_m", leader.rehearsed ? Json(*leader.rehearsed) : Json()}};
}

void print(const LeaderPrediction& leader, std::ostream& out) {
  const Eigen::Vector3d place = 1e3 * leader.planned.place;
  out << fmt::format("follow the leader: with the planned joints the shaft leaves its path by {:.3g} mm at most",
                     1e3 * leader.planned.distance);
  if (leader.planned.point > 0)
    out << fmt::format(", at point {}, at [{:.2f}, {:.2f}, {:.2f}] mm", leader.planned.point, place.x(), place.y(),
                       place.z());
  if (leader.rehearsed)
    out << fmt::format("; in the rehearsal by {:.3g} mm", 1e3 * *leader.rehearsed);
  out << '\n';
}

Json rehearsalJson(const dds::RehearsalReport& rehearsal) {
  return {{"end", planning::name(static_cast<planning::RehearsalEnd>(rehearsal.end))},
          {"points", rehearsal.points},
          {"converged", rehearsal.converged},
          {"point", rehearsal.point},
          {"tip_error_m", rehearsal.tip_error},
          {"relative_error_m", rehearsal.relative_error},
          {"limits", rehearsal.limits},
          {"reason", rehearsal.reason},
          {"iterations", rehearsal.iterations},
          {"least_clearance_m", std::isfinite(rehearsal.least_clearance) ? Json(rehearsal.least_clearance) : Json()}};
}

void print(const dds::RehearsalReport& rehearsal, const std::string& method, const char* how, std::ostream& out) {
  if (rehearsal.end == static_cast<std::uint8_t>(planning::RehearsalEnd::kCompleted))
    out << "rehearsal " << how << ": " << method << " completes in " << rehearsal.iterations << " iterations";
  else
    out << "rehearsal " << how << ": " << rehearsal.converged << " of " << rehearsal.points << " points; "
        << rehearsal.reason;
  if (rehearsal.least_clearance < 0.0)
    out << fmt::format("; the arms overlap by up to {:.3g} mm", -1e3 * rehearsal.least_clearance);
  out << '\n';
}

}  // namespace tandem::cli
