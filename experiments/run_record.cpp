// SPDX-License-Identifier: Apache-2.0
#include "experiments/run_record.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <tuple>

#include "planning/trajectory.h"

namespace tandem::experiments {

std::string RunKey::name() const { return trajectory + "-" + configuration + "-" + std::string(control::name(method)); }

RunRecord::RunRecord(RunKey key, const RobotModel& robot, int point_count, double tolerance)
    : key_(std::move(key)), robot_(robot), point_count_(point_count), tolerance_(tolerance) {
  limits_.setLimits(robot.limits().data(), robot.armCount());
  if (!robot.models().empty())
    tips_ = planning::TipFollower(robot.models(), robot.limits());
  rows_.reserve(4 * static_cast<std::size_t>(std::max(point_count, 1)));
}

namespace {

/// Largest amount by which translations and rows leave their limits, m; negative inside.
double excessOf(const safety::ArmLimits& limits, const Eigen::VectorXd& q) {
  double excess = -safety::kUnlimited;
  for (int j = 0; j < limits.jointCount(); ++j) {
    const safety::JointLimit& joint = limits.joints[static_cast<std::size_t>(j)];
    if (limits.isTranslation(j))
      excess = std::max({excess, joint.lower - q[j], q[j] - joint.upper});
  }
  for (const safety::LinearRow& row : limits.rows)
    excess = std::max(excess, safety::rowValue(row, q) - row.b);
  return excess;
}

}  // namespace

const planning::TaskReference* taskOf(const planning::Reference& reference, planning::TaskKind kind) {
  for (int t = 0; t < reference.task_count; ++t) {
    if (reference.tasks[static_cast<std::size_t>(t)].kind == kind)
      return &reference.tasks[static_cast<std::size_t>(t)];
  }
  return nullptr;
}

bool isFurther(planning::TaskKind kind) {
  return kind != planning::TaskKind::kRelativePosition && kind != planning::TaskKind::kTipPosition;
}

const planning::TaskReference* shapeTask(const planning::Reference& reference) {
  const planning::TaskReference* tip = taskOf(reference, planning::TaskKind::kTipPosition);
  return tip == nullptr ? taskOf(reference, planning::TaskKind::kTipPose) : tip;
}

std::pair<double, double> errorsOf(const planning::Reference& reference, const Tips& tips) {
  const auto tip = [&](int arm) { return tips[static_cast<std::size_t>(arm)]; };
  std::pair<double, double> errors{0.0, 0.0};
  if (const auto* task = taskOf(reference, planning::TaskKind::kRelativePosition))
    errors.first = (task->position - (tip(task->arm) - tip(task->other_arm))).norm();
  if (const auto* task = shapeTask(reference))
    errors.second = (task->position - tip(task->arm)).norm();
  return errors;
}

namespace {

/// m or rad
double furtherError(const planning::TaskReference& task, const StepData& data, planning::TipFollower& tips) {
  const auto pose = [&](int arm) {
    const auto k = static_cast<std::size_t>(arm);
    return Eigen::Isometry3d(Eigen::Translation3d(data.tip[k]) * data.orientation[k]);
  };
  const kinematics::TaskKindEntry* kind = kinematics::findTaskKind(task.kind);
  if (kind == nullptr)
    return 0.0;
  if (kind->point == kinematics::TaskPoint::kTip)
    return kind->error(kind->place(pose(task.arm), pose(task.other_arm)), task.place());
  tips.update(data.position);
  return kind->error(planning::placeOf(task, tips, nullptr), task.place());
}

}  // namespace

void RunRecord::add(const StepData& data) {
  Row row;
  row.data = data;
  row.relative = taskOf(data.reference, planning::TaskKind::kRelativePosition) != nullptr;
  std::tie(row.error_ab, row.error_a) = errorsOf(data.reference, data.tip);
  for (int t = 0; t < data.reference.task_count; ++t) {
    const auto i = static_cast<std::size_t>(t);
    if (isFurther(data.reference.tasks[i].kind))
      row.error_further[i] = furtherError(data.reference.tasks[i], data, tips_);
  }
  limits_.setPosition(data.setpoint);
  row.lower.resize(robot_.jointCount());
  row.upper.resize(robot_.jointCount());
  for (int j = 0; j < robot_.jointCount(); ++j) {
    row.lower[j] = limits_.joint[j].moving_lower;
    row.upper[j] = limits_.joint[j].moving_upper;
  }
  row.violation = row.excess = -safety::kUnlimited;
  for (int k = 0; k < robot_.armCount(); ++k) {
    const Eigen::VectorXd q = data.setpoint.segment(robot_.offset(k), robot_.size(k));
    const safety::ArmLimits& limits = *robot_.limits()[static_cast<std::size_t>(k)];
    row.violation = std::max(row.violation, safety::largestViolation(limits, q));
    row.excess = std::max(row.excess, excessOf(limits, q));
  }
  rows_.push_back(std::move(row));
}

ErrorStatistics statisticsOf(const std::vector<double>& errors) {
  if (errors.empty())
    return {};
  double sum = 0.0, squares = 0.0, max = 0.0;
  for (const double error : errors) {
    sum += error;
    squares += error * error;
    max = std::max(max, error);
  }
  const auto count = static_cast<double>(errors.size());
  const double mean = sum / count, mean_square = squares / count;
  return {std::sqrt(mean_square), std::sqrt(std::max(0.0, mean_square - mean * mean)), max, mean, errors.size()};
}

bool RunRecord::lastOfPoint(std::size_t row) const {
  return row + 1 == rows_.size() || rows_[row + 1].data.point != rows_[row].data.point;
}

std::vector<FurtherErrors> RunRecord::furtherErrors() const {
  std::vector<FurtherErrors> all;
  const planning::Reference none, &reference = rows_.empty() ? none : rows_.back().data.reference;
  for (int t = 0; t < reference.task_count; ++t) {
    const auto task = static_cast<std::size_t>(t);
    if (!isFurther(reference.tasks[task].kind))
      continue;
    std::vector<double> errors;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (lastOfPoint(i))
        errors.push_back(rows_[i].error_further[task]);
    }
    all.push_back({reference.tasks[task], statisticsOf(errors)});
  }
  return all;
}

RunSummary RunRecord::summary() const {
  RunSummary summary;
  summary.key = key_;
  summary.points = point_count_;
  summary.failure = failure_;
  summary.snaps = snaps_;
  summary.iterations = static_cast<int>(rows_.size());
  std::vector<double> ab, a;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Row& row = rows_[i];
    summary.gate_actions += row.data.gate_actions;
    summary.limit_violations += row.violation > kViolation ? 1 : 0;
    if (row.excess > kViolation)
      summary.largest_excess = std::max(summary.largest_excess, row.excess);
    if (!lastOfPoint(i))
      continue;
    if (row.relative)
      ab.push_back(row.error_ab);
    a.push_back(row.error_a);
    summary.converged += row.error_ab <= tolerance_ && row.error_a <= tolerance_ ? 1 : 0;
  }
  summary.further = furtherErrors();
  summary.ab = statisticsOf(ab);
  summary.a = statisticsOf(a);
  return summary;
}

}  // namespace tandem::experiments
