// SPDX-License-Identifier: Apache-2.0
#include "safety/limits.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace tandem::safety {

double rowValue(const LinearRow& row, const Eigen::Ref<const Eigen::VectorXd>& q) noexcept {
  double value = 0.0;
  for (Eigen::Index j = 0; j < row.a.size(); ++j) {
    // Joints that are not in the row must not change it, even with NaN.
    if (row.a[j] != 0.0)
      value += row.a[j] * q[j];
  }
  return value;
}

namespace {

/// Calls note(joint, amount) for both sides of each box and for each row, which counts for its outer joint.
template <class Note>
void forEachViolation(const ArmLimits& limits, const Eigen::Ref<const Eigen::VectorXd>& q, Note note) noexcept {
  for (int j = 0; j < limits.jointCount(); ++j) {
    const JointLimit& joint = limits.joints[static_cast<std::size_t>(j)];
    note(j, joint.lower - q[j]);
    note(j, q[j] - joint.upper);
  }
  for (const LinearRow& row : limits.rows)
    note(row.outer_joint, rowValue(row, q) - row.b);
}

}  // namespace

LimitViolation worstLimitViolation(const ArmLimits& limits, const Eigen::Ref<const Eigen::VectorXd>& q) noexcept {
  LimitViolation largest{0, -kUnlimited};
  forEachViolation(limits, q, [&largest](int joint, double amount) {
    if (amount > largest.amount)
      largest = {joint, amount};
  });
  return largest;
}

LimitViolation readOutside(const ArmLimits& limits, const Eigen::Ref<const Eigen::VectorXd>& q) noexcept {
  LimitViolation largest;
  forEachViolation(limits, q, [&](int joint, double amount) {
    const double tolerance = kPositionTolerance + limits.joints[static_cast<std::size_t>(joint)].reading_error;
    if (!(amount <= std::max(tolerance, largest.amount)))
      largest = {joint, amount};
  });
  return largest;
}

ArmVector broughtInside(const ArmLimits& limits, const ArmVector& q) noexcept {
  ArmVector inside = q;
  const auto move = [&](int j, double by) {
    const JointLimit& joint = limits.joints[static_cast<std::size_t>(j)];
    inside[j] = std::clamp(inside[j] + by, joint.lower, joint.upper);
  };
  for (int j = 0; j < limits.jointCount(); ++j)
    move(j, 0.0);
  // A corrected row may violate the next one, outwards: this ends after as many rounds as there are tubes.
  for (int round = 0; round < limits.jointCount(); ++round) {
    for (const LinearRow& row : limits.rows) {
      for (const int j : {row.outer_joint, row.inner_joint}) {
        if (const double excess = rowValue(row, inside) - row.b; excess > 0.0)
          move(j, -excess / row.a[j]);
      }
    }
  }
  return inside;
}

double largestViolation(const ArmLimits& limits, const Eigen::Ref<const Eigen::VectorXd>& q) {
  return worstLimitViolation(limits, q).amount;
}

std::string describe(const LimitViolation& outside, const ArmLimits& limits, const std::string& joint) {
  const bool translation = limits.isTranslation(outside.joint);
  char amount[40];
  std::snprintf(amount, sizeof amount, "%.6g %s", (translation ? 1e3 : 180.0 / M_PI) * outside.amount,
                translation ? "mm" : "deg");
  return joint + " is " + amount;
}

std::string describe(const LinearRow& row) {
  const char* kind = row.kind == RowKind::kCarriageSpacing ? "carriage spacing" : "minimum extension";
  return "tube " + std::to_string(row.outer_joint + 1) + " against tube " + std::to_string(row.inner_joint + 1) + " (" +
         kind + ")";
}

}  // namespace tandem::safety
