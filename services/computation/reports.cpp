// SPDX-License-Identifier: Apache-2.0
#include "services/computation/reports.h"

#include <algorithm>
#include <functional>

namespace tandem::computation {
namespace {

std::array<double, 3> arrayOf(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

dds::PointReport reportOf(const planning::PointReport& from) {
  dds::PointReport to;
  to.point = static_cast<std::uint32_t>(from.point);
  to.reach = static_cast<std::uint8_t>(from.reach);
  to.reason = from.reason;
  to.wanted = arrayOf(from.wanted.tip);
  to.wanted_relative = arrayOf(from.wanted.relative);
  to.tip = arrayOf(from.tip);
  to.relative = arrayOf(from.actual_relative);
  to.error = from.error;
  to.relative_error = from.relative_error;
  to.stability = from.stability;
  to.clearance = from.clearance;
  to.joints = listOf(from.q);
  return to;
}

}  // namespace

std::vector<double> listOf(const Eigen::Ref<const Eigen::VectorXd>& numbers) {
  return {numbers.begin(), numbers.end()};
}

dds::TrajectoryReport reportOf(const planning::FeasibilityReport& from) {
  dds::TrajectoryReport to;
  to.feasible = from.feasible ? 1 : 0;
  to.start = from.start;
  to.planar_start = from.planar_start ? 1 : 0;
  to.rotation_conditioning = from.rotation_conditioning;
  for (const planning::PointReport& point : from.points)
    to.points.push_back(reportOf(point));
  return to;
}

dds::RehearsalReport reportOf(const planning::Rehearsal& from) {
  dds::RehearsalReport to;
  to.end = static_cast<std::uint8_t>(from.end);
  to.points = static_cast<std::uint32_t>(from.points);
  to.converged = static_cast<std::uint32_t>(from.converged);
  to.point = static_cast<std::uint32_t>(from.point);
  to.tip_error = from.tip_error;
  to.relative_error = from.relative_error;
  to.limits = from.limits;
  to.reason = from.reason;
  to.iterations = static_cast<std::uint32_t>(from.iterations);
  to.largest_violation = from.largest_violation;
  to.fastest_rotation = from.fastest_rotation;
  to.least_clearance = from.least_clearance;
  for (const planning::RehearsedJoints& at : from.path.joints) {
    to.joints.insert(to.joints.end(), at.q.begin(), at.q.end());
    to.joints_points.push_back(static_cast<std::uint32_t>(at.point));
  }
  to.stride = static_cast<std::uint32_t>(from.path.stride);
  return to;
}

dds::IkReport reportOf(const planning::IkAnswer& from) {
  dds::IkReport to;
  to.reach = static_cast<std::uint8_t>(from.reach);
  to.reason = from.reason;
  to.joints = listOf(from.q);
  for (const Eigen::Vector3d& tip : from.tips)
    to.tips.insert(to.tips.end(), tip.begin(), tip.end());
  to.errors = from.error;
  to.angles = from.angle;
  for (const planning::ActiveLimit& limit : from.limits)
    to.limits.push_back({static_cast<std::uint8_t>(limit.arm), limit.description, limit.force});
  to.stability = from.stability;
  to.clearance = from.clearance;
  to.starts = static_cast<std::uint32_t>(from.starts);
  to.iterations = static_cast<std::uint32_t>(from.iterations);
  return to;
}

dds::TimingReport reportOf(const planning::Timing& from) {
  return {static_cast<std::uint8_t>(from.status), from.time, {from.limiting.begin(), from.limiting.end()}};
}

dds::StartReport reportOf(const planning::StartCandidate& from, const safety::RobotVector& given) {
  return {listOf(from.q), static_cast<std::uint32_t>(from.unreachable), from.room, from.mean_room,
          static_cast<std::uint8_t>(from.q == given ? 1 : 0)};
}

bool reached(const dds::PointReport& point) {
  return point.reach == static_cast<std::uint8_t>(planning::Reach::kReached);
}

int unreachable(const dds::TrajectoryReport& report) {
  return static_cast<int>(std::ranges::count_if(report.points, std::not_fn(reached)));
}

}  // namespace tandem::computation
