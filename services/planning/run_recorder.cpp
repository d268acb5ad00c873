// SPDX-License-Identifier: Apache-2.0
#include "services/planning/run_recorder.h"

#include <algorithm>

#include "robots/limit_description.h"

namespace tandem::planning_service {

void RunRecorder::start(std::int64_t now, std::uint64_t interventions) {
  started_ = now;
  interventions_ = interventions;
  periods_ = 0;
  limits_.clear();
  least_clearance_ = std::numeric_limits<double>::infinity();
}

void RunRecorder::add(const dds::Clearances& clearances) {
  for (const dds::BodyClearance& body : clearances.bodies)
    least_clearance_ = std::min(least_clearance_, body.distance);
}

void RunRecorder::add(const dds::ControlStatus& status) {
  for (std::size_t k = 0; k < status.arm_count; ++k) {
    if (static_cast<safety::OperatingState>(status.operating_state[k]) == safety::OperatingState::kPaused)
      return;
  }
  ++periods_;
  for (std::size_t k = 0; k < status.limit_count; ++k) {
    if (status.limit_arm[k] < robot_.arms.size())
      ++limits_[{status.limit_kind[k], status.limit_arm[k], status.limit_tube[k]}];
  }
}

dds::RunSummary RunRecorder::summary(std::int64_t now,
                                     std::uint64_t interventions,
                                     const robots::Run& run,
                                     const planning::Reference& reference,
                                     const std::string& reason) const {
  const planning::Progress& progress = run.progress();
  dds::RunSummary summary;
  summary.name = run.name();
  summary.phase = static_cast<std::uint8_t>(progress.phase);
  summary.reason = reason;
  summary.points = static_cast<std::uint32_t>(progress.point_count);
  summary.reached = static_cast<std::uint32_t>(progress.converged_points);
  summary.iterations = static_cast<std::uint32_t>(progress.total_iterations);
  summary.duration = 1e-9 * static_cast<double>(now - started_);
  // A drive side that has started anew counts from zero.
  summary.gate_interventions = interventions < interventions_ ? interventions : interventions - interventions_;
  const auto errors = run.errors();
  summary.task_count = static_cast<std::uint8_t>(std::min<std::size_t>(errors.size(), reference.task_count));
  for (std::size_t k = 0; k < summary.task_count; ++k) {
    summary.task_kind[k] = static_cast<std::uint8_t>(reference.tasks[k].kind);
    summary.task_arm[k] = static_cast<std::uint8_t>(reference.tasks[k].arm);
    summary.task_other_arm[k] = static_cast<std::uint8_t>(reference.tasks[k].other_arm);
    summary.rms[k] = errors[k].rms();
    summary.percentile_95[k] = errors[k].percentile(0.95);
    summary.maximum[k] = errors[k].maximum();
  }
  summary.least_clearance = least_clearance_;
  std::vector<std::pair<std::uint64_t, Limit>> limits;
  for (const auto& [limit, count] : limits_)
    limits.emplace_back(count, limit);
  std::ranges::sort(limits, std::greater{}, &std::pair<std::uint64_t, Limit>::first);
  for (const auto& [count, limit] : limits) {
    const auto [kind, arm, tube] = limit;
    summary.limits.push_back(robots::describeLimit(robot_, {static_cast<control::LimitKind>(kind), arm, tube}));
    summary.limit_shares.push_back(static_cast<double>(count) / static_cast<double>(periods_));
  }
  return summary;
}

}  // namespace tandem::planning_service
