// SPDX-License-Identifier: Apache-2.0
#include "safety/limits.h"

#include <algorithm>

namespace tandem::safety {

double rowValue(const LinearRow& row, const Eigen::Ref<const Eigen::VectorXd>& q) noexcept {
  double value = 0.0;
  for (Eigen::Index j = 0; j < row.a.size(); ++j) {
    // Joints that are not in the row must not spoil it, whatever they hold.
    if (row.a[j] != 0.0)
      value += row.a[j] * q[j];
  }
  return value;
}

double largestViolation(const ArmLimits& limits, const Eigen::Ref<const Eigen::VectorXd>& q) {
  double largest = -kUnlimited;
  for (int j = 0; j < limits.jointCount(); ++j) {
    const JointLimit& joint = limits.joints[j];
    largest = std::max({largest, joint.lower - q[j], q[j] - joint.upper});
  }
  for (const LinearRow& row : limits.rows)
    largest = std::max(largest, rowValue(row, q) - row.b);
  return largest;
}

std::string describe(const LinearRow& row) {
  const char* kind = row.kind == RowKind::kCarriageSpacing ? "carriage spacing" : "minimum extension";
  return "tube " + std::to_string(row.outer_joint + 1) + " against tube " + std::to_string(row.inner_joint + 1) + " (" +
         kind + ")";
}

}  // namespace tandem::safety
