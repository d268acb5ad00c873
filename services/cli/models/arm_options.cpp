// SPDX-License-Identifier: Apache-2.0
#include "services/cli/models/arm_options.h"

#include <sstream>

#include "config/arm_names.h"
#include "services/cli/subcommand.h"

namespace tandem::cli {

const config::Arm& armOf(const config::Robot& robot, const std::string& name) {
  if (const auto k = config::findArm(robot, name))
    return robot.arms[*k];
  throw Failure(kUsage, "--arm: found '" + name + "', expected one of: " + config::armNames(robot));
}

Eigen::VectorXd numbersOf(const std::string& option, const std::string& text, int count) {
  std::istringstream line(text);
  const std::vector<experiments::CsvRow> rows = experiments::readRows(line, count);
  if (rows.size() != 1)
    throw Failure(kUsage, option + ": expected " + std::to_string(count) + " numbers separated by commas");
  if (!rows[0].error.empty())
    throw Failure(kUsage, option + ": " + rows[0].error);
  return Eigen::Map<const Eigen::VectorXd>(rows[0].values.data(), count);
}

std::vector<double> poseNumbers(const Eigen::Isometry3d& pose) {
  const Eigen::Vector3d p = pose.translation();
  const Eigen::Quaterniond q(pose.linear());
  return {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()};
}

std::vector<config::CsvColumn> jointColumns(const config::Arm& arm, const std::string& prefix, bool end_angles) {
  std::vector<config::CsvColumn> columns;
  for (int j = 0; j < arm.jointCount(); ++j) {
    const bool translation = arm.limits.isTranslation(j);
    std::string name = arm.joint_names[static_cast<std::size_t>(j)];
    if (end_angles && !translation)
      name.replace(0, std::string("alpha").size(), "theta");
    columns.push_back({prefix + name, translation ? config::Quantity::kLength : config::Quantity::kAngle});
  }
  return columns;
}

std::string refusal(const config::Arm& arm, const experiments::CsvRow& row) {
  if (!row.error.empty())
    return row.error;
  const Eigen::Map<const Eigen::VectorXd> q(row.values.data(), arm.jointCount());
  const safety::LimitViolation outside = safety::worstLimitViolation(arm.limits, q);
  if (outside.amount <= experiments::kViolation)
    return "";
  return "outside the limits of the robot file" + std::string(arm.limits.rows.empty() ? "" : " (equation (1))") + ": " +
         safety::describe(outside, arm.limits, arm.joint_names.at(static_cast<std::size_t>(outside.joint))) +
         " outside";
}

std::string unstable(int conjugate_points) {
  return "unstable: " + std::to_string(conjugate_points) +
         (conjugate_points == 1 ? " conjugate point" : " conjugate points");
}

std::string statusOf(kinematics::ModelStatus status, const kinematics::Tip& tip) {
  if (status != kinematics::ModelStatus::kOk)
    return std::string(kinematics::describe(status));
  return tip.conjugate_points > 0 ? unstable(tip.conjugate_points) : "ok";
}

}  // namespace tandem::cli
